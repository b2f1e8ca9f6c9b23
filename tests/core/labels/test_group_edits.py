"""Several spans moved, nudged and copied as one, at ten frames per second."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from labelled import many_spans

from sd2core.errors import Sd2Error
from sd2core.labels.edits import (
    Edit,
    Edits,
)
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.timebase import Timebase

FRAMES = Timebase.regular(100, 10.0)  # 0 to 10 s
TRACKS = (LabelTrack("Gestures"), LabelTrack("Free", "free"))


def labels_of(*stretches: tuple[float, float]) -> Labels:
    spans = [Span(k, "Gestures", a, b, f"label {k}") for k, (a, b) in enumerate(stretches, 1)]
    return Labels(TRACKS, tuple(spans))


def times(edit: Edit) -> list[tuple[float, float]]:
    return [(pytest.approx(one.start_s), pytest.approx(one.end_s)) for one in edit.labels.spans]


LABELS = labels_of((1, 2), (2, 2.5), (3, 3.5), (5, 6))


def test_they_move_by_what_the_one_in_the_hand_moves() -> None:
    edit = Edits(LABELS, FRAMES).move((2, 3), 3, 3.52)
    assert times(edit) == [(1, 2), (2.5, 3), (3.5, 4), (5, 6)]
    assert (edit.name, edit.ids) == ("Move 2 spans", (2, 3))


@pytest.mark.parametrize(
    ("start_s", "second"), [(9.0, (3.5, 4.0)), (0.0, (2.0, 2.5)), (2.6, (2.0, 2.5))]
)
def test_they_stop_as_a_whole_where_the_first_meets_a_neighbour(start_s, second) -> None:
    edit = Edits(LABELS, FRAMES).move((2, 3), 3, start_s)
    found = times(edit)
    assert found[1] == second
    assert found[2] == (second[0] + 1, second[1] + 1)
    assert (found[0], found[3]) == ((1, 2), (5, 6))


def test_they_do_not_leave_the_recording() -> None:
    everything = (1, 2, 3, 4)
    assert times(Edits(LABELS, FRAMES).move(everything, 1, 99.0))[-1] == (9, 10)
    assert times(Edits(LABELS, FRAMES).move(everything, 1, -99.0))[0] == (0, 1)
    assert times(Edits(LABELS, FRAMES).nudge(everything, 99))[-1] == (9, 10)
    assert times(Edits(LABELS, FRAMES).nudge(everything, -99))[0] == (0, 1)


def test_a_nudge_goes_as_far_as_the_first_that_stops() -> None:
    assert times(Edits(LABELS, FRAMES).nudge((1, 3), 3)) == times(Edit("", LABELS))
    assert times(Edits(LABELS, FRAMES).nudge((2, 3), 20))[1:3] == [(3.5, 4), (4.5, 5)]
    refused = Edits(LABELS, FRAMES).nudge((1, 3), 3)
    assert refused.labels is LABELS


def test_copies_keep_their_distances_and_shorten_where_there_is_no_room() -> None:
    edit = Edits(LABELS, FRAMES).duplicate((2, 3), 7.0)
    assert times(edit)[-2:] == [(7, 7.5), (8, 8.5)]
    assert [edit.labels.span(one).label for one in edit.ids] == ["label 2", "label 3"]
    assert times(Edits(LABELS, FRAMES).duplicate((2, 3), 3.8))[3:5] == [(3.8, 4.3), (4.8, 5)]
    with pytest.raises(Sd2Error, match="every frame has a span"):
        Edits(LABELS, FRAMES).duplicate((2, 3), 4.2)


@pytest.mark.slow
@given(
    times_s=st.lists(st.floats(0.01, 0.5), min_size=20, max_size=40),
    edges=st.lists(st.integers(0, 19), min_size=4, max_size=12, unique=True),
    to_s=st.floats(-5, 15),
    data=st.data(),
)
def test_touching_ones_still_touch_where_frames_are_uneven(times_s, edges, to_s, data) -> None:
    base = Timebase([sum(times_s[:k]) for k in range(len(times_s))])
    edges = sorted(edges)
    places = [(base.time_of(a), base.time_of(b)) for a, b in pairwise(edges)]
    labels = labels_of(*places)
    ids = [span.id for span in labels.spans]
    lead = data.draw(st.sampled_from(ids))
    try:
        edit = Edits(labels, base).move(ids, lead, to_s)
    except Sd2Error:
        assume(False)  # a span between frames further apart than it is long
    spans = edit.labels.spans
    assert all(one.end_s == other.start_s for one, other in pairwise(spans))
    held = {*base.times_s.tolist(), base.end_s}
    assert all({span.start_s, span.end_s} <= held for span in spans)


@given(st.integers(1, 3), st.integers(-120, 120))
def test_several_go_as_far_as_one_alone_does(number: int, step: int) -> None:
    both = labels_of(*((2 * k, 2 * k + 1) for k in range(4)))
    start_s = both.span(number).start_s + step / 10
    alone = Edits(both, FRAMES).move((number,), number, start_s).labels.span(number)
    beside = Labels(TRACKS, (*both.spans, replace(both.span(number), id=9, track="Free")))
    together = Edits(beside, FRAMES).move((number, 9), number, start_s).labels
    assert together.span(number) == alone
    nudged = Edits(both, FRAMES).nudge((number,), step).labels.span(number)
    assert Edits(beside, FRAMES).nudge((number, 9), step).labels.span(number) == nudged


def test_thousands_at_once() -> None:
    base, labels = Timebase.regular(90_000, 30.0), many_spans(3000)
    edit = Edits(labels, base).nudge([span.id for span in labels.spans], 3)
    assert edit.labels.spans[0].start_s == base.time_of(3)
    assert edit.name == "Nudge 3000 spans"
