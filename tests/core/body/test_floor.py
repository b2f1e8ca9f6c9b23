"""Who stands on the floor of the others is as tall as their feet say."""

from __future__ import annotations

import numpy as np
import pytest

from sd2core.body.floor import StandingFeet, statures_on_one_floor
from sd2core.body.shape import DEFAULT_STATURE_M

CAMERA_M = 1.2


def feet(stature_m: float, depths_m: tuple[float, float], tilt_deg: float = 0.0) -> StandingFeet:
    """Feet of somebody on a floor 1.2 m below the camera, which looks down by some degrees."""
    rng = np.random.default_rng(7)
    z = rng.uniform(*depths_m, 40)
    places = np.stack([rng.uniform(-1.0, 1.0, 40), np.full(40, CAMERA_M), z], axis=1)
    turn = np.radians(tilt_deg)
    c, s = np.cos(turn), np.sin(turn)
    seen = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    return StandingFeet(places @ seen.T / stature_m, seen @ np.array([0.0, 1.0, 0.0]))


@pytest.mark.parametrize("tilt_deg", [0.0, 20.0])
@pytest.mark.parametrize("child_m", [(2.0, 3.0), (3.5, 4.5)])
def test_a_child_is_no_adult_farther_away(child_m: tuple[float, float], tilt_deg: float) -> None:
    adult, child = feet(1.75, (2.5, 4.0), tilt_deg), feet(1.15, child_m, tilt_deg)
    told = statures_on_one_floor([adult, child])
    assert told[0] == pytest.approx(DEFAULT_STATURE_M, abs=0.08)
    assert told[1] == pytest.approx(1.15 * DEFAULT_STATURE_M / 1.75, abs=0.08)


def test_a_known_stature_fixes_the_scale() -> None:
    told = statures_on_one_floor([feet(1.60, (2.5, 4.0)), feet(1.10, (2.0, 4.0))], 1.60)
    assert told == pytest.approx([1.60, 1.10], abs=0.04)


def test_adults_stay_adults() -> None:
    told = statures_on_one_floor([feet(1.62, (2.5, 4.0)), feet(1.85, (2.0, 4.0))])
    assert told[0] < told[1]
    assert all(1.55 < each < 1.95 for each in told)


def test_feet_that_are_not_seen_say_nothing() -> None:
    assert statures_on_one_floor([feet(1.7, (2.0, 3.0)), None]) == [None, None]
    told = statures_on_one_floor([None, feet(1.7, (2.0, 3.0)), feet(1.1, (2.0, 3.0))])
    assert told[0] is None
    assert told[2] < 1.25
