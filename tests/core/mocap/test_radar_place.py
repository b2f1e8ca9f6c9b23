"""Where a radar stands follows from what it saw."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sd2core.mocap.radar_place import Seen, estimate_place

RATE_HZ = 10.0


def seen(position_m: tuple[float, float], offset_s: float, noise_mps: float = 0.0) -> Seen:
    """A minute of points that sway, each along its own direction, two metres ahead."""
    rng = np.random.default_rng(3)
    middle = rng.uniform([-0.4, -0.8, 1.6], [0.4, 0.9, 2.2], (20, 3))
    sway = rng.normal(scale=0.25, size=(20, 3))
    pace = rng.uniform(1.0, 3.0, 20)

    def points_m(times_s: np.ndarray) -> np.ndarray:
        return middle + np.sin(times_s[:, None] * pace)[..., None] * sway

    def range_m(times_s: np.ndarray) -> np.ndarray:
        return np.linalg.norm(points_m(times_s) - [*position_m, 0.0], axis=-1).mean(axis=1)

    times_s = np.arange(600) / RATE_HZ
    moved_s = times_s + offset_s
    step_s = 1.0 / RATE_HZ
    velocity_mps = (range_m(moved_s - step_s) - range_m(moved_s + step_s)) / (2.0 * step_s)
    velocity_mps += noise_mps * rng.normal(size=len(times_s))
    velocity_mps[rng.random(len(times_s)) < 0.05] = np.nan
    return Seen(times_s, points_m(times_s), velocity_mps)


@pytest.mark.slow
@settings(max_examples=8, deadline=None)
@given(x=st.floats(-0.4, 0.4), y=st.floats(-0.5, 1.0), offset_s=st.floats(-0.12, 0.12))
def test_place_and_clock_are_found(x: float, y: float, offset_s: float) -> None:
    found = estimate_place([seen((x, y), offset_s, noise_mps=0.02)])
    np.testing.assert_allclose(found.position_m, [x, y, 0.0], atol=0.05)
    assert found.offset_s == pytest.approx(offset_s, abs=0.01)
    assert found.correlation is not None
    assert found.correlation_before is not None
    assert found.correlation >= found.correlation_before - 1e-4


def test_a_radar_that_saw_something_else_stays_at_the_camera() -> None:
    one = seen((0.3, 0.5), 0.1)
    noise_mps = np.random.default_rng(5).normal(size=len(one.times_s))
    found = estimate_place([Seen(one.times_s, one.points_m, noise_mps)])
    assert (found.position_m, found.offset_s) == ((0.0, 0.0, 0.0), 0.0)


def test_what_was_measured_before_or_after_the_motion_tells_nothing() -> None:
    one = seen((0.2, 0.4), 0.0)
    wild_mps = one.velocity_mps.copy()
    wild_mps[[0, -1]] = -50.0, 50.0  # half of each lies beyond the first or the last frame
    found = estimate_place([Seen(one.times_s, one.points_m, wild_mps)])
    np.testing.assert_allclose(found.position_m, [0.2, 0.4, 0.0], atol=0.05)
    assert found.correlation == pytest.approx(1.0, abs=1e-3)


def test_too_little_to_tell() -> None:
    one = seen((0.3, 0.5), 0.1)
    still = Seen(one.times_s, np.repeat(one.points_m[:1], 600, axis=0), one.velocity_mps)
    short = Seen(one.times_s[:3], one.points_m[:3], one.velocity_mps[:3])
    for nothing in ([still], [short], []):
        assert estimate_place(nothing).position_m == (0.0, 0.0, 0.0)
