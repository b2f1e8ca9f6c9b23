from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2app.widgets.time_axis import TimeScale, clock_text, tick_step, ticks


@given(st.floats(-100, 1e4), st.floats(0.2, 1e4), st.floats(100, 4000), st.floats(-1, 2))
def test_pixels_and_times_lead_back_to_each_other(start, duration, width, share):
    scale = TimeScale(start, start + duration, width)
    time_s = start + share * duration
    assert scale.time_of(scale.x_of(time_s)) == pytest.approx(time_s, abs=1e-6 * duration)


def test_what_is_far_away_has_a_pixel_that_can_be_painted():
    scale = TimeScale(0.0, 0.1, 4000)
    assert scale.x_of(1e12) == 1e6
    assert scale.x_of(-1e308) == -1e6


@given(st.floats(-1e3, 1e3), st.floats(1e-2, 1e4), st.integers(1, 20))
def test_ticks_are_round_inside_and_not_too_many(low, span, most):
    high = low + span
    step = tick_step(high - low, most)
    marks = ticks(low, high, most)
    assert len(marks) <= most + 1
    for mark in marks:
        assert low - 1e-6 * span <= mark <= high + 1e-6 * span
        assert mark / step == pytest.approx(round(mark / step), abs=1e-6)


@pytest.mark.parametrize(
    ("time_s", "text"),
    [(4.133, "00:04.133"), (59.9999, "01:00.000"), (-0.5, "-00:00.500"), (5400.25, "1:30:00.250")],
)
def test_times_are_written_as_clocks(time_s, text):
    assert clock_text(time_s) == text
