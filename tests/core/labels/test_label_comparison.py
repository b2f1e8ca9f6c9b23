"""What differs between two states of labels, counted and in words."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from labelled import even, imported, random_edit

from sd2core.labels.comparison import Comparison, changed_stretch, compare
from sd2core.labels.spans import Labels, LabelTrack, Span

START = imported(even(), 7)


def test_each_kind_is_counted() -> None:
    spans = list(START.spans)
    spans[0] = replace(spans[0], note="blurred")
    spans[1:4] = []
    spans += [Span(900, "Free", 0.0, 0.5, "a"), Span(901, "Free", 0.0, 0.5, "b")]
    after = replace(START, spans=tuple(spans))
    assert compare(START, after) == Comparison(2, 1, 3, False, False)
    assert compare(after, START) == Comparison(3, 1, 2, False, False)
    assert str(compare(START, after)) == "2 spans added, 1 changed, 3 removed"


@pytest.mark.parametrize("seed", range(20))
def test_no_difference_means_equal(seed: int) -> None:
    rng, labels = random.Random(seed), START
    for _ in range(5):
        labels = random_edit(labels, even(), rng).labels
    assert (str(compare(START, labels)) == "") == (labels == START)


def test_words() -> None:
    assert str(compare(Labels(), replace(Labels(), tracks=(LabelTrack("Left"),)))) == "other tracks"
    assert str(Comparison(0, 1, 0, False, True)) == "1 span changed, another label set"
    assert str(Comparison(0, 0, 12_345, False, False)) == "12,345 spans removed"
    assert str(compare(START, START)) == ""


def test_a_change_lies_where_spans_differ() -> None:
    spans = list(START.spans)
    moved = replace(spans[3], end_s=(spans[3].start_s + spans[3].end_s) / 2)
    after = replace(START, spans=(*spans[:3], moved, *spans[4:]))
    assert changed_stretch(START, START) is None
    assert changed_stretch(START, after) == (spans[3].start_s, spans[3].end_s)
    without = replace(START, spans=tuple(spans[:2] + spans[4:]))
    ends_s = max(spans[2].end_s, spans[3].end_s)
    assert changed_stretch(without, START) == (spans[2].start_s, ends_s)
