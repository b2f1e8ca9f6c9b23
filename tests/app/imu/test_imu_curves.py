"""Samples as lines: nothing lost, nothing invented, marks at round numbers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2app.imu.feature import curve_lines, extent, scale_marks
from sd2core.imu.signals import InertialSignals


def made(count: int, seed: int, unknown: float = 0.0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(count, 3))
    values[rng.random(count) < unknown] = np.nan
    return values


@given(st.integers(1, 3000), st.integers(0, 9), st.sampled_from([0.0, 0.1, 1.0]))
def test_no_peak_is_lost_and_nothing_is_drawn_where_nothing_is_known(
    count: int, seed: int, unknown: float
) -> None:
    times_s, values = np.arange(count) / 100.0, made(count, seed, unknown)
    curves = curve_lines(times_s, values, times_s[0], times_s[-1] + 0.01, 200.0)
    assert len(curves) == 3
    for axis, lines in zip(values.T, curves, strict=True):
        drawn = np.concatenate([heights for _, heights in lines] or [np.zeros(0)])
        known = axis[np.isfinite(axis)]
        assert np.isfinite(drawn).all()
        assert {*drawn.tolist()} <= {*known.tolist()}
        if known.size:
            assert (drawn.min(), drawn.max()) == (known.min(), known.max())


def test_few_samples_are_drawn_as_they_are_and_broken_at_gaps() -> None:
    times_s = np.arange(10) / 10.0
    values = np.tile(np.arange(10.0)[:, None], (1, 3))
    values[4] = np.nan
    (lines, *_) = curve_lines(times_s, values, 0.0, 1.0, 100.0)
    assert [x.tolist() for x, _ in lines] == [
        pytest.approx([0, 10, 20, 30]),
        pytest.approx([50, 60, 70, 80, 90]),
    ]
    assert [heights.tolist() for _, heights in lines] == [[0, 1, 2, 3], [5, 6, 7, 8, 9]]


def test_lines_go_on_to_the_edges_of_the_window() -> None:
    times_s = np.arange(100) / 100.0
    (((x, _),), *_) = curve_lines(times_s, made(100, 1), 0.253, 0.507, 254.0)
    assert x[0] <= 0.0
    assert x[-1] >= 254.0
    assert len(x) == 27  # 0.25 to 0.51 s, and no more


def test_many_samples_are_as_many_points_as_the_window_is_wide() -> None:
    times_s = np.arange(540_000) / 100.0
    for lines in curve_lines(times_s, made(540_000, 1), 0.0, 5_400.0, 700.0):
        assert sum(len(x) for x, _ in lines) == 1400


@given(st.floats(-500, 0), st.floats(0, 500))
def test_marks_are_round_near_the_limits_and_within(low: float, high: float) -> None:
    if high - low < 1e-3:
        return
    marks = scale_marks(low, high)
    assert 1 <= len(marks) <= 2
    for mark, limit in zip(marks, (high, low), strict=False):
        if mark:
            assert 1 / 1.51 < mark / limit < 1.0 + 1e-8
        else:
            assert abs(limit) <= 0.15 * (high - low)
        assert float(f"{mark:.1e}") == pytest.approx(mark)


def test_a_lane_holds_all_values_and_zero() -> None:
    one = InertialSignals(np.arange(2.0), np.full((2, 3), 9.0), np.full((2, 3), -4.0))
    other = InertialSignals(np.arange(2.0), np.full((2, 3), 12.0), np.full((2, 3), np.nan))
    low, high = extent([one, other], "acceleration_mps2")
    assert low < 0.0 < 12.0 < high < 13.0
    low, high = extent([one, other], "turn_rate_radps")
    assert -5.0 < low < -4.0 < 0.0 < high < 1.0
    low, high = extent([], "turn_rate_radps")
    assert low < 0.0 < high
