"""Statistics per label, in closed form and against NumPy."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.labels.label_set import GESTURES
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.labels.statistics import (
    HEADINGS,
    label_statistics,
    statistics_rows,
    statistics_text,
)

FREE = (LabelTrack("Free", "free"),)
EXTENT_S = (0.0, 10.0)


def labels_of(*spans: tuple[float, float, str]) -> Labels:
    made = [Span(k, "Free", *span) for k, span in enumerate(spans, start=1)]
    return Labels(FREE, tuple(made))


def test_every_number_of_three_spans() -> None:
    labels = labels_of((1, 2, "up-to-down"), (3, 5, "up-to-down"), (6, 9, "up-to-down"))
    found = {one.label: one for one in label_statistics(labels, EXTENT_S)}
    one = found["up-to-down"]
    assert (one.count, one.total_s, one.mean_s, one.sd_s) == (3, 6.0, 2.0, 1.0)
    assert (one.median_s, one.shortest_s, one.longest_s, one.share) == (2.0, 1.0, 3.0, 0.6)


def test_labels_of_the_set_come_first_with_or_without_spans() -> None:
    labels = labels_of((1, 2, "zebra"), (2, 3, "apple"), (3, 4, "background"))
    found = label_statistics(labels)
    names = [label.name for label in GESTURES.labels]
    assert [one.label for one in found] == [*names, "apple", "zebra"]
    empty, single = found[0], found[4]
    assert (empty.count, empty.total_s, empty.mean_s, empty.longest_s) == (0, 0.0, None, None)
    assert (single.count, single.mean_s, single.sd_s, single.share) == (1, 1.0, None, None)


def test_an_instant_counts_once_in_the_share_and_in_every_span_of_the_total() -> None:
    labels = labels_of((0, 4, "wave"), (2, 3, "wave"), (3, 5, "wave"), (8, 12, "wave"))
    one = label_statistics(labels, EXTENT_S)[-1]
    assert one.total_s == 11.0
    assert one.share == pytest.approx((5 + 2) / 10)


times_s = st.integers(0, 200).map(lambda number: number / 10)


@given(st.lists(st.tuples(times_s, times_s, st.sampled_from(["wave", "push"])), max_size=30))
def test_against_numpy_and_against_counting_instants(drawn) -> None:
    spans = [(min(a, b), max(a, b), label) for a, b, label in drawn if a != b]
    extent_s = (2.0, 17.0)
    found = {one.label: one for one in label_statistics(labels_of(*spans), extent_s)}
    middles_s = np.arange(2.05, 17.0, 0.1)
    for label in ("wave", "push"):
        durations_s = [end - start for start, end, name in spans if name == label]
        if not durations_s:
            assert label not in found
            continue
        one = found[label]
        assert one.total_s == pytest.approx(sum(durations_s))
        assert one.mean_s == pytest.approx(np.mean(durations_s))
        assert one.median_s == pytest.approx(np.median(durations_s))
        held = np.zeros(len(middles_s), bool)
        for start_s, end_s, name in spans:
            held |= (name == label) & (start_s <= middles_s) & (middles_s < end_s)
        assert one.share == pytest.approx(held.mean())


@pytest.mark.parametrize("separator", [",", "\t"])
def test_a_spreadsheet_computes_no_label(separator: str) -> None:
    rows = statistics_rows(label_statistics(labels_of((1, 2, "@SUM(A1)"), (3, 4, "=1"))))
    lines = list(csv.reader(io.StringIO(statistics_text(rows, separator)), delimiter=separator))
    assert [line[0] for line in lines[-2:]] == ["'=1", "'@SUM(A1)"]


def test_as_text_it_can_be_read_back() -> None:
    labels = labels_of((1, 2, 'say "hi", wave'), (3, 5.5, 'say "hi", wave'), (6, 7, "–"))
    rows = statistics_rows(label_statistics(labels))
    for separator in (",", "\t"):
        text = statistics_text(rows, separator)
        heading, *lines = csv.reader(io.StringIO(text), delimiter=separator)
        assert tuple(heading) == HEADINGS
        assert lines[0] == ["left-to-right", "0", "0.000", *[""] * 6]
        expected = ["2", "3.500", "1.750", "1.061", "1.750", "1.000", "2.500", ""]
        assert lines[5] == ['say "hi", wave', *expected]
        assert lines[6][0] == "–"
