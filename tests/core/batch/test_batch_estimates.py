"""What a dry run says is measured here, or said to be of another machine."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from moving_spheres import save_spheres
from numbered_videos import write_video

from sd2core.batch import estimate as module
from sd2core.batch.estimate import (
    BatchEstimate,
    TaskRate,
    estimate,
    export_s,
    known_fit_rate,
    remember_fit_rate,
)
from sd2core.batch.plan import BatchPlan
from sd2core.batch.plan_file import plan_from_text
from sd2core.cli.batch import print_estimate

PLAN = """
out = "made"
[recordings]
files = ["inputs/*"]
[fit]
[synthesise]
[export]
segment_frames = 20
overlap_frames = 0
"""


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda *_, **__: str(folder))
    return folder


def plan_in(folder: Path) -> BatchPlan:
    return plan_from_text(PLAN, folder)


def test_what_nothing_was_measured_for_is_called_assumed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save_spheres(tmp_path / "inputs", 2)
    write_video(tmp_path / "inputs" / "walk.mp4", frames=120)
    plan = plan_in(tmp_path)
    made = estimate(plan, 1)
    fit = made.steps["fit"]
    assert (fit.to_do, fit.frames, fit.assumed) == (1, 120, True)
    assert made.assumed_share == pytest.approx(fit.seconds / (made.hours * 3600))
    print_estimate(made, plan)
    said = capsys.readouterr().out
    assert "assumed: nothing was fitted here yet" in said
    assert f"{made.assumed_share:.0%} of that rests on another machine's figures" in said
    remember_fit_rate("medium", 50.0, 100)
    again = estimate(plan, 1)
    assert again.steps["fit"].seconds == pytest.approx(0.5 * 120, abs=2.0)
    assert again.assumed_share == 0.0
    assert again.to_json()["assumed_share"] == 0.0
    print_estimate(again, plan)
    said = capsys.readouterr().out
    assert "as fitted here" in said
    assert "another machine" not in said


def test_writing_the_data_set_is_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save_spheres(tmp_path / "inputs", 2, frames=40)
    asked: list[tuple[int, tuple[str, ...]]] = []

    def measured(plan: BatchPlan, frames: int, kinds: tuple[str, ...]) -> float:
        asked.append((frames, kinds))
        return 3.0

    monkeypatch.setattr(module, "export_s", measured)
    made = estimate(plan_in(tmp_path), 1)
    assert asked == [(40, ("synthetic",))]
    assert made.steps["export"].seconds == 3.0 * 2
    assert made.steps["export"].basis == "measured on maps of 40 frames"
    assert not made.steps["export"].assumed
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize("form", ["zarr", "h5", "npz"])
def test_a_source_takes_some_time_to_write(tmp_path: Path, form: str) -> None:
    plan = plan_in(tmp_path)
    assert plan.export is not None
    plan = plan.model_copy(update={"export": plan.export.model_copy(update={"format": form})})
    assert 0 <= export_s(plan, 50, ("synthetic", "denoised")) < 10
    assert list(tmp_path.iterdir()) == []


def test_rates_are_kept_by_resolution(cache: Path) -> None:
    assert known_fit_rate("medium") is None
    remember_fit_rate("medium", 1.0, 99)  # too few frames
    assert known_fit_rate("medium") is None
    remember_fit_rate("medium", 20.0, 200)
    remember_fit_rate("high", 50.0, 100)
    assert (known_fit_rate("medium"), known_fit_rate("high")) == (0.1, 0.5)
    for damaged in ("", "[1]", '{"medium": "fast"}'):
        (cache / "fit-rates.json").write_text(damaged)
        assert known_fit_rate("medium") is None
    (cache / "fit-rates.json").unlink()
    cache.rmdir()
    cache.write_text("a file in the way")
    remember_fit_rate("medium", 20.0, 200)
    assert known_fit_rate("medium") is None


def test_steps_add_up_and_are_shared_by_processes() -> None:
    one = module.StepEstimate()
    one.add(TaskRate(1.0, 0.1, 10.0, 2.0), frames=100, tasks=5)
    assert one.seconds == pytest.approx(15.0, abs=0.1)
    assert one.bytes == 250
    made = BatchEstimate(1, 1, 2, {"fit": replace(one, assumed=True), "synthesise": one})
    assert made.hours == pytest.approx(one.seconds / 3600)
    assert made.assumed_share == pytest.approx(0.5)
