from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2app.session.time_window import TimeWindow

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
