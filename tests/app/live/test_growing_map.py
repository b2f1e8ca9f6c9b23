from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sd2app.live.model import extended
from sd2core.maps import DopplerMap
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

AXIS = VelocityAxis(4, 2.0)


def _map(values: np.ndarray) -> DopplerMap:
    times = Timebase.regular(values.shape[1], 30.0)
    return DopplerMap(values, AXIS, times, "real", "power", unseen_bins=(0,), meta={"a": 1})


@given(
    values=arrays(np.float32, (4, 24), elements=st.floats(0, 100, width=32)),
    there=st.integers(1, 24),
    at_once=st.integers(1, 5),
)
def test_columns_added_a_few_at_a_time_make_the_whole_map(values, there, at_once):
    whole = _map(values)
    growing = whole.between(0, there)
    for first in range(there, 24, at_once):
        frames = range(first, min(first + at_once, 24))
        growing = extended(growing, [(float(whole.times_s[k]), values[:, k]) for k in frames])
        assert len(growing.timebase) == frames.stop
    np.testing.assert_array_equal(growing.values, values)
    np.testing.assert_array_equal(growing.times_s, whole.times_s)
    assert (growing.unseen_bins, growing.meta, growing.kind) == ((0,), {"a": 1}, "real")


def test_a_column_that_is_there_is_not_added_again():
    shown = _map(np.ones((4, 3), np.float32))
    assert extended(shown, [(2 / 30, [0.0] * 4)]) is shown
    assert extended(shown, [(0.5, [0.0] * 5)]) is shown
    longer = extended(shown, [(2 / 30, [0.0] * 4), (0.5, [7.0] * 4)])
    assert longer.values[:, 3:].tolist() == [[7.0]] * 4
    assert shown.values.max() == 1  # what is on screen does not change
