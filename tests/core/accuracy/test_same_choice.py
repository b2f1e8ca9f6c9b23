"""The same recording gives the same plan, however long things take, and no sentence against it."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from accuracy_scenes import ball, plate, swinging, together
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sd2core.accuracy.choosing import choose
from sd2core.accuracy.cost_model import modelled_ns
from sd2core.accuracy.plans import FRAME_RATE_FACTORS, AccuracyPlan, counting_plans
from sd2core.accuracy.survey import Survey, survey_scene
from sd2core.accuracy.trial import Trial
from sd2core.doppler import PRESETS
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import VirtualSensor

CAMERA, PAPER = VirtualSensor(), PRESETS["paper"]
ELSEWHERE = VirtualSensor(position_m=(0.4, 0.1, 0.0))
SINCE = (
    "since less would be over the tolerance",
    "since less would save nothing",
    "since no plan holds",
    "since of the plans with less none that was tried holds",
)
SETTINGS = {"occlusion", "mask_age", "geometry", "range_law", "motion"}


@pytest.fixture(scope="module")
def scene() -> MeshSequence:
    return together(ball(swinging((0, 0, 3), 1.5, 0.8), fineness=3), plate((0.25, 0, 1), 0.5, 0.5))


@pytest.fixture(scope="module")
def survey(scene: MeshSequence) -> Survey:
    return survey_scene(scene, CAMERA, PAPER)


@pytest.mark.parametrize("tolerance", [0.1, pytest.param(0.02, marks=pytest.mark.slow)])
def test_opened_several_times_on_a_machine_of_any_speed(
    scene: MeshSequence, monkeypatch: pytest.MonkeyPatch, tolerance: float
) -> None:
    columns, milliseconds = Trial.columns, Trial.milliseconds
    found = []
    for seed in range(3):
        random = np.random.default_rng(seed)

        def slow(self, *options, random=random, **named):
            told = columns(self, *options, **named)
            return replace(told, milliseconds=told.milliseconds * random.lognormal(0, 2))

        def slow_ms(self, *options, random=random, **named):
            return milliseconds(self, *options, **named) * random.lognormal(0, 2)

        monkeypatch.setattr(Trial, "columns", slow)
        monkeypatch.setattr(Trial, "milliseconds", slow_ms)
        choice = choose(scene, CAMERA, tolerance=tolerance)
        found.append((choice.plan, choice.errors.l1, [one.text for one in choice.reasons]))
    assert found[0] == found[1] == found[2]


@pytest.mark.slow
def test_a_survey_from_elsewhere_before_changes_nothing(
    scene: MeshSequence, survey: Survey
) -> None:
    there = survey_scene(scene, ELSEWHERE, PAPER, trial=survey.trial.at(ELSEWHERE))
    back = survey_scene(scene, CAMERA, PAPER, trial=there.trial.at(CAMERA))
    for plan, change in survey.change.items():
        assert back.change[plan] == pytest.approx(change, rel=1e-9, abs=1e-12)


# Each example tries plans; the scene is small.
@pytest.mark.slow
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.floats(-3, -0.3).map(lambda power: 10**power))
def test_no_sentence_is_against_the_tolerance(
    scene: MeshSequence, survey: Survey, tolerance: float
) -> None:
    choice = choose(scene, CAMERA, tolerance=tolerance, survey=survey)
    assert choice.holds == (choice.errors.l1 <= tolerance)
    for reason in choice.reasons:
        if reason.setting not in SETTINGS:
            continue
        told = any(since in reason.text for since in SINCE)
        # What alone is within the tolerance and modelled all the same is explained, nothing else.
        assert told == (reason.modelled and reason.value <= tolerance), reason.text
        saved = "but with the rest of the plan" in reason.text
        assert saved == (not reason.modelled and reason.value > tolerance), reason.text
        if "over the tolerance" in reason.text:
            held, error = map(float, re.findall(r"([\d.e+-]+) %", reason.text)[-2:])
            assert held <= error
        if "aliasing matters" in reason.text:
            assert reason.value > tolerance


@given(
    st.sampled_from(list(counting_plans())),
    st.integers(10, 100_000),
    st.floats(0, 1),
)
def test_less_never_costs_more(plan: AccuracyPlan, vertices: int, moving: float) -> None:
    cost_ns = modelled_ns(plan, vertices, moving)
    assert cost_ns > 0
    for lower in (
        replace(plan, vertices_kept=0.5 * plan.vertices_kept),
        replace(plan, range_law="frame"),
        replace(plan, frame_rate_factor=FRAME_RATE_FACTORS[0]),
        replace(plan, visibility="none", mask_stride=1),
    ):
        assert modelled_ns(lower, vertices, moving) <= cost_ns
    if plan.visibility in ("depth", "exact"):
        assert modelled_ns(replace(plan, mask_stride=10), vertices, moving) <= cost_ns
    if plan.visibility == "depth":
        assert modelled_ns(replace(plan, depth_resolution=128), vertices, moving) <= cost_ns
