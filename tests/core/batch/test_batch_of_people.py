"""A batch makes of people in a scene what `sd2 export` makes: each of their own map and labels."""

from __future__ import annotations

import json
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lazy_sources import write_dataset
from pools import SerialPool
from scenes_of_people import WHO, scene

from sd2core.batch.estimate import estimate
from sd2core.batch.folder import BatchFolder
from sd2core.batch.plan_file import plan_from_text
from sd2core.batch.run import BatchEnd, run_batch
from sd2core.datasets.card import describe_dataset
from sd2core.datasets.reading import open_dataset
from sd2core.datasets.recording_sources import Making
from sd2core.datasets.sources import gather
from sd2core.doppler import PRESETS, Synthesizer
from sd2core.maps import DopplerMap
from sd2core.options.exporting import Exporting

PLAN = """
out = "made"
[recordings]
files = ["scenes/*.sd2"]
[recordings.subject_of]
"duo.sd2" = "anna"
[synthesise]
[denoise]
model = "denoiser"
"""
EXPORT = "[export]\nsegment_frames = 15\noverlap_frames = 0\n"
COLUMNS = ("label", "segment_label", "synthetic", "denoised", "simulated", "available", "start_s")


def run(folder: Path, text: str, out: str = "made") -> tuple[BatchEnd, SerialPool]:
    pool = SerialPool(folder / out)
    plan = plan_from_text(text.replace('"made"', f'"{out}"'), folder)
    return run_batch(plan, pool=nullcontext(pool)), pool


def rows_in(folder: Path) -> list[dict[str, object]]:
    lines = BatchFolder(folder / "made").results.read_text().splitlines()
    return [json.loads(line) for line in lines]


@pytest.fixture
def scenes(tmp_path: Path) -> Path:
    (tmp_path / "scenes").mkdir()
    return tmp_path / "scenes"


@pytest.mark.slow
def test_the_data_set_is_that_of_the_command(tmp_path: Path, scenes: Path) -> None:
    one = scene(scenes / "duo.sd2", (*WHO, ("wave", 3.5, 3.9, "carl")))
    end, pool = run(tmp_path, PLAN + EXPORT)
    assert end.failed == 0, BatchFolder(tmp_path / "made").report.read_text()
    assert pool.submitted == {"inspect": 1, "synthesise": 1, "denoise": 2, "export": 1}
    assert end.facts["total"] == {"inspect": 1, "synthesise": 1, "denoise": 2, "export": 1}
    alone = tmp_path / "alone.zarr"
    options = Exporting(segment_frames=15, overlap_frames=0)
    write_dataset(alone, gather([one.folder], Making(model="denoiser")), options)
    with open_dataset(Path(end.facts["dataset"])) as made, open_dataset(alone) as expected:
        assert made.header.subjects == expected.header.subjects == ("anna", "bert", "carl")
        assert made.header.labels == expected.header.labels
        for column in COLUMNS:
            found, known = made[column][:], expected[column][:]
            np.testing.assert_allclose(found, known, rtol=1e-5, atol=1e-7, err_msg=column)
        told = [source["provenance"] for source in made.sources()]
        for mine, theirs in zip(told, expected.sources(), strict=True):
            names = ("scene", "person", "everybody")
            assert [mine.get(name) for name in names] == [
                theirs["provenance"].get(name) for name in names
            ]
        assert describe_dataset(made)["recordings"] == 1
    run(tmp_path, PLAN + EXPORT)
    assert not run(tmp_path, PLAN + EXPORT)[1].submitted


def test_without_a_data_set_maps_are_of_everybody(tmp_path: Path, scenes: Path) -> None:
    one = scene(scenes / "duo.sd2")
    run(tmp_path, PLAN)
    (row,) = rows_in(tmp_path)
    whole = Synthesizer(one.load_mesh(), PRESETS["paper"]).map(one.sensor)
    made = DopplerMap.load(tmp_path / "made" / str(row["synthetic"]))
    np.testing.assert_array_equal(made.values, whole.values)
    assert "person" not in row


@pytest.mark.slow
def test_whom_else_labels_name_is_denoised_alone(tmp_path: Path, scenes: Path) -> None:
    one = scene(scenes / "duo.sd2", WHO[:1])
    run(tmp_path, PLAN + EXPORT)
    assert [row["person"] for row in rows_in(tmp_path)] == ["anna"]
    before = estimate(plan_from_text(PLAN + EXPORT, tmp_path), 1)
    assert {name: step.to_do for name, step in before.steps.items()} == {
        "inspect": 0, "synthesise": 0, "denoise": 0, "export": 0,
    }  # fmt: skip
    one.labels = scene(tmp_path / "other.sd2").labels
    one.save()
    _, pool = run(tmp_path, PLAN + EXPORT)
    assert pool.submitted == {"inspect": 1, "denoise": 1, "export": 1}
    assert [row["person"] for row in rows_in(tmp_path)] == ["anna", "bert"]


def test_a_suggestion_is_no_label_of_a_data_set(tmp_path: Path, scenes: Path) -> None:
    one = scene(scenes / "duo.sd2")
    assert one.labels is not None
    one.labels = one.labels.with_spans(
        [replace(span, origin="suggestion") for span in one.labels.spans if span.person == "bert"]
    )
    one.save()
    end, _ = run(tmp_path, PLAN + EXPORT)
    with open_dataset(Path(end.facts["dataset"])) as dataset:
        assert dataset.header.subjects == ("anna",)
        assert "wave" not in dataset.header.labels
