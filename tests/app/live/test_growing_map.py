from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sd2app.live.growing_map import GrowingMap
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
    spare=st.integers(1, 5),
)
def test_columns_added_one_by_one_make_the_whole_map(values, there, spare):
    import sd2app.live.growing_map as module

    before, module._SPARE_FRAMES = module._SPARE_FRAMES, spare
    try:
        whole = _map(values)
        growing = GrowingMap(whole.between(0, there))
        for frame in range(there, 24):
            assert growing.add(float(whole.times_s[frame]), values[:, frame])
            earlier = growing.whole()
            assert len(earlier.timebase) == frame + 1
        found = growing.whole()
        np.testing.assert_array_equal(found.values, values)
        np.testing.assert_array_equal(found.times_s, whole.times_s)
        assert (found.unseen_bins, found.meta, found.kind) == ((0,), {"a": 1}, "real")
    finally:
        module._SPARE_FRAMES = before


def test_a_column_that_is_there_is_not_added_again():
    growing = GrowingMap(_map(np.ones((4, 3), np.float32)))
    assert not growing.add(2 / 30, np.zeros(4, np.float32))
    assert len(growing.whole().timebase) == 3
    shown = growing.whole()
    assert growing.add(0.5, np.full(4, 7, np.float32))
    assert shown.values.max() == 1  # what is on screen does not change
