"""A dry run counts tasks, and tells times that this machine has measured."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from moving_spheres import save_spheres
from numbered_videos import write_video

from sd2core.batch.estimate import BatchEstimate, StepEstimate, estimate, pace_kind
from sd2core.batch.plan import BatchPlan
from sd2core.batch.plan_file import plan_from_text
from sd2core.batch.tasks import Task
from sd2core.cli.batch import print_estimate
from sd2core.runs.pace import keep_pace

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


def plan_in(folder: Path) -> BatchPlan:
    return plan_from_text(PLAN, folder)


def test_times_are_those_of_such_tasks_here_or_not_known(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save_spheres(tmp_path / "inputs", 2)
    write_video(tmp_path / "inputs" / "walk.mp4", frames=120)
    plan = plan_in(tmp_path)
    made = estimate(plan, 1)
    fit = made.steps["fit"]
    assert (fit.to_do, fit.frames, fit.seconds) == (1, 120, None)
    assert made.seconds is None
    assert made.to_json()["hours"] is None
    print_estimate(made, plan)
    said = capsys.readouterr().out
    assert "not known" in said
    assert "the first tasks tell" in said
    keep_pace(("fit", "medium"), 50.0, 100)
    for step in ("inspect", "synthesise", "export"):
        keep_pace(pace_kind(plan, step), 4.0, 4_000_000)
    again = estimate(plan, 2)
    assert again.steps["fit"].seconds == pytest.approx(0.5 * 120)
    assert again.seconds == pytest.approx(0.5 * 120 / 2, abs=3.0)
    assert again.to_json()["hours"] == pytest.approx(again.seconds / 3600)
    print_estimate(again, plan)
    said = capsys.readouterr().out
    assert "as such tasks took here" in said
    assert "not known" not in said
    assert not (tmp_path / "made").exists()


def test_the_work_of_a_map_grows_with_frames_and_vertices(tmp_path: Path) -> None:
    save_spheres(tmp_path / "inputs", 1, frames=40)
    made = estimate(plan_in(tmp_path), 1)
    one = made.steps["synthesise"]
    assert one.frames == 40
    assert one.work % 40 == 0
    assert one.work > 40
    assert made.steps["export"].work == 1
    assert Task("inspect", "", None, {}).work == 1


def test_limb_maps_take_as_much_as_a_map_for_each_part(tmp_path: Path) -> None:
    save_spheres(tmp_path / "inputs", 1, frames=40)
    whole = estimate(plan_in(tmp_path), 1).steps
    split = PLAN.replace("[synthesise]", "[synthesise]\nlimbs = true")
    for text, exported in ((split, 1), (split + "limbs = true\n", 10)):
        steps = estimate(plan_from_text(text, tmp_path), 1).steps
        assert steps["synthesise"].bytes == 10 * whole["synthesise"].bytes
        assert steps["export"].bytes == exported * whole["export"].bytes


def test_options_are_part_of_the_kind_and_names_are_not(tmp_path: Path) -> None:
    plan = plan_in(tmp_path)
    assert plan.synthesise is not None
    assert plan.export is not None
    titled = plan.model_copy(update={"export": replace(plan.export, title="mine")})
    assert pace_kind(titled, "export") == pace_kind(plan, "export")
    loose = replace(plan.synthesise, tolerance=0.02)
    other = plan.model_copy(update={"synthesise": loose})
    assert pace_kind(other, "synthesise") != pace_kind(plan, "synthesise")


def test_steps_add_up_and_are_shared_by_processes() -> None:
    steps = {"fit": StepEstimate(seconds=15.0, bytes=250), "synthesise": StepEstimate(seconds=5.0)}
    made = BatchEstimate(1, 1, 2, steps)
    assert made.seconds == pytest.approx(10.0)
    assert made.bytes == 250
    steps["synthesise"].seconds = None
    assert made.seconds is None
