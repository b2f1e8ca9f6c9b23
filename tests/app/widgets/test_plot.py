from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2app.widgets.plot import LogAxis, tick_text

positive = st.floats(1e-6, 1e6)


def test_decades_are_equally_far_from_each_other():
    axis = LogAxis(0.01, 100.0, 300.0, 0.0)
    assert [axis.px(value) for value in (0.01, 0.1, 1.0, 10.0, 100.0)] == pytest.approx(
        [300.0, 225.0, 150.0, 75.0, 0.0]
    )


def test_nought_stands_on_the_edge():
    axis = LogAxis.around([0.0, 0.5, 20.0], 0.0, 100.0, floor=0.01)
    assert axis.px(0.0) == 0.0
    assert axis.is_below(0.0)
    assert not axis.is_below(0.5)
    assert axis.low == 0.01


@given(st.lists(positive, min_size=1, max_size=20))
def test_every_value_has_a_place_inside_in_its_order(values):
    axis = LogAxis.around(values, 10.0, 200.0)
    places = [axis.px(value) for value in sorted(values)]
    assert places == sorted(places)
    assert places[0] >= 10.0
    assert places[-1] <= 200.0


@given(positive, st.floats(1.0, 1e6), st.integers(2, 12))
def test_no_more_ticks_than_there_is_room_for_and_all_on_the_axis(low, factor, most):
    axis = LogAxis(low, low * factor * 10, 0.0, 100.0)
    ticks = axis.ticks(most)
    assert 1 <= len(ticks) <= most
    assert all(0.998 * axis.low <= tick <= 1.002 * axis.high for tick in ticks)


def test_no_values_give_an_axis_all_the_same():
    assert LogAxis.around([], 0.0, 1.0).ticks(5)


@pytest.mark.parametrize(("value", "text"), [(0.01, "0.01"), (1.0, "1"), (500.0, "500")])
def test_ticks_are_written_without_exponents(value, text):
    assert tick_text(value) == text
