"""Errors by single precision."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sd2core.numerics.precision import (
    SHARE_OF_A_BIN,
    single_is_enough,
    stored_velocity_error_mps,
    velocity_error_mps,
)

COORDINATES_M = st.floats(-1.0, 1.0)


@given(st.lists(COORDINATES_M, min_size=2, max_size=2), st.floats(1e-3, 1e6), st.floats(1e-4, 10.0))
def test_storing_coordinates_changes_a_velocity_by_no_more_than_is_said(
    shares: list[float], reach_m: float, duration_s: float
) -> None:
    exact_m = reach_m * np.array(shares)
    stored_m = exact_m.astype(np.float32).astype(np.float64)
    error_mps = abs(np.diff(stored_m - exact_m)[0]) / duration_s
    limit_mps = stored_velocity_error_mps(reach_m, duration_s)
    assert error_mps <= limit_mps * (1 + 1e-6)
    assert limit_mps < 1e-6 * reach_m / duration_s  # single precision has more than six digits


@given(st.floats(1e-2, 1e6), st.floats(1e-4, 10.0), st.floats(1e-3, 1.0))
def test_single_precision_is_enough_while_it_moves_a_point_by_a_hundredth_of_a_bin(
    extent_m: float, duration_s: float, bin_width_mps: float
) -> None:
    bins = velocity_error_mps(extent_m, duration_s) / bin_width_mps
    enough = single_is_enough(extent_m, 0.0, duration_s, bin_width_mps, 0.0, 1.0)
    if abs(bins / SHARE_OF_A_BIN - 1.0) > 1e-9:
        assert enough == (bins < SHARE_OF_A_BIN)
