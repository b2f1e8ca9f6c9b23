"""Differences between maps, against values worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sd2core.accuracy.results import Spread, compute_errors
from sd2core.numerics.map_accuracy import relative_l1
from sd2core.sensor import VelocityAxis

AXIS = VelocityAxis(4, 2.0)  # bins of 1 m/s, centres -1.5, -0.5, 0.5, 1.5
MAPS = arrays(np.float64, (4, 5), elements=st.integers(0, 1000).map(float))


@given(MAPS)
def test_a_map_has_no_error_against_itself(values: np.ndarray) -> None:
    found = compute_errors(values, values, values, values, AXIS)
    assert found.l1 == found.l1_raw == 0
    for figure in (found.l1_frames, found.peak_mps, found.mean_mps, found.wrong_bins):
        assert figure == Spread(0, 0)


@given(MAPS, st.floats(0.1, 10))
def test_relative_l1_does_not_depend_on_the_unit(values: np.ndarray, unit: float) -> None:
    other = np.roll(values, 1, axis=0)
    assert relative_l1(unit * other, unit * values) == pytest.approx(relative_l1(other, values))


def test_known_differences() -> None:
    reference = np.array([[0, 0, 0, 4.0], [0, 2, 2, 0]]).T
    values = np.array([[0, 0, 4.0, 0], [0, 2, 1, 0]]).T
    found = compute_errors(values, reference, values, reference, AXIS)
    assert found.l1 == pytest.approx((8 + 1) / 8)
    # Frame 0: 4 moved one bin; frame 1: half of one bin is missing.
    assert found.l1_frames.median == pytest.approx((8 / 4 + 1 / 4) / 2)
    assert found.peak_mps.median == pytest.approx((1 + 0) / 2)
    mean_1 = (2 * -0.5 + 1 * 0.5) / 3
    assert found.mean_mps.median == pytest.approx((1 + abs(mean_1)) / 2)
    assert found.wrong_bins.median == pytest.approx((1 + (2 / 3 - 1 / 2)) / 2)
    assert found.frames == 2


def test_frames_at_rest_have_no_figures_of_their_own() -> None:
    reference = np.array([[0, 0, 0, 100.0], [0, 0, 0, 1.0]]).T
    values = np.array([[0, 0, 0, 100.0], [1.0, 0, 0, 0]]).T
    found = compute_errors(values, reference, values, reference, AXIS)
    assert found.l1 == pytest.approx(2 / 101)
    assert found.peak_mps.p95 == 0


def test_an_empty_map_is_wrong_altogether() -> None:
    reference = np.array([[0, 0, 0, 2.0]]).T
    found = compute_errors(0 * reference, reference, 0 * reference, reference, AXIS)
    assert found.l1 == 1
    assert found.wrong_bins.median == 1
    assert found.peak_mps.median == 1.5
    assert relative_l1(reference, 0 * reference) == float("inf")
    assert relative_l1(0 * reference, 0 * reference) == 0


def test_spread_of_nothing() -> None:
    assert Spread.of(np.zeros(0)) == Spread(0, 0)
    assert Spread.of(np.arange(101.0)) == Spread(50, 95)
