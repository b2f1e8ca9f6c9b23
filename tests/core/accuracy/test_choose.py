"""Choosing: what holds, what is refused, and what is asked wrongly."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import trimesh
from accuracy_scenes import FPS, ball, moving, plate, steady, swinging, together, waving

from sd2core.accuracy.choosing import choose
from sd2core.accuracy.plans import FRAME_RATE_FACTORS, AccuracyPlan, reference_plan
from sd2core.accuracy.sample import Run, Sample, take_sample
from sd2core.accuracy.survey import Survey, survey_scene
from sd2core.accuracy.trial import Columns, Trial, synthesizer_for
from sd2core.doppler import PRESETS, Synthesizer
from sd2core.doppler.synthesizer import MapFrames
from sd2core.errors import Sd2Error
from sd2core.files.resources import resource_path
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.map_accuracy import relative_l1
from sd2core.progress import Cancelled
from sd2core.recording.recording import open_recording
from sd2core.sensor import Beam, VirtualSensor
from sd2core.timebase import Timebase

CAMERA = VirtualSensor()
PAPER = PRESETS["paper"]


@pytest.fixture(scope="module")
def scene() -> MeshSequence:
    return together(ball(swinging((0, 0, 3), 1.5, 0.8)), plate((0.25, 0, 1), 0.5, 0.5))


@pytest.fixture(scope="module")
def survey(scene: MeshSequence) -> Survey:
    return survey_scene(scene, CAMERA, PAPER)


@pytest.mark.parametrize("tolerance", [0.3, 0.05, 0.01])
def test_the_plan_holds_its_tolerance_on_the_whole_clip(
    scene: MeshSequence, survey: Survey, tolerance: float
) -> None:
    """Not only on the frames that were looked at: those stand for the others."""
    choice = choose(scene, CAMERA, tolerance=tolerance, survey=survey)
    assert choice.holds
    found = synthesizer_for(choice.plan, scene, PAPER).map(CAMERA).values
    best = replace(PAPER, oversampling=8, beyond="wrap")
    truth = Synthesizer(scene, best).map(CAMERA).values
    assert relative_l1(found.astype(float), truth.astype(float)) <= 1.25 * tolerance


def test_less_accuracy_never_costs_more(scene: MeshSequence, survey: Survey) -> None:
    costs = [
        choose(scene, CAMERA, tolerance=tolerance, survey=survey).cost_ms
        for tolerance in (0.5, 0.1, 0.02)
    ]
    assert costs == sorted(costs)


def test_a_larger_budget_never_costs_accuracy(scene: MeshSequence, survey: Survey) -> None:
    changes = [
        survey.forecast_error(choose(scene, CAMERA, budget_ms=budget, survey=survey).plan)
        for budget in (0.01, 0.1, 1.0, 100.0)
    ]
    assert changes == sorted(changes, reverse=True)


def test_what_cannot_be_had_is_refused_with_the_best_there_is(
    scene: MeshSequence, survey: Survey
) -> None:
    choice = choose(scene, CAMERA, tolerance=1e-9, survey=survey)
    assert not choice.holds
    assert choice.plan.visibility == "exact"
    assert choice.plan.vertices_kept == 1
    assert choice.summary.startswith("No plan holds 1e-07 %; the best is counted")
    soon = choose(scene, CAMERA, budget_ms=1e-9, survey=survey)
    assert not soon.holds
    assert "No plan keeps within 1e-09 ms" in soon.summary


def test_a_point_cloud_has_a_plan() -> None:
    full = ball(swinging((0, 0, 3), 1.5, 0.8))
    cloud = MeshSequence(full.vertices, None, full.timebase, "cloud")
    choice = choose(cloud, CAMERA, tolerance=0.05)
    assert choice.holds
    assert choice.plan.visibility == "none"
    assert {reason.setting for reason in choice.reasons}.isdisjoint({"occlusion", "geometry"})


def test_a_body_at_rest_needs_nothing() -> None:
    choice = choose(ball(steady((0, 0, 3), (0, 0, 0))), CAMERA, tolerance=0.01)
    assert choice.holds
    assert choice.errors.l1 == 0
    (still,) = (reason for reason in choice.reasons if reason.setting == "static")
    assert still.value == 1


def test_what_moves_only_between_the_frames_that_are_tried_is_counted_as_well_as_can_be() -> None:
    """It was counted with a tenth of the vertices, hidden ones too, and called 0 % off."""
    still = ball(steady((0, 0, 3), (0, 0, 0)), fineness=2, frames=3000)
    seen = set(take_sample(still, CAMERA, PAPER).frames.tolist())
    unseen = next(first for first in range(3000) if seen.isdisjoint(range(first, first + 5)))
    mesh = ball(waving(np.array([unseen / FPS]), 4 / FPS), fineness=2, frames=3000)
    assert seen == set(take_sample(mesh, CAMERA, PAPER).frames.tolist())
    survey = survey_scene(mesh, CAMERA, PAPER)
    choice = choose(mesh, CAMERA, tolerance=0.1, survey=survey)
    assert choice.plan == reference_plan("histogram")
    assert choice.holds
    assert any("frames that were not tried" in reason.text for reason in choice.reasons)
    dragging = choose(mesh, CAMERA, budget_ms=1e3, survey=survey)
    assert dragging.plan.visibility == "exact"
    assert dragging.plan.vertices_kept == 1


@pytest.fixture(scope="module")
def faster_later() -> Survey:
    """Survey of a ball that passes the axis only in the frames to check on."""
    slow, fast = (ball(swinging((0, 0, 3), speed, 0.8), fineness=2) for speed in (1.5, 2.8))
    vertices = np.concatenate([slow.read(0, 60), fast.read(0, 60)])
    mesh = replace(slow, vertices=vertices, timebase=Timebase.regular(120, FPS))
    sample = Sample(np.arange(120), (Run(5, 55, 5), Run(65, 115, 65)), (Run(5, 55, 5),))
    return survey_scene(mesh, CAMERA, PAPER, trial=Trial(mesh, CAMERA, PAPER, sample))


def test_where_more_is_beyond_in_the_frames_to_check_on_it_is_wrapped(faster_later: Survey) -> None:
    """No plan was said to hold."""
    choice = choose(faster_later.trial.mesh, CAMERA, tolerance=0.01, survey=faster_later)
    assert choice.holds
    assert choice.plan.beyond == "wrap"


def test_where_no_plan_holds_the_error_is_of_all_runs(faster_later: Survey) -> None:
    trial = faster_later.trial
    choice = choose(trial.mesh, CAMERA, tolerance=1e-9, survey=faster_later)
    assert not choice.holds
    assert choice.errors == trial.errors(choice.plan)


ON_THE_HAND = VirtualSensor((0.0, 0.0, 0.0), -6.9, 7.0, Beam(1, 1))
BESIDE_IT = VirtualSensor((2.04, 0.08, 2.1), -98.9, 7.6, Beam(1, 1))
BEHIND = VirtualSensor((0.04, 0.08, 4.2))


def test_an_error_is_that_of_the_map_of_the_whole_clip() -> None:
    """Tried where vertices are fast and not received, 14 % of a beam's map were called 1.6 %."""
    mesh = open_recording(resource_path("swipes.sd2")).load_mesh().between(0, 200)
    trial = Trial(mesh, CAMERA, PAPER, take_sample(mesh, CAMERA, PAPER))
    for sensor, plan in (
        (ON_THE_HAND, AccuracyPlan(visibility="facing")),
        (BESIDE_IT, AccuracyPlan(mask_stride=5, frame_rate_factor=2)),
        (BEHIND, AccuracyPlan(mask_stride=2)),
    ):
        here = trial.at(sensor)
        claimed = here.errors(plan).l1
        made, truth = (
            synthesizer_for(one, mesh, PAPER).map(sensor).values.astype(np.float64)
            for one in (plan, reference_plan("histogram"))
        )
        assert 0.5 * claimed < relative_l1(made, truth) < 1.2 * claimed


@pytest.mark.one_in(3)
@pytest.mark.parametrize("frames", [1, 2, 7, 39])
def test_short_clips(frames: int) -> None:
    choice = choose(
        ball(swinging((0, 0, 3), 1.5, 0.8), fineness=1, frames=frames), CAMERA, tolerance=0.1
    )
    assert choice.errors.frames >= 1


@pytest.mark.slow
def test_a_choice_can_be_written_down(scene: MeshSequence) -> None:
    choice = choose(scene, CAMERA, tolerance=0.1)
    content = json.loads(json.dumps(choice.to_json()))
    assert content["text"] == str(choice.plan)
    assert content["plan"]["visibility"] == choice.plan.visibility


@pytest.mark.parametrize(
    "wanted",
    [
        {},
        {"tolerance": 0.1, "budget_ms": 1.0},
        {"tolerance": 0.0},
        {"tolerance": -1.0},
        {"tolerance": 1.01},
        {"tolerance": float("nan")},
        {"budget_ms": 0.0},
        {"budget_ms": float("inf")},
    ],
)
def test_one_positive_wish(scene: MeshSequence, wanted: dict[str, float]) -> None:
    with pytest.raises(Sd2Error):
        choose(scene, CAMERA, **wanted)  # type: ignore[arg-type]


def test_the_other_tool_has_no_settings(scene: MeshSequence) -> None:
    with pytest.raises(Sd2Error, match="vid2doppler"):
        choose(scene, CAMERA, tolerance=0.1, options=PRESETS["vid2doppler"])


def test_choosing_can_be_stopped(scene: MeshSequence) -> None:
    def stop(done: int, total: int) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        choose(scene, CAMERA, tolerance=0.1, progress=stop)


def test_a_missing_number_is_named_by_its_frame_in_the_clip() -> None:
    mesh = ball(swinging((0, 0, 3), 1.5, 0.8), frames=400)
    frame = take_sample(mesh, CAMERA, PAPER).runs[0].first + 3
    vertices = mesh.read(0, mesh.frame_count).copy()
    vertices[frame, 7, 1] = np.nan
    broken = replace(mesh, vertices=vertices)
    with pytest.raises(Sd2Error, match=f"scene: vertex 7 of frame {frame} is at"):
        choose(broken, CAMERA, tolerance=0.1)


@pytest.mark.slow
def test_a_survey_that_builds_on_another_finds_the_same(
    scene: MeshSequence, survey: Survey
) -> None:
    aside = VirtualSensor(position_m=(0.4, 0.0, 0.0))
    anew = survey_scene(scene, aside, PAPER)
    built_on = survey_scene(scene, aside, PAPER, trial=survey.trial.at(aside))
    assert built_on.change == anew.change
    assert built_on.facts == anew.facts


def test_an_empty_map_is_called_so() -> None:
    """Nothing is off by infinity without a word on why."""
    hidden = together(ball(swinging((0, 0, 3), 1.5, 0.8), fineness=2), plate((0, 0, 1), 3, 3))
    choice = choose(hidden, CAMERA, tolerance=0.02)
    assert choice.holds
    assert choice.errors.l1 == 0
    assert "empty" in choice.reasons[0].text
    assert not any("inf" in reason.text for reason in choice.reasons)


def test_what_cannot_be_decimated_is_not_planned_so() -> None:
    triangle = moving(
        trimesh.Trimesh([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]], [[0, 1, 2]], process=False),
        swinging((0, 0, 2), 1.0, 0.7),
    )
    survey = survey_scene(triangle, CAMERA, PAPER)
    assert survey.trial.vertices_kept == (1.0,)
    choice = choose(triangle, CAMERA, tolerance=0.5, survey=survey)
    assert choice.plan.vertices_kept == 1
    assert not any(reason.setting == "geometry" for reason in choice.reasons)


def test_inside_a_body_nothing_needs_to_stand_in_between() -> None:
    """There the facing test hides all of it; that is not what occlusion is for."""
    around = ball(swinging((0, 0, 0.02), 0.8, 0.7), radius_m=1.0, fineness=3)
    choice = choose(around, CAMERA, tolerance=0.02)
    found = next(reason for reason in choice.reasons if reason.setting == "occlusion")
    assert choice.plan.visibility == "none"
    assert not found.modelled
    assert found.value < 0.001
    # Nor is anything said of masks where none is used.
    assert not any(reason.setting in ("mask_reuse", "mask_age") for reason in choice.reasons)


def test_what_a_kept_mask_changes_is_that_of_a_mask_made_elsewhere(
    scene: MeshSequence, survey: Survey
) -> None:
    """Those made here for other plans served instead: it changed the map by 0 %."""
    choose(scene, CAMERA, budget_ms=100.0, survey=survey)
    kept = next(plan for plan in survey.change if plan.mask_reuse_m > 0)
    runs = survey.trial.sample
    alone = [
        Trial(scene, CAMERA, PAPER, runs).columns(plan, runs.chosen_on).smooth
        for plan in (kept, survey.base)
    ]
    change = relative_l1(alone[0], np.tile(alone[1], 2))
    assert change > 0
    assert survey.change[kept] == pytest.approx(change)


def test_masks_are_timed_as_they_are_made_however_far_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """An offset that is lost in large coordinates made no other place, and a kept mask no cost."""
    far_m = np.array([4.8e6, 0.0, 5e5])
    near = ball(swinging((0, 0, 3), 1.5, 0.8), fineness=1)
    mesh = replace(near, vertices=near.read(0, 60) + far_m)
    x, y, z = far_m.tolist()
    sensor = VirtualSensor((x, y, z))
    seen, stretch = [], Synthesizer.stretch

    def noted(maker: Synthesizer, place: VirtualSensor, *frames: Any, **options: Any) -> MapFrames:
        seen.append(place.position_m)
        return stretch(maker, place, *frames, **options)

    trial = Trial(mesh, sensor, PAPER, take_sample(mesh, sensor, PAPER))
    monkeypatch.setattr(Synthesizer, "stretch", noted)
    for _ in range(5):
        trial.milliseconds(AccuracyPlan())
    assert len(set(seen)) == 5
    assert sensor.position_m not in seen


@pytest.mark.slow
def test_a_single_map_keeps_no_mask(scene: MeshSequence) -> None:
    """Such a plan is for a sensor that moves: alone it would be worked out whole."""
    survey = survey_scene(scene, CAMERA, PAPER)
    # As if working out any mask were dear, and counting free.
    survey.mask_ms.update(dict.fromkeys(survey.mask_ms, 1e3))
    survey.count_ms.update(dict.fromkeys(survey.count_ms, 1e-3))
    while_moving = choose(scene, CAMERA, budget_ms=1.0, survey=survey)
    assert while_moving.holds
    assert while_moving.plan.mask_reuse_m > 0
    at_rest = choose(scene, CAMERA, budget_ms=1.0, dragging=False, survey=survey)
    assert at_rest.plan.mask_reuse_m == 0
    assert not at_rest.holds


def test_more_moments_never_have_a_lower_forecast(scene: MeshSequence) -> None:
    survey = survey_scene(scene, CAMERA, PAPER)
    costs = [
        survey.forecast_ms(replace(survey.base, frame_rate_factor=factor))
        for factor in FRAME_RATE_FACTORS
    ]
    assert costs == sorted(costs)
    for kept in survey.trial.vertices_kept:
        assert kept <= survey.cost_share[kept] <= 1


def test_what_is_loaded_the_first_time_is_not_forecast(
    scene: MeshSequence, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen, columns = set[AccuracyPlan](), Trial.columns

    def slow_at_first(trial: Trial, plan: AccuracyPlan, *runs: Any, **options: Any) -> Columns:
        made, loading_ms = columns(trial, plan, *runs, **options), 1e4 * (plan not in seen)
        seen.add(plan)
        return replace(made, milliseconds=made.milliseconds + loading_ms)

    monkeypatch.setattr(Trial, "columns", slow_at_first)
    survey = survey_scene(scene, CAMERA, PAPER)
    assert max(survey.mask_ms.values()) < 1e3
    assert all(0 < share <= 1 for share in survey.cost_share.values())
