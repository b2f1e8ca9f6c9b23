from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.scattering.velocity import moments, radial_velocity


def test_formula_is_the_exact_change_of_range() -> None:
    random = np.random.default_rng(1)
    before = random.normal(loc=[[0], [0], [3]], size=(3, 500))
    after = before + random.normal(scale=0.05, size=before.shape)
    sensor = np.array([0.3, -0.2, 0.1])
    ranges = [np.linalg.norm(p - sensor[:, None], axis=0) for p in (before, after)]
    truth = -(ranges[1] - ranges[0]) / 0.0667
    np.testing.assert_allclose(
        radial_velocity(before, after, sensor, 0.0667), truth, rtol=0, atol=1e-12
    )


@pytest.mark.parametrize("distance_m", [0.3, 2.2, 300.0, 1e6])
def test_single_precision_does_not_cancel(distance_m: float) -> None:
    random = np.random.default_rng(2)
    before = random.uniform(-1, 1, (3, 2000)).astype(np.float32)
    after = (before + random.normal(scale=0.03, size=before.shape)).astype(np.float32)
    sensor = np.float32(distance_m) * np.array([0.48, 0.6, -0.64], np.float32)
    exact = radial_velocity(
        before.astype(np.float64), after.astype(np.float64), sensor.astype(np.float64), 1 / 15
    )
    single = radial_velocity(before, after, sensor, 1 / 15)
    assert single.dtype == np.float32
    assert np.abs(single - exact).max() <= 1e-5


def test_approaching_is_positive_and_crossing_is_zero() -> None:
    before = np.array([[0.0, -0.5], [0.0, 0.0], [2.0, 2.0]])
    after = np.array([[0.0, 0.5], [0.0, 0.0], [1.9, 2.0]])
    velocity = radial_velocity(before, after, (0, 0, 0), 0.1)
    np.testing.assert_allclose(velocity, [1.0, 0.0], atol=1e-12)


def test_no_time_and_no_distance_give_zero() -> None:
    point = np.array([[0.0], [0.0], [1.0]])
    assert radial_velocity(point, point + 1, (0, 0, 0), 0.0) == 0.0
    assert radial_velocity(point, point, (0, 0, 1), 0.1) == 0.0


@given(st.lists(st.floats(0.001, 10.0), min_size=1, max_size=8))
def test_central_difference_is_right_on_any_clock(gaps: list[float]) -> None:
    times = np.cumsum([0.0, *gaps])
    stencil = moments(times, np.arange(len(times)), 1)
    position = 3.0 * times + 1.0
    slope = (position[stencil.after] - position[stencil.before]) / stencil.duration_s
    np.testing.assert_allclose(slope, 3.0, rtol=1e-9)
    steps = (stencil.after - stencil.before)[:, 0]
    assert steps.tolist() == [1, *[2] * (len(times) - 2), 1]


@pytest.mark.parametrize("every", [1, 2, 3, 4, 5, 8])
def test_moments_lie_evenly_and_symmetrically_around_their_frame(every: int) -> None:
    knots = np.arange(6 * every + 1, dtype=float)
    frames = np.arange(7) * every
    stencil = moments(knots, frames, every)
    middle = 0.5 * (stencil.before + stencil.after)[1:-1] - frames[1:-1, None]
    offsets = np.arange(every) - (every - 1) / 2
    np.testing.assert_array_equal(middle, np.tile(offsets, (5, 1)))
    np.testing.assert_array_equal(stencil.duration_s[1:-1], 2.0 if every % 2 else 1.0)
    # At the ends half of the moments lie outside; the knot itself, if one, is one-sided.
    inside = stencil.duration_s > 0
    assert inside[0].tolist() == (offsets >= 0).tolist()
    assert inside[-1].tolist() == (offsets <= 0).tolist()
    assert stencil.before.min() == 0
    assert stencil.after.max() == len(knots) - 1
    assert (stencil.before <= stencil.after).all()


def test_one_knot_has_no_duration() -> None:
    for every in (1, 2, 3):
        stencil = moments(np.array([5.0]), np.array([0]), every)
        assert not stencil.duration_s.any()
