"""Spans as arrays: lanes without overlaps."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2app.labels.model import SpanArrays
from sd2core.labels.spans import Labels, LabelTrack, Span

TRACKS = (LabelTrack("Left", "free"), LabelTrack("Right", "free"))
NAMES = ("left-to-right", "up-to-down", "nobody's")

placed = st.tuples(
    st.sampled_from(["Left", "Right"]),
    st.integers(0, 90),
    st.integers(1, 30),
    st.sampled_from(NAMES),
)


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
