"""Recordings, pairs and maps become sources: the very maps, on one clock, with their labels."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr
from small_pairs import write_pairs
from swinging_recordings import FRAMES, RATE_HZ, recording

from sd2core.accuracy.places import PlacedPlan
from sd2core.accuracy.plans import AccuracyPlan
from sd2core.accuracy.trial import synthesizer_for
from sd2core.body.parts import synthetic_map
from sd2core.classify.data import clips_of_map
from sd2core.datasets.card import describe_dataset, limits
from sd2core.datasets.clips import clips_of_dataset
from sd2core.datasets.forecast import Counting
from sd2core.datasets.labelled import labelled_facts, people_of
from sd2core.datasets.labelled_source import LabelledSource
from sd2core.datasets.reading import open_dataset
from sd2core.datasets.recording_sources import Making
from sd2core.datasets.source import Source
from sd2core.datasets.sources import gather
from sd2core.datasets.writing import write_dataset
from sd2core.denoise.files import find_model, load_model
from sd2core.doppler import PRESETS, Synthesizer
from sd2core.errors import Sd2Error
from sd2core.files.resources import resource_path
from sd2core.fmcw.processing import doppler_map
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.labels.files import write_labels
from sd2core.labels.label_set import Label, LabelSet
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.mocap.recording_pairs import make_recording_pairs
from sd2core.options.exporting import Exporting
from sd2core.pairs.store import read_pairs
from sd2core.pairs.summary import names_together, pair_facts
from sd2core.placements.body_extent import BodyExtent
from sd2core.placements.placements import PlacementGrid
from sd2core.progress import silent
from sd2core.radar_config import CLUTTER
from sd2core.recording.recording import Recording
from sd2core.sensor import Beam
from sd2core.train.data import read_mixed
from tests.damaged_files import lose

GRID = PlacementGrid((1.0, 2.5), (0.0, 30.0))
SWINGS = LabelSet("Swings", (Label("swing", "#0072b2", "1", "vertical"),))


def made(*paths: Path, making: Making | None = None, **others: object) -> list[Source]:
    lazily = gather(paths, making or Making(), **others)  # type: ignore[arg-type]
    return [one.load(silent) for one in lazily]


def test_a_recording_is_its_own_maps_on_the_clock_of_its_mesh(tmp_path: Path) -> None:
    one = recording(tmp_path / "anna.sd2", offset_s=1.0, radar_frames=60, simulated=False)
    (source,) = made(one.folder)
    assert source.key == ("anna", "anna", 0)
    assert tuple(source.maps) == ("synthetic", "denoised", "real")
    synthetic = Synthesizer(one.load_mesh(), PRESETS["paper"]).map(one.sensor)
    assert np.array_equal(source.maps["synthetic"].values, synthetic.values)
    denoised = load_model("denoiser").denoise(synthetic)
    assert np.array_equal(source.maps["denoised"].values, denoised.values)
    # The radar is there from 1 s to 3 s of the mesh.
    radar = doppler_map(one.load_capture(), axis=synthetic.axis, clutter=CLUTTER)
    real = source.maps["real"]
    assert np.array_equal(real.values[:, 30:90], radar.values)
    assert real.present is not None
    assert np.flatnonzero(real.present).tolist() == list(range(30, 90))
    swings = (synthetic.times_s >= 1.0) & (synthetic.times_s < 2.0)
    assert [source.labels[number] for number in source.label] == [
        "swing" if there else "background" for there in swings
    ]
    assert source.spherical[0] == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize("beam", [None, Beam(60.0, 20.0)])
def test_every_placement_is_seen_from_there(tmp_path: Path, beam: Beam | None) -> None:
    one = recording(tmp_path / "anna.sd2")
    one.sensor = replace(one.sensor, beam=beam)
    one.save()
    making = Making(kinds=("synthetic", "simulated"), placements=GRID)
    sources = made(one.folder, making=making)
    assert [source.placement for source in sources] == [0, 1, 2, 3, 4]
    assert ["simulated" in source.maps for source in sources] == [True] + [False] * 4
    mesh = one.load_mesh()
    maps = Synthesizer(mesh, PRESETS["paper"])
    target_m = BodyExtent.of(mesh).target_m
    for source, place in zip(sources[1:], GRID.places(), strict=True):
        sensor = replace(place.sensor(target_m), beam=beam)
        assert source.sensor == sensor
        assert source.spherical == pytest.approx(
            (place.range_m, place.azimuth_deg, place.elevation_deg), abs=1e-9
        )
        assert np.array_equal(source.maps["synthetic"].values, maps.map(sensor).values)


def test_each_recording_is_seen_from_where_it_plans(tmp_path: Path) -> None:
    planning = recording(tmp_path / "anna.sd2", radar=False)
    planning.placements = GRID
    planning.save()
    other = recording(tmp_path / "ben.sd2", radar=False)
    making = Making(kinds=("synthetic",), placements="planned")
    keys = [one.key for one in gather([planning.folder, other.folder], making)]
    assert keys == [*(("anna", "anna", k) for k in range(5)), ("ben", "ben", 0)]


def test_a_tolerance_chooses_a_plan_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = recording(tmp_path / "anna.sd2", radar=False)
    asked: list[tuple[int, int, float]] = []
    plan = AccuracyPlan(visibility="facing", beyond="drop")

    def choose(mesh: Any, places: Any, frames: int, tolerance: float, _: Any) -> PlacedPlan:
        asked.append((len(places), frames, tolerance))
        return PlacedPlan(plan, 0.01, ("Nothing is hidden",))

    monkeypatch.setattr("sd2core.datasets.recording_sources.choose_for_places", choose)
    making = Making(kinds=("synthetic",), tolerance=0.05, placements=GRID)
    sources = made(one.folder, making=making)
    # Once per recording, however many placements.
    assert asked == [(3, FRAMES * 5, 0.05)]
    for source in sources:
        assert source.made_of()["plan"]["text"] == str(plan)
        assert source.made_of()["plan_error_l1"] == 0.01
        planned = synthesizer_for(plan, one.load_mesh(), PRESETS["paper"])
        expected = planned.map(source.sensor).values
        assert np.array_equal(source.maps["synthetic"].values, expected)


def test_suggestions_are_no_labels_and_classes_come_from_the_label_set(tmp_path: Path) -> None:
    one = recording(tmp_path / "anna.sd2", radar=False)
    one.labels = Labels(
        (LabelTrack("Gestures"),),
        (
            Span(1, "Gestures", 0.5, 1.0, "swing"),
            Span(2, "Gestures", 2.0, 2.5, "swing", origin="suggestion"),
            Span(3, "Gestures", 3.0, 3.5, "pause"),
            Span(4, "Gestures", 3.6, 3.9, "Background"),
        ),
        SWINGS,
    )
    one.save()
    (source,) = made(one.folder, making=Making(kinds=("synthetic",)))
    assert source.labels == ("background", "swing", "pause")
    own = {"swing": "vertical", "background": "background", "pause": "pause"}
    assert source.classes == own
    assert np.bincount(source.label).tolist() == [90, 15, 15]


def test_a_classifier_learns_the_same_from_a_recording_and_from_its_data_set(
    tmp_path: Path,
) -> None:
    """Also a label that its set does not have, and not one that the set gives no class."""
    one = recording(tmp_path / "anna.sd2", radar=False)
    names = ("swing", "talk", "pause")
    spans = [Span(n, "Gestures", float(n), n + 0.5, name) for n, name in enumerate(names, start=1)]
    known = LabelSet(
        "Own", (Label("swing", "#0072b2", gesture_class="up"), Label("talk", "#d55e00"))
    )
    one.labels = Labels((LabelTrack("Gestures"),), tuple(spans), known)
    one.save()
    making, options = Making(kinds=("synthetic",)), Exporting(kinds=("synthetic",))
    write_dataset(tmp_path / "set.zarr", gather([one.folder], making), options)
    (shown,) = made(one.folder, making=making)
    alone = clips_of_map(shown.maps["synthetic"], one.labels, subject="anna", movement="anna")
    with open_dataset(tmp_path / "set.zarr") as dataset:
        whole = clips_of_dataset(dataset, "synthetic")
    assert whole.classes == alone.classes == ("background", "pause", "up")
    np.testing.assert_array_equal(whole.clips[0].label, alone.clips[0].label)


def test_a_recording_that_is_shown_without_a_denoiser_has_no_denoised_map(tmp_path: Path) -> None:
    one = recording(tmp_path / "anna.sd2", radar=False)
    one.bundled_denoiser = ""
    one.save()
    (source,) = made(one.folder)
    assert tuple(source.maps) == ("synthetic",)
    (lazily,) = gather([one.folder], Making())
    assert lazily.outline is not None
    assert lazily.outline().kinds == ("synthetic",)


@pytest.mark.one_in(2)
@pytest.mark.parametrize("kind", ["simulated", "real"])
def test_pairs_are_taken_take_by_take(tmp_path: Path, kind: str) -> None:
    path = write_pairs(tmp_path / "p.zarr", ("s1", "s2"), kind=kind, placements=2)
    sources = made(path, making=Making(kinds=("synthetic", "simulated", "real")))
    pairs = read_pairs(path)
    for source, take in zip(sources, pairs.takes, strict=True):
        assert source.key == (take.subject, take.name, take.placement)
        assert np.array_equal(source.maps["synthetic"].values.T, take.synthetic)
        assert np.array_equal(source.maps[kind].values.T, take.radar)  # type: ignore[index]
        assert np.array_equal(source.label, take.label)
        assert source.sensor.position_m == tuple(take.sensor_position_m)


def test_limb_maps_of_pairs_are_those_of_their_store(tmp_path: Path) -> None:
    making = Making(kinds=("synthetic", "simulated"), limbs=True)
    path = write_pairs(tmp_path / "p.zarr", ("s1", "s2"), takes=1, limbs=True)
    out = tmp_path / "set.zarr"
    options = Exporting(kinds=making.kinds, segment_frames=30, overlap_frames=0, limbs=True)
    forecast = Counting.of(gather([path], making)).forecast(options, 8)
    write_dataset(out, gather([path], making), options)
    with open_dataset(out) as dataset:
        found = dataset["limbs"][:].reshape(2, 150, 9, 8)
        written = sum(
            array.dtype.itemsize * int(np.prod(array.shape)) for array in dataset.arrays.values()
        )
    for values, take in zip(found, read_pairs(path).takes, strict=True):
        assert take.limbs is not None
        assert np.array_equal(values, take.limbs.values.transpose(2, 0, 1))
    assert forecast.total_bytes == written
    unsplit = write_pairs(tmp_path / "unsplit.zarr", ("s1",))
    with pytest.raises(Sd2Error, match=r"unsplit.zarr: pairs without.*sd2 simulate campaign --l"):
        gather([path, unsplit], making)


def test_recordings_whose_limbs_are_not_known_are_left_out(tmp_path: Path) -> None:
    octahedron = recording(tmp_path / "anna.sd2", radar=False)
    mesh = load_mesh(resource_path("swipes.sd2") / "mesh.zarr").between(30, 50)
    save_mesh(mesh, tmp_path / "mesh.npz")
    body = Recording.create(tmp_path / "ben.sd2", mesh=tmp_path / "mesh.npz")
    making = Making(kinds=("synthetic",), limbs=True)
    sources = gather([octahedron.folder, body.folder], making)
    options = Exporting(kinds=("synthetic",), segment_frames=10, overlap_frames=0, limbs=True)
    forecast = Counting.of(sources).forecast(options, 32)
    written = write_dataset(tmp_path / "set.zarr", sources, options)
    assert forecast.segments == written.segments == 2
    for reason in (*forecast.failed, *(one.reason for one in written.failed)):
        assert "the parts of the body are not known" in reason
    assert len(forecast.failed) == len(written.failed) == 1
    known = synthetic_map(Synthesizer(mesh, PRESETS["paper"]), body.sensor, limbs=True)
    assert known.limbs is not None
    with open_dataset(tmp_path / "set.zarr") as dataset:
        found, whole = dataset["limbs"][:].reshape(20, 9, 32), dataset["synthetic"][:]
    np.testing.assert_array_equal(found, known.limbs.values.transpose(2, 0, 1))
    np.testing.assert_allclose(found.sum(axis=1), whole.reshape(20, 32), rtol=1e-6)


def test_people_of_two_stores_are_different_people(tmp_path: Path) -> None:
    paths = [write_pairs(tmp_path / f"{name}.zarr", ("s1", name), takes=1) for name in "ab"]
    sources = gather(paths, Making(kinds=("synthetic",)))
    assert [one.key.subject for one in sources] == ["a:s1", "a", "b:s1", "b"]


def test_of_recordings_a_person_is_one_in_all_stores(tmp_path: Path) -> None:
    """On Monday, on Friday, and in variants: no one validates what they were learnt from."""
    made = {"monday": {"recordings": ["take1.sd2"]}, "friday": {"recordings": ["take2.sd2"]},
            "varied": {"sources": ["take1.sd2", "take2.sd2"]}}  # fmt: skip
    paths = [write_pairs(tmp_path / f"{name}.zarr", ("anna", "ben"), **sources)
             for name, sources in made.items()]  # fmt: skip
    assert read_mixed(paths).subjects == ("anna", "ben")
    mars = write_pairs(tmp_path / "mars.zarr", ("1",), made_by="sd2 pairs mars")
    varied = write_pairs(
        tmp_path / "mars-varied.zarr", ("1",), sources=["mars_subject1"], variant={}
    )
    assert read_mixed([mars, varied]).subjects == ("1",)


def test_stores_of_one_name_are_told_apart_by_their_folders(tmp_path: Path) -> None:
    paths = []
    for folder in ("first", "second"):
        (tmp_path / folder).mkdir()
        paths.append(write_pairs(tmp_path / folder / "pairs.zarr", ("s1",), takes=1))
    mixed = read_mixed([*paths, paths[0]])
    assert mixed.subjects == ("first pairs:s1", "second pairs:s1")
    assert len(mixed.takes) == 2
    assert {one.key.subject for one in gather(paths, Making(("synthetic",)))} == {*mixed.subjects}


def test_stores_of_the_same_recordings_have_the_same_people(tmp_path: Path) -> None:
    """Else one person would be in the training and in the test."""
    mars = [
        write_pairs(tmp_path / f"{name}.zarr", ("1", "4"), made_by="sd2 pairs mars")
        for name in ("plain", "varied")
    ]
    other = write_pairs(tmp_path / "own.zarr", ("4", "anna"))
    stores = [pair_facts(path) for path in (*mars, other)]
    same = {"1": "1", "4": "plain:4"}
    assert names_together(stores) == [same, same, {"4": "own:4", "anna": "anna"}]
    people = {"1", "plain:4", "own:4", "anna"}
    assert set(read_mixed([*mars, other]).subjects) == people
    assert set(people_of([labelled_facts(LabelledSource(one.path)) for one in stores])) == people
    keys = [one.key for one in gather([*mars, other], Making(kinds=("synthetic",)))]
    assert {key.subject for key in keys} == people
    assert len(set(keys)) == len(keys)


@pytest.mark.parametrize(
    ("first", "second", "alike"),
    [
        ({"recordings": ["a.sd2"]}, {"variant": "mirrored", "sources": ["a.sd2"]}, True),
        ({"made_by": "sd2 pairs mars"}, {"variant": "shapes", "sources": ["mars_subject1"]}, True),
        ({"made_by": "sd2 pairs mars"}, {"recordings": ["a.sd2"]}, False),
        *(
            ({"made_by": "sd2 simulate campaign", "seed": 1},
             {"made_by": "sd2 simulate campaign", "seed": seed}, seed == 1)
            for seed in (1, 2)
        ),
    ],
)  # fmt: skip
def test_movements_and_their_variants_are_of_the_same_people(
    first: dict[str, object], second: dict[str, object], alike: bool, tmp_path: Path
) -> None:
    facts = pair_facts(write_pairs(tmp_path / "a.zarr", ("s01",)))
    stores = [
        facts.model_copy(update={"path": Path(f"{name}.zarr"), "provenance": made})
        for name, made in (("a", first), ("b", second))
    ]
    one, other = names_together(stores)
    assert (one == other) is alike


def test_a_map_is_labelled_by_a_file(tmp_path: Path) -> None:
    one = recording(tmp_path / "anna.sd2", radar=False)
    Synthesizer(one.load_mesh(), PRESETS["paper"]).map(one.sensor).save(tmp_path / "map.npz")
    labels = Labels((LabelTrack("Gestures"),), (Span(1, "Gestures", 1.0, 2.0, "swing"),), SWINGS)
    write_labels(tmp_path / "labels.json", labels)
    (source,) = made(tmp_path / "map.npz", label_files=[tmp_path / "labels.json"])
    assert source.labels == ("background", "swing")
    assert np.flatnonzero(source.label).tolist() == list(range(30, 60))
    assert source.sensor == one.sensor
    (unlabelled,) = made(tmp_path / "map.npz")
    assert not unlabelled.label.any()


@pytest.mark.parametrize("simulated", [True, False])
def test_what_is_made_of_a_simulated_recording_says_so(tmp_path: Path, simulated: bool) -> None:
    one = recording(tmp_path / "anna.sd2")
    one.simulated = simulated
    one.save()
    counted = Synthesizer(one.load_mesh(), PRESETS["paper"]).map(one.sensor)
    counted.save(tmp_path / "map.npz")
    load_model("denoiser").denoise(counted).save(tmp_path / "denoised.npz")
    make_recording_pairs([one.folder], tmp_path / "pairs.zarr")
    names = ("anna.sd2", "map.npz", "denoised.npz", "pairs.zarr")
    sources = [source for name in names for source in made(tmp_path / name)]
    assert len(sources) >= len(names)
    assert {source.provenance["simulated"] for source in sources} == {simulated}


def test_what_was_counted_is_what_is_written(tmp_path: Path) -> None:
    (tmp_path / "all").mkdir()
    for name in ("anna", "ben"):
        recording(tmp_path / "all" / f"{name}.sd2", offset_s=0.0)
    making = Making(kinds=("synthetic", "simulated"), placements=PlacementGrid((1.0,)))
    options = Exporting(kinds=making.kinds, segment_frames=30, overlap_frames=5)
    sources = gather([tmp_path / "all"], making)
    forecast = Counting.of(sources).forecast(options, 32)
    out = tmp_path / "set.zarr"
    written = write_dataset(out, sources, options)
    with open_dataset(out) as dataset:
        assert forecast.segments == written.segments == len(dataset)
        named = np.bincount(dataset["segment_label"][:], minlength=len(dataset.header.labels))
        counts = dict(zip(dataset.header.labels, named.tolist(), strict=True))
        assert forecast.of_label == {name: count for name, count in counts.items() if count}
        available = dataset["available"][:].sum(axis=0).tolist()
        assert forecast.of_kind == {"synthetic": available[0], "simulated": available[2]}
        assert forecast.split.validation == dataset.header.splits["validation"] == ("anna",)
        assert sum(forecast.of_split().values()) == forecast.segments
    assert forecast.total_bytes >= sum(
        array.dtype.itemsize * int(np.prod(array.shape)) for array in dataset.arrays.values()
    )


def test_a_changed_recording_is_noticed(tmp_path: Path) -> None:
    one = recording(tmp_path / "anna.sd2", radar=False)
    options = Exporting(kinds=("synthetic",), segment_frames=30, overlap_frames=5)
    making = Making(kinds=("synthetic",))
    out = tmp_path / "set.zarr"
    write_dataset(out, gather([one.folder], making), options)
    assert write_dataset(out, gather([one.folder], making), options).added == 0
    one.sensor = replace(one.sensor, position_m=(0.5, 0.0, 0.0))
    one.save()
    with pytest.raises(Sd2Error, match="made of something else"):
        write_dataset(out, gather([one.folder], making), options)


def test_another_content_of_the_same_size_is_noticed(tmp_path: Path) -> None:
    one = recording(tmp_path / "anna.sd2")
    making = Making(kinds=("synthetic", "simulated", "denoised"), model=str(tmp_path / "m"))
    (tmp_path / "m").write_bytes(find_model("denoiser").read_bytes())

    def fingerprint() -> str:
        (lazy,) = gather([one.folder], making)
        return lazy.fingerprint()

    first = fingerprint()
    assert fingerprint() == first
    for file in (one.folder / "mesh.npz", one.folder / "radar" / "radar.npy", tmp_path / "m"):
        content = file.read_bytes()
        file.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
        assert fingerprint() != first
        file.write_bytes(content)
        assert fingerprint() == first
    spans = one.labelled.spans
    classes = []
    for name in ("", "to and fro"):
        known = LabelSet("Own", (Label("swing", "#0072b2", gesture_class=name),))
        write_labels(one.folder / "labels.json", Labels((LabelTrack("Gestures"),), spans, known))
        classes.append(fingerprint())
    assert len({first, *classes}) == 3


def test_takes_stay_the_same_when_their_store_grows(tmp_path: Path) -> None:
    few, many = tmp_path / "few.zarr", tmp_path / "many.zarr"
    write_pairs(few, ("s1", "s2"))
    write_pairs(many, ("s1", "s2", "s3"))
    before, after = (
        {one.key: one.fingerprint() for one in gather([path], Making())} for path in (few, many)
    )
    assert len(before) < len(after)
    assert before.items() <= after.items()
    assert len({*after.values()}) == len(after)


def test_what_cannot_be_exported_is_named(tmp_path: Path) -> None:
    one = recording(tmp_path / "anna.sd2", radar=False)
    with pytest.raises(Sd2Error, match="2 people are named for 1 recordings"):
        gather([one.folder], Making(), subjects=["a", "b"])
    with pytest.raises(Sd2Error, match="1 label file for 0 maps"):
        gather([one.folder], Making(), label_files=[tmp_path / "labels.json"])
    with pytest.raises(Sd2Error, match="is of kind mesh"):
        gather([one.folder / "mesh.npz"], Making())
    (source,) = gather([one.folder], Making(kinds=("real",)))
    with pytest.raises(Sd2Error, match="has no map that is wanted"):
        source.load(silent)
    with_radar = recording(tmp_path / "ben.sd2")
    (source,) = gather([with_radar.folder], Making(kinds=("real",)))
    with pytest.raises(Sd2Error, match=r"no real map, but a simulated one.*--kinds simulated"):
        source.load(silent)
    assert len(one.load_mesh().timebase) == FRAMES
    assert one.load_mesh().timebase.frames_per_s == pytest.approx(RATE_HZ)


def damaged_recording(folder: Path) -> Recording:
    """A recording of 120 frames whose mesh has lost frames 40 to 59."""
    one = recording(folder, radar_frames=FRAMES)
    mesh = one.load_mesh()
    group = zarr.open_group(str(folder / "mesh.zarr"), mode="w")
    group.create_array("vertices", data=mesh.vertices[:], chunks=(20, 6, 3))
    for name, values in (("times_s", mesh.timebase.times_s), ("faces", mesh.faces)):
        group.create_array(name, data=values)
    (folder / "mesh.zarr" / "vertices" / "c" / "2" / "0" / "0").unlink()
    again = replace(one, mesh=folder / "mesh.zarr")
    again.save()
    return again


def test_frames_of_damaged_chunks_are_in_no_segment_and_told(tmp_path: Path) -> None:
    one = damaged_recording(tmp_path / "anna.sd2")
    out = tmp_path / "set.zarr"
    options = Exporting(segment_frames=20, overlap_frames=0)
    write_dataset(out, gather([one.folder], Making(kinds=("synthetic",))), options)
    with open_dataset(out) as opened:
        card = describe_dataset(opened)
        starts = opened["start_frame"][:]
    (lazy,) = gather([one.folder], Making(kinds=("synthetic",)))
    assert card["frames_damaged"] == Counting.of([lazy]).forecast(options, 32).frames_damaged == 20
    assert [one for one in limits(card) if "20 frames are lost to damaged chunks" in one]
    assert not [one for one in limits(card) if "without a person" in one]
    assert not [start for start in starts if 20 < start < 60]
    made_pairs = make_recording_pairs([one.folder], tmp_path / "pairs.zarr")
    assert made_pairs.damaged == {"anna.sd2": 20}
    takes = read_pairs(tmp_path / "pairs.zarr").takes
    assert sum(len(take.times_s) for take in takes) == FRAMES - 20


BOTH = Making(kinds=("synthetic", "simulated"))
FIFTIES = Exporting(kinds=BOTH.kinds, segment_frames=50, overlap_frames=0)


@pytest.fixture(scope="module")
def long_pairs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of pairs in two chunks (of 2250: s2 from frame 750 on), and of a data set of them."""
    folder = tmp_path_factory.mktemp("long")
    pairs = write_pairs(folder / "pairs.zarr", takes=1, frames=1500, limbs=True)
    write_dataset(folder / "whole.zarr", gather([pairs], BOTH), FIFTIES)
    return folder


@pytest.mark.one_in(3)
@pytest.mark.parametrize("chunk", ["radar/c/1/0", "times_s/c/1", "limbs/c/1/0/0"])
def test_frames_of_pairs_in_damaged_chunks_are_in_no_segment_and_counted(
    tmp_path: Path, long_pairs: Path, chunk: str
) -> None:
    path = tmp_path / "pairs.zarr"
    shutil.copytree(long_pairs / "pairs.zarr", path)
    lose(path / chunk)
    out, sources = tmp_path / "set.zarr", gather([path], BOTH)
    forecast = Counting.of(sources).forecast(FIFTIES, 32)
    write_dataset(out, sources, FIFTIES)
    with open_dataset(out) as opened, open_dataset(long_pairs / "whole.zarr") as before:
        card = describe_dataset(opened)
        assert len(opened) == forecast.segments == len(before) - 45  # 750 frames, and all of s3
        np.testing.assert_array_equal(opened["simulated"][:], before["simulated"][: len(opened)])
    assert card["frames_damaged"] == forecast.frames_damaged == 2250
    assert [one for one in limits(card) if "2,250 frames are lost to damaged chunks" in one]
