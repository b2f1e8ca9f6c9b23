"""What labelled data holds is told as ``sd2 classify`` takes it, without a map being made."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from lazy_sources import write_dataset
from made_sources import source

from sd2core.cli.classify.data import clips_of
from sd2core.datasets.labelled import (
    ONE_PERSON,
    labelled_facts,
    people_of,
    unfolded,
)
from sd2core.datasets.labelled_source import LabelledSource
from sd2core.errors import Sd2Error
from sd2core.files.resources import resource_path
from sd2core.options.exporting import Exporting
from sd2core.pairs.store import PairWriter, Take
from sd2core.recording.recording import open_recording
from sd2core.sensor import VelocityAxis

SAMPLE = resource_path("swipes.sd2")


def a_set(path: Path, *people: str, placements: int = 1) -> Path:
    sources = [
        source("r1", person, frames=90, placement=placement)
        for person in people
        for placement in range(placements)
    ]
    write_dataset(path, sources, Exporting(segment_frames=30, overlap_frames=0))
    return path


def pairs(path: Path, *people: str, axis: VelocityAxis | None = None) -> Path:
    axis = axis or VelocityAxis(32, 2.0)
    writer = PairWriter(
        path, kind="simulated", axis=axis, null_bins=(), frame_rate_hz=30.0,
        labels=("background", "left-to-right"), provenance={},
    )  # fmt: skip
    rng = np.random.default_rng(0)
    for person in people:
        values = rng.random((60, axis.bins), np.float32)
        label = np.repeat([0, 1], 30).astype(np.int8)
        times_s = np.arange(60) / 30.0
        writer.append(Take(person, "t", values, values, times_s, label, np.zeros(3)))
    return path


def test_people_are_called_as_a_training_calls_them(tmp_path: Path) -> None:
    own = source("r", "x").maps["synthetic"].axis
    given = [
        LabelledSource(pairs(tmp_path / "b.zarr", "ben", "dora", axis=own)),
        LabelledSource(a_set(tmp_path / "set.zarr", "anna", "ben")),
        LabelledSource(pairs(tmp_path / "a.zarr", "ben", axis=own)),
    ]
    facts = [labelled_facts(one) for one in given]
    assert people_of(facts) == ("anna", "ben", "b:ben", "dora", "a:ben")
    assert clips_of(given, ("synthetic",)).subjects == people_of(facts)


def test_a_recording_is_of_who_is_named(tmp_path: Path) -> None:
    for given, name in (
        (LabelledSource(SAMPLE), "swipes"),
        (LabelledSource(SAMPLE, "ben"), "ben"),
    ):
        facts = labelled_facts(given)
        assert facts.subjects == (name,) == clips_of([given], ("radar",)).subjects
    spans = open_recording(SAMPLE).labelled.spans
    assert (facts.kind, facts.spans, facts.simulated) == ("recording", len(spans), True)
    assert facts.maps == ("synthetic", "denoised", "radar")


def test_a_folder_is_what_it_holds(tmp_path: Path) -> None:
    for name in ("b.sd2", "a.sd2"):
        shutil.copytree(SAMPLE, tmp_path / name)
    (tmp_path / "notes.txt").write_text("nothing to learn from")
    found = unfolded([LabelledSource(tmp_path, "anna")])
    assert found == [LabelledSource(tmp_path / name, "anna") for name in ("a.sd2", "b.sd2")]
    assert people_of([labelled_facts(one) for one in found]) == ("anna",)


@pytest.mark.one_in(3)
@pytest.mark.parametrize("ending", [".zarr", ".h5", ".npz"])
def test_a_data_set_says_who_does_what(tmp_path: Path, ending: str) -> None:
    facts = labelled_facts(LabelledSource(a_set(tmp_path / f"s{ending}", "a", "b", placements=2)))
    assert (facts.kind, facts.placements) == ("data set", 2)
    assert facts.maps == ("synthetic", "denoised")
    # Two people, three segments of a second each; the other place shows the same movements.
    assert facts.duration_s == pytest.approx(6.0)
    assert facts.splits["train"] + facts.splits["validation"] == ("a", "b")


def test_a_radar_file_is_of_one_person(shared_data: Path) -> None:
    folder = shared_data / "radar" / "kkt_gestures"
    facts = [labelled_facts(one) for one in unfolded([LabelledSource(folder)])]
    assert people_of(facts) == (ONE_PERSON,)
    assert {one.maps for one in facts} == {("radar",)}
    assert any(one.spans for one in facts)


def test_what_cannot_be_learnt_from_is_refused(tmp_path: Path) -> None:
    bare = tmp_path / "bare.sd2"
    shutil.copytree(SAMPLE, bare)
    (bare / "labels.json").unlink(missing_ok=True)
    recording = open_recording(bare)
    recording.spans, recording.labels = [], None
    recording.save()
    with pytest.raises(Sd2Error, match="has no labels"):
        labelled_facts(LabelledSource(bare))
    with pytest.raises(Sd2Error, match="is a video"):
        labelled_facts(LabelledSource(SAMPLE / "video.mp4"))
    with pytest.raises(Sd2Error, match="does not exist"):
        unfolded([LabelledSource(tmp_path / "gone.zarr")])
