"""One plan for all places around a mesh: held to everywhere, and chosen only where that pays."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from moving_spheres import swinging_sphere

from sd2core.accuracy import Choice, places
from sd2core.accuracy.places import MAX_PLACES, choose_for_places, spread
from sd2core.accuracy.plans import AccuracyPlan, reference_plan
from sd2core.accuracy.trial import synthesizer_for
from sd2core.doppler import PRESETS
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

PAPER = PRESETS["paper"]
TOP = reference_plan("histogram")
AROUND = [VirtualSensor(place) for place in ((0.0, 0.0, 0.0), (2.0, 0.0, 2.0), (0.0, -1.5, 1.0))]


@given(st.integers(1, 500))
def test_places_to_check_on_are_the_ends_and_the_middle(count: int) -> None:
    sensors = [VirtualSensor((float(number), 0.0, 0.0)) for number in range(count)]
    chosen = [int(one.position_m[0]) for one in spread(sensors)]
    assert chosen == sorted({*chosen})
    assert len(chosen) == min(count, MAX_PLACES)
    assert {chosen[0], chosen[-1]} == {0, count - 1}


def test_a_tolerance_is_a_share() -> None:
    with pytest.raises(
        Sd2Error, match=r"The tolerance is 2\. Expected: a share above 0 and up to 1"
    ):
        choose_for_places(swinging_sphere(5), AROUND, 10**6, 2.0, PAPER)


def test_the_plan_holds_at_every_place() -> None:
    mesh = swinging_sphere(45)
    found = choose_for_places(mesh, AROUND, 10**6, 0.1, PAPER)
    assert found.plan != TOP
    assert 0 < found.error_l1 <= 0.1
    made = found.provenance()
    assert made["plan"]["text"] == str(found.plan)
    assert made["plan_reasons"] == list(found.reasons)
    for sensor in AROUND:
        best = synthesizer_for(TOP, mesh, PAPER).map(sensor).values
        values = synthesizer_for(found.plan, mesh, PAPER).map(sensor).values
        assert np.abs(values - best).sum() <= 0.15 * best.sum()


def test_where_nothing_else_holds_the_most_accurate_is_taken() -> None:
    found = choose_for_places(swinging_sphere(45), AROUND, 10**6, 1e-9, PAPER)
    assert (found.plan, found.error_l1) == (TOP, 0.0)
    assert "known to hold 0.0% from every place" in found.reasons[0]


def test_of_frames_in_which_nothing_moves_no_plan_is_known_to_hold() -> None:
    ball = swinging_sphere(45)
    still = replace(
        ball,
        vertices=np.repeat(ball.read(0, 1), 600, axis=0),
        timebase=Timebase.regular(600, 30.0),
    )
    found = choose_for_places(still, AROUND, 10**6, 0.1, PAPER)
    assert found.plan == TOP
    assert "known to hold" in found.reasons[0]


def test_a_plan_that_fails_elsewhere_is_chosen_anew_there(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[VirtualSensor] = []
    bad, good, really = AccuracyPlan(visibility="none"), AccuracyPlan(mask_stride=5), places.choose

    def chosen(mesh: MeshSequence, place: VirtualSensor, **told: Any) -> Choice:
        asked.append(place)
        return replace(really(mesh, place, **told), plan=bad if len(asked) == 1 else good)

    monkeypatch.setattr(places, "choose", chosen)
    found = choose_for_places(swinging_sphere(45), AROUND, 10**6, 0.3, PAPER)
    assert asked == AROUND[:2]
    assert found.plan == good


def test_few_frames_are_not_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(places, "survey_scene", None)
    found = choose_for_places(swinging_sphere(30), AROUND, 3999, 0.02, PAPER)
    assert (found.plan, found.error_l1) == (TOP, 0.0)
    assert found.reasons == (
        "3,999 frames of maps are too few to choose a plan for: the most accurate one is taken",
    )
    with pytest.raises(TypeError):  # the survey is called
        choose_for_places(swinging_sphere(30), AROUND, 4000, 0.02, PAPER)


@pytest.mark.slow
def test_the_choice_is_the_same_each_time() -> None:
    first, again = (choose_for_places(swinging_sphere(45), AROUND, 10**6, 0.1, PAPER) for _ in "ab")
    assert first == again
