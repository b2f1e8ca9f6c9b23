"""Spans as arrays: lanes without overlaps, and columns that add up to what spans hold."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2app.labels.model import SpanArrays, span_columns
from sd2core.labels.spans import Labels, LabelTrack, Span

TRACKS = (LabelTrack("Left", "free"), LabelTrack("Right", "free"))
NAMES = ("left-to-right", "up-to-down", "nobody's")

placed = st.tuples(
    st.sampled_from(["Left", "Right"]),
    st.integers(0, 90),
    st.integers(1, 30),
    st.sampled_from(NAMES),
)

# No span is as wide as that to the last digit.
SCALES = st.sampled_from([0.0, 0.7713, 1.3119, 2.7177, 4.9311])


def labels_of(places: list[tuple[str, int, int, str]]) -> Labels:
    spans = (
        Span(number, track, start / 10, (start + length) / 10, label)
        for number, (track, start, length, label) in enumerate(places, start=1)
    )
    return Labels(TRACKS, tuple(spans))


@pytest.mark.slow
@given(st.lists(placed, max_size=40))
def test_spans_of_a_lane_do_not_overlap(places) -> None:
    labels = labels_of(places)
    arrays = SpanArrays.of(labels)
    assert len(arrays.lanes_of_track) == 2
    for row in range(sum(arrays.lanes_of_track)):
        spans = [labels.spans[one] for one in np.flatnonzero(arrays.rows == row)]
        assert all(one.end_s <= other.start_s for one, other in pairwise(spans))
    for track, lanes in zip(("Left", "Right"), arrays.lanes_of_track, strict=True):
        instants = np.arange(0.05, 12.0, 0.1)
        most = max(
            sum(one.start_s < at < one.end_s for one in labels.of_track(track)) for at in instants
        )
        assert lanes == max(most, 1)


@pytest.mark.slow
@given(st.lists(placed, max_size=40), st.integers(1, 57), st.booleans(), SCALES)
def test_columns_hold_what_spans_hold(places, columns, together, wide_columns) -> None:
    arrays = SpanArrays.of(labels_of(places))
    start_s, end_s = 1.0, 8.0
    found = span_columns(arrays, frozenset(), (start_s, end_s), columns, wide_columns)
    assert not found.selected.any()
    column_s = (end_s - start_s) / columns
    edges_s = start_s + column_s * np.arange(columns + 1)
    wide = (arrays.ends_s - arrays.starts_s) / column_s >= wide_columns
    in_view = (arrays.starts_s < end_s) & (arrays.ends_s > start_s)
    expected = np.zeros(found.share.shape)
    for one in np.flatnonzero(in_view & ~wide):
        upper = np.minimum(arrays.ends_s[one], edges_s[1:])
        expected[arrays.rows[one]] += (upper - np.maximum(arrays.starts_s[one], edges_s[:-1])).clip(
            0
        ) / column_s
    # The shortest are seen, by a thousandth.
    assert found.share == pytest.approx(np.minimum(expected, 1), abs=len(places) * 1.1e-3)
    assert ((found.share > 0) >= (expected > 1e-9)).all()
    assert found.wide.tolist() == np.flatnonzero(in_view & wide).tolist()
    if together:
        one_line = span_columns(
            arrays, frozenset(), (start_s, end_s), columns, wide_columns, together=True
        )
        assert one_line.share.shape == (1, columns)
        assert ((one_line.share[0] > 0) == (found.share > 0).any(axis=0)).all()


def test_the_colour_is_that_of_what_holds_most() -> None:
    arrays = SpanArrays.of(
        labels_of([("Left", 0, 3, NAMES[0]), ("Left", 3, 5, NAMES[1]), ("Left", 10, 5, NAMES[2])])
    )
    found = span_columns(arrays, frozenset({arrays.spans[1].id}), (0.0, 2.0), 2, 9.0)
    assert [arrays.colours[tone] for tone in found.tone[0]] == ["#d55e00", arrays.colours[-1]]
    assert found.selected[0].tolist() == [True, False]
    assert found.share[0] == pytest.approx([0.8, 0.5])


def test_no_spans() -> None:
    found = span_columns(SpanArrays.of(Labels()), frozenset(), (0.0, 1.0), 10, 4.0)
    assert found.share.shape == (1, 10)
    assert not found.share.any()
    assert not found.wide.size
