"""Where labels name persons, each of these is a source: their labels, their map, their body."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scenes_of_people import WHO, scene

from sd2core.cli.classify.data import clips_of
from sd2core.datasets.card import describe_dataset, limits
from sd2core.datasets.labelled import labelled_facts
from sd2core.datasets.labelled_source import LabelledSource
from sd2core.datasets.people import told_apart
from sd2core.datasets.reading import open_dataset
from sd2core.datasets.recording_sources import Making
from sd2core.datasets.source import Source
from sd2core.datasets.sources import gather
from sd2core.datasets.writing import write_dataset
from sd2core.denoise.files import load_model
from sd2core.doppler import PRESETS, Synthesizer
from sd2core.errors import Sd2Error
from sd2core.mesh.walls import Wall
from sd2core.options.exporting import Exporting
from sd2core.placements.body_extent import BodyExtent
from sd2core.placements.placements import PlacementGrid
from sd2core.progress import silent
from sd2core.recording.recording import Recording


def made_of(one: Recording, **making: object) -> list[Source]:
    lazily = gather([one.folder], Making(**making))  # type: ignore[arg-type]
    return [lazy.load(silent) for lazy in lazily]


def named(source: Source) -> dict[str, int]:
    names, counts = np.unique(source.label, return_counts=True)
    return {source.labels[name]: int(count) for name, count in zip(names, counts, strict=True)}


def test_each_person_is_a_source_with_their_labels_and_the_map_of_them_alone(
    tmp_path: Path,
) -> None:
    one = scene(tmp_path / "duo.sd2")
    anna, bert = made_of(one)
    assert [source.key for source in (anna, bert)] == [("anna", "duo", 0), ("bert", "duo", 0)]
    assert named(anna) == {"background": 75, "swing": 30, "rest": 15}
    assert named(bert) == {"background": 75, "wave": 30, "rest": 15}
    mesh = one.load_mesh()
    both = Synthesizer(mesh, PRESETS["paper"]).map(one.sensor).values
    maps = [source.maps["synthetic"] for source in (anna, bert)]
    np.testing.assert_allclose(maps[0].values + maps[1].values, both, atol=1e-6)
    alone = Synthesizer(replace(mesh, others=()), PRESETS["paper"]).map(one.sensor)
    np.testing.assert_allclose(maps[0].values, alone.values, atol=1e-6)
    assert maps[1].values.any()
    for source, synthetic in zip((anna, bert), maps, strict=True):
        denoised = load_model("denoiser").denoise(synthetic).values
        np.testing.assert_array_equal(source.maps["denoised"].values, denoised)
    # Bert's file begins a second later, and before that he is not there.
    assert np.flatnonzero(~bert.present).tolist() == list(range(30))
    assert anna.present.all()
    target_m = BodyExtent.of(mesh.others[0]).target_m
    assert bert.target_m == pytest.approx(target_m)


def test_a_radar_sees_everybody_and_says_nothing_where_somebody_else_is_labelled(
    tmp_path: Path,
) -> None:
    anna, bert = made_of(scene(tmp_path / "duo.sd2"))
    unclear = [np.flatnonzero(~source.known["simulated"]).tolist() for source in (anna, bert)]
    assert unclear == [list(range(45, 75)), list(range(30, 60))]
    np.testing.assert_array_equal(anna.maps["simulated"].values, bert.maps["simulated"].values)
    told = anna.made_of()
    assert (told["scene"], told["person"]) == (["anna", "bert"], "anna")
    assert told["everybody"] == ["simulated"]


def test_what_is_foretold_is_what_is_made(tmp_path: Path) -> None:
    one = scene(tmp_path / "duo.sd2")
    nobody_named = scene(tmp_path / "pair.sd2", (("swing", 1.0, 2.0, ""),))
    nobody_named.bodies = (replace(nobody_named.bodies[0], start_s=-1.0),)
    nobody_named.save()
    for lazy in gather([one.folder, nobody_named.folder], Making(kinds=("synthetic",))):
        assert lazy.outline is not None
        outline, source = lazy.outline(), lazy.load(silent)
        assert outline.kinds == tuple(source.maps)
        assert outline.spans == source.spans
        np.testing.assert_array_equal(outline.label, source.label)
        np.testing.assert_array_equal(outline.present, source.present)


def test_from_elsewhere_the_scene_is_counted_once_for_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = scene(tmp_path / "duo.sd2")
    places, count = [], Synthesizer.limb_maps

    def limb_maps(maker: Synthesizer, sensor: object, *args: object, **options: object) -> object:
        places.append(sensor)
        return count(maker, sensor, *args, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(Synthesizer, "limb_maps", limb_maps)
    grid = PlacementGrid((1.0, 2.5), (0.0,))
    sources = made_of(one, kinds=("synthetic",), placements=grid)
    assert [source.key[::2] for source in sources] == [
        (name, place) for place in range(3) for name in ("anna", "bert")
    ]
    assert places == [source.sensor for source in sources[::2]]
    assert [source.sensor for source in sources[1::2]] == places


def test_who_is_not_in_the_scene_is_only_on_the_radar(tmp_path: Path) -> None:
    one = scene(tmp_path / "duo.sd2", (*WHO, ("wave", 0.0, 0.5, "carl")))
    making: dict[str, object] = {"kinds": ("synthetic", "simulated")}
    (carl,) = [source for source in made_of(one, **making) if source.subject == "carl"]
    assert tuple(carl.maps) == ("simulated",)
    with pytest.raises(Sd2Error, match="no map of carl, who is not in its scene"):
        made_of(one, kinds=("synthetic",))


def test_the_only_one_in_a_recording_is_whoever_is_named(tmp_path: Path) -> None:
    one = scene(tmp_path / "solo.sd2", (("swing", 1.0, 2.0, "dora"),))
    one.bodies = ()
    one.save()
    (source,) = made_of(one, kinds=("synthetic",))
    assert source.subject == "dora"
    alone = Synthesizer(one.load_mesh(), PRESETS["paper"]).map(one.sensor)
    np.testing.assert_array_equal(source.maps["synthetic"].values, alone.values)


def test_who_has_no_name_is_somebody_else_in_each_recording(tmp_path: Path) -> None:
    spans = ("wave", 1.5, 2.5, "person 2")
    pair = [scene(tmp_path / f"{name}.sd2", (WHO[0], spans)) for name in "ab"]
    for one in pair:
        one.bodies = (replace(one.bodies[0], person=""),)
        one.save()
    found = [lazy.key.subject for lazy in gather([one.folder for one in pair], Making())]
    assert found == ["anna", "a person 2", "anna", "b person 2"]


@pytest.mark.parametrize(
    ("said", "files", "names"),
    [
        (("", ""), ("anna.sd2", "ben.sd2"), ["anna", "ben"]),
        (("", ""), ("anna/walk.sd2", "ben/walk.sd2"), ["anna", "ben"]),
        (("", "", ""), ("anna/walk.sd2", "ben/walk.sd2", "x/run.sd2"), ["anna", "ben", "run"]),
        (("walk", ""), ("ben/run.sd2", "ben/walk.sd2"), ["walk", "walk"]),
        (("", ""), ("anna/../ben/walk.sd2", "../r/anna/walk.sd2"), ["ben", "anna"]),
        (("eva", "eva"), ("a/walk.sd2", "b/walk.sd2"), ["eva", "eva"]),
        (("", "", ""), ("a/x/w.sd2", "b/x/w.sd2", "w.sd2"), ["/r/a/x/w.sd2", "/r/b/x/w.sd2", "r"]),
    ],
)
def test_who_is_not_named_is_another_person_in_each_file(said, files, names) -> None:
    assert told_apart(said, [Path("/r") / file for file in files]) == names


def test_another_scene_is_no_continuation(tmp_path: Path) -> None:
    one, out = scene(tmp_path / "duo.sd2"), tmp_path / "set.zarr"
    making, options = Making(kinds=("synthetic",)), Exporting(segment_frames=20)
    write_dataset(out, gather([one.folder], making), options)
    assert write_dataset(out, gather([one.folder], making), options).added == 0
    for changed in (
        {"bodies": (replace(one.bodies[0], moved_m=(2.0, 0.0, 0.0)),)},
        {"walls": (Wall(1.2),)},
    ):
        before = {name: getattr(one, name) for name in changed}
        for name, value in changed.items():
            setattr(one, name, value)
        one.save()
        with pytest.raises(Sd2Error, match="made of something else"):
            write_dataset(out, gather([one.folder], making), options)
        for name, value in before.items():
            setattr(one, name, value)
        one.save()


def test_people_are_kept_apart_and_the_card_says_what_shows_everybody(tmp_path: Path) -> None:
    one, out = scene(tmp_path / "duo.sd2"), tmp_path / "set.zarr"
    making, options = Making(kinds=("synthetic", "simulated")), Exporting(segment_frames=20)
    write_dataset(out, gather([one.folder], making), options)
    with open_dataset(out) as dataset:
        assert dataset.header.subjects == ("anna", "bert")
        assert sorted(sum(dataset.header.splits.values(), ())) == ["anna", "bert"]
        card = describe_dataset(dataset)
    assert (card["recordings"], card["placements"]) == (1, 1)
    assert card["minutes"] == pytest.approx(4 / 60)
    assert [said for said in limits(card) if "simulated maps of scenes show everybody" in said]


def test_a_classifier_learns_whose_label_it_is(tmp_path: Path) -> None:
    one = scene(tmp_path / "duo.sd2")
    data = LabelledSource(one.folder)
    assert labelled_facts(data).subjects == ("anna", "bert")
    clips = clips_of([data], ("synthetic", "radar"))
    assert clips.subjects == ("anna", "bert")
    frames = {
        (clip.subject, clip.kind, clips.classes[number]): 0 for clip in clips.clips
        for number in range(len(clips.classes))
    }  # fmt: skip
    for clip in clips.clips:
        for number in clip.label.tolist():
            frames[clip.subject, clip.kind, clips.classes[number]] += 1
    assert frames["anna", "synthetic", "swing"] == 30
    assert frames["anna", "synthetic", "wave"] == frames["bert", "synthetic", "swing"] == 0
    assert frames["bert", "simulated", "wave"] == 15
    assert frames["anna", "simulated", "swing"] == 15
