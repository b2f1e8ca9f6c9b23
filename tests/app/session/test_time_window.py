from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2app.session.time_window import GROWING_S, TimeWindow

moves = st.one_of(
    st.tuples(st.just("zoom"), st.floats(0.01, 100), st.floats(-20, 50)),
    st.tuples(st.just("pan"), st.floats(-100, 100), st.none()),
    st.tuples(st.just("set_span"), st.floats(-20, 50), st.floats(-20, 50)),
    st.tuples(st.just("reveal"), st.floats(0, 29.9), st.none()),
)


@given(st.lists(moves, max_size=30))
def test_the_span_never_leaves_the_recording(sequence):
    span = TimeWindow()
    span.set_extent(0.0, 30.0)
    for name, first, second in sequence:
        getattr(span, name)(*(value for value in (first, second) if value is not None))
        assert -1e-9 <= span.start_s < span.end_s <= 30.0 + 1e-9
        assert span.duration_s >= 0.2 - 1e-9
        if name == "reveal":
            assert span.start_s - 1e-9 <= first < span.end_s + 1e-9


def test_zooming_keeps_the_anchor_in_place():
    span = TimeWindow()
    span.set_extent(0.0, 30.0)
    span.zoom(0.5, 10.0)
    share = (10.0 - span.start_s) / span.duration_s
    assert share == pytest.approx(1 / 3)
    assert span.duration_s == pytest.approx(15.0)
    span.fit()
    assert (span.start_s, span.end_s) == (0.0, 30.0)


@given(st.lists(st.floats(0.001, 7.0), min_size=1, max_size=40), st.sampled_from([0.0, GROWING_S]))
def test_a_window_at_the_end_of_a_growing_recording_stays_there(steps, room_s):
    span = TimeWindow()
    span.set_extent(0.0, 0.03)
    end_s = 0.03
    for step_s in steps:
        end_s += step_s
        span.extend(end_s, room_s)
        assert span.extent_s == (0.0, max(end_s, room_s, 0.2))
        assert span.end_s == pytest.approx(span.extent_s[1])
        assert span.duration_s == pytest.approx(min(span.extent_s[1], GROWING_S))
    span.extend(end_s)  # it has ended, and there is no more room beyond it
    assert span.extent_s == (0.0, max(end_s, 0.2))
    assert span.end_s == pytest.approx(max(end_s, 0.2))


def test_a_window_elsewhere_stays_where_the_user_put_it():
    span = TimeWindow()
    span.set_extent(0.0, 30.0)
    span.set_span(4.0, 9.0)
    span.extend(31.0, GROWING_S)
    assert (span.start_s, span.end_s) == (4.0, 9.0)
    span.set_span(29.0, 31.0)  # at the end, as long as the user wants it
    span.extend(32.5, GROWING_S)
    assert (span.start_s, span.end_s) == (30.5, 32.5)
    span.fit()
    span.extend(33.5, GROWING_S)
    assert (span.start_s, span.end_s) == (1.0, 33.5)
