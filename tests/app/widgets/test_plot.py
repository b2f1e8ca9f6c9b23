from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2app.widgets.canvas import tick_text
from sd2app.widgets.chart import Scale

positive = st.floats(1e-6, 1e6)


def axis_around(values, floor=0.0):
    return Scale.around(values, 1.5, 10.0, tick_text, floor)


def test_decades_are_equally_far_from_each_other():
    axis = Scale(0.01, 100.0, log=True)
    assert [axis.share(value) for value in (0.01, 0.1, 1.0, 10.0, 100.0)] == pytest.approx(
        [0.0, 0.25, 0.5, 0.75, 1.0]
    )


def test_nought_stands_on_the_edge():
    axis = axis_around([0.0, 0.5, 20.0], floor=0.01)
    assert axis.share(0.0) == 0.0
    assert axis.low > 0.0
    assert axis.low <= 0.5
    assert axis.low == 0.01


@given(st.lists(positive, min_size=1, max_size=20))
def test_every_value_has_a_place_inside_in_its_order(values):
    axis = axis_around(values)
    places = [axis.share(value) for value in sorted(values)]
    assert places == sorted(places)
    assert places[0] >= 0.0
    assert places[-1] <= 1.0


@given(positive, st.floats(1.0, 1e6), st.integers(2, 12))
def test_no_more_ticks_than_there_is_room_for_and_all_on_the_axis(low, factor, most):
    axis = Scale(low, low * factor * 10, log=True)
    ticks = axis.ticks(most)
    assert 1 <= len(ticks) <= most
    assert all(0.998 * axis.low <= tick <= 1.002 * axis.high for tick in ticks)


def test_no_values_give_an_axis_all_the_same():
    assert axis_around([]).ticks(5)


@pytest.mark.parametrize(("value", "text"), [(0.01, "0.01"), (1.0, "1"), (500.0, "500")])
def test_ticks_are_written_without_exponents(value, text):
    assert tick_text(value) == text


def test_below_zero_there_is_a_minus_and_no_hyphen():
    assert [Scale(-4.0, 4.0).text(value) for value in (-2.0, 0.0, 2.0)] == ["−2", "0", "2"]
