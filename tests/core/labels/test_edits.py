"""Each edit does what it says, at ten frames per second so that results can be read."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.labels.edits import (
    Edit,
    Edits,
    merge,
)
from sd2core.labels.field_edits import delete
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.timebase import Timebase

FRAMES = Timebase.regular(100, 10.0)  # 0 to 10 s
JUMPY = Timebase([0.0, 0.1, 0.2, 1.0, 1.1, 3.0, 3.1, 3.2])  # until 3.3 s


def labels_of(*stretches: tuple[float, float], overlap: str = "exclusive") -> Labels:
    """Spans 1, 2, … on one track."""
    spans = [Span(k + 1, "Gestures", a, b, f"label {k + 1}") for k, (a, b) in enumerate(stretches)]
    return Labels((LabelTrack("Gestures", overlap), LabelTrack("Other")), tuple(spans))  # type: ignore[arg-type]


def times(edit: Edit | Labels, track: str = "Gestures") -> list[tuple[float, float]]:
    """Where spans begin and end, in order."""
    labels = edit.labels if isinstance(edit, Edit) else edit
    return [(round(s.start_s, 9), round(s.end_s, 9)) for s in labels.of_track(track)]


TWO = labels_of((1.0, 2.0), (3.0, 4.0))


class TestCreate:
    def test_from_frame_to_frame_in_either_direction(self) -> None:
        for one_s, other_s in ((5.04, 6.06), (6.06, 5.04)):
            made = Edits(TWO, FRAMES).create("Gestures", one_s, other_s, "up")
            assert times(made)[-1] == (5.0, 6.1)
            span = made.labels.span(made.ids[0])
            assert (span.id, span.label, span.author) == (3, "up", "")

    def test_a_click_is_the_frame_that_is_shown(self) -> None:
        assert times(Edits(Labels(), FRAMES).create("Gestures", 5.19, 5.19, "up")) == [(5.1, 5.2)]
        assert times(Edits(Labels(), JUMPY).create("Gestures", 2.9, 2.9, "up")) == [(1.1, 3.0)]
        assert times(Edits(Labels(), FRAMES).create("Gestures", 99, 99, "up")) == [(9.9, 10.0)]
        assert times(Edits(Labels(), FRAMES).create("Gestures", -9, -8, "up")) == [(0.0, 0.1)]

    def test_takes_the_longest_part_that_is_free(self) -> None:
        assert times(Edits(TWO, FRAMES).create("Gestures", 1.5, 2.8, "up"))[1] == (2.0, 2.8)
        assert times(Edits(TWO, FRAMES).create("Gestures", 0.5, 3.2, "up"))[1] == (2.0, 3.0)
        assert times(Edits(TWO, FRAMES).create("Gestures", 3.9, 20, "up"))[2] == (4.0, 10.0)

    def test_refuses_where_nothing_is_free(self) -> None:
        with pytest.raises(Sd2Error, match=r"From 1\.200 to 1\.700 s every frame has a span"):
            Edits(TWO, FRAMES).create("Gestures", 1.2, 1.7, "up")
        with pytest.raises(Sd2Error, match=r"No track is called 'Feet'\. Expected: one of Gest"):
            Edits(TWO, FRAMES).create("Feet", 1.2, 1.7, "up")
        with pytest.raises(Sd2Error, match="nan"):
            Edits(TWO, FRAMES).create("Gestures", 1.2, float("nan"), "up")

    def test_overlaps_where_it_may(self) -> None:
        free = labels_of((1.0, 2.0), overlap="free")
        assert times(Edits(free, FRAMES).create("Gestures", 1.5, 2.5, "up")) == [
            (1.0, 2.0),
            (1.5, 2.5),
        ]


class TestResize:
    @pytest.mark.parametrize(
        ("side", "time_s", "expected"),
        [
            ("end", 2.44, (1.0, 2.4)),
            ("end", 9.0, (1.0, 3.0)),  # the neighbour
            ("end", 0.0, (1.0, 1.1)),  # one frame
            ("start", 0.44, (0.4, 2.0)),
            ("start", -5.0, (0.0, 2.0)),  # the recording
            ("start", 2.5, (1.9, 2.0)),
        ],
    )
    def test_first_of_two(self, side: str, time_s: float, expected: tuple[float, float]) -> None:
        edit = Edits(TWO, FRAMES).resize(1, side, time_s)  # type: ignore[arg-type]
        assert times(edit) == [expected, (3.0, 4.0)]
        assert edit.name == f"Move {side} of span"
        assert edit.ids == (1,)

    def test_stops_exactly_at_an_import_between_frames(self) -> None:
        labels = labels_of((1.0, 2.0), (3.04, 4.0))
        met = Edits(labels, FRAMES).resize(1, "end", 5.0)
        assert times(met) == [(1.0, 3.04), (3.04, 4.0)]
        assert times(Edits(labels, FRAMES).resize(2, "end", 3.0)) == [(1.0, 2.0), (3.04, 3.2)]

    def test_the_other_edge_stays_between_frames(self) -> None:
        labels = labels_of((1.04, 2.04))
        assert times(Edits(labels, FRAMES).resize(1, "end", 2.5)) == [(1.04, 2.5)]
        assert times(Edits(labels, FRAMES).resize(1, "start", 9.0)) == [(2.0, 2.04)]

    def test_refuses_where_no_frame_would_be_left(self) -> None:
        labels = labels_of((1.03, 1.05), (1.05, 1.2))
        with pytest.raises(Sd2Error, match=r"Span 1 .*no room for a frame"):
            Edits(labels, FRAMES).resize(1, "end", 1.5)

    def test_uneven_frames(self) -> None:
        labels = labels_of((0.0, 1.0))
        assert times(Edits(labels, JUMPY).resize(1, "end", 2.2)) == [(0.0, 3.0)]
        assert times(Edits(labels, JUMPY).resize(1, "start", 0.7)) == [(0.2, 1.0)]


class TestMove:
    @pytest.mark.parametrize(
        ("to_s", "expected"),
        [(1.54, (1.5, 2.5)), (2.3, (2.0, 3.0)), (9.0, (2.0, 3.0)), (-9.0, (0.0, 1.0))],
    )
    def test_keeps_its_duration_and_stops(self, to_s: float, expected: tuple[float, float]) -> None:
        assert times(Edits(TWO, FRAMES).move([1], 1, to_s)) == [expected, (3.0, 4.0)]

    def test_stays_inside_the_recording(self) -> None:
        assert times(Edits(TWO, FRAMES).move([2], 2, 50.0))[1] == (9.0, 10.0)

    def test_passes_others_where_spans_may_overlap(self) -> None:
        free = labels_of((1.0, 2.0), (3.0, 4.0), overlap="free")
        assert times(Edits(free, FRAMES).move([1], 1, 3.5)) == [(3.0, 4.0), (3.5, 4.5)]

    def test_keeps_seconds_where_frames_are_uneven(self) -> None:
        labels = labels_of((0.0, 0.2))
        assert times(Edits(labels, JUMPY).move([1], 1, 3.0)) == [(3.0, 3.2)]
        assert times(Edits(labels, JUMPY).move([1], 1, 1.1)) == [
            (1.1, 3.0)
        ]  # a frame that lasts longer

    def test_where_it_is_changes_nothing(self) -> None:
        assert Edits(TWO, FRAMES).move([1], 1, 1.01).labels is TWO

    def test_refuses_between_two_frames(self) -> None:
        labels = labels_of((1.01, 1.03), (1.03, 1.2), (0.9, 1.01))
        with pytest.raises(Sd2Error, match="no room for a frame"):
            Edits(labels, FRAMES).move([1], 1, 1.0)


class TestNudge:
    def test_by_frames_until_the_neighbour(self) -> None:
        assert times(Edits(TWO, FRAMES).nudge([1], 3))[0] == (1.3, 2.3)
        assert times(Edits(TWO, FRAMES).nudge([1], 30))[0] == (2.0, 3.0)
        assert times(Edits(TWO, FRAMES).nudge([1], -30))[0] == (0.0, 1.0)

    @given(count=st.integers(-3, 3))
    def test_there_and_back(self, count: int) -> None:
        labels = labels_of((1.0, 3.0))  # frames 3 and 4, of different lengths
        there = Edits(labels, JUMPY).nudge([1], count).labels
        assert there.span(1).start_s == JUMPY.times_s[3 + count]
        assert Edits(there, JUMPY).nudge([1], -count).labels == labels

    def test_an_import_goes_to_frames(self) -> None:
        labels = labels_of((1.04, 2.04))
        assert times(Edits(labels, FRAMES).nudge([1], 1)) == [(1.1, 2.1)]
        assert times(Edits(labels, FRAMES).nudge([1], -2)) == [(0.9, 1.9)]


class TestSplit:
    def test_at_the_nearest_frame(self) -> None:
        edit = Edits(TWO, FRAMES).split(1, 1.26)
        assert times(edit) == [(1.0, 1.3), (1.3, 2.0), (3.0, 4.0)]
        assert edit.ids == (1, 3)
        assert edit.labels.span(3) == replace(TWO.span(1), id=3, start_s=edit.labels.span(1).end_s)

    def test_leaves_a_frame_on_both_sides(self) -> None:
        assert times(Edits(TWO, FRAMES).split(1, 1.0))[:2] == [(1.0, 1.1), (1.1, 2.0)]
        assert times(Edits(TWO, FRAMES).split(1, 2.0))[:2] == [(1.0, 1.9), (1.9, 2.0)]

    def test_refuses_one_frame_and_other_places(self) -> None:
        with pytest.raises(Sd2Error, match="a single frame"):
            Edits(labels_of((1.0, 1.1)), FRAMES).split(1, 1.05)
        with pytest.raises(Sd2Error, match=r"split at 2\.500 s. Expected: a time within it"):
            Edits(TWO, FRAMES).split(1, 2.5)
        with pytest.raises(Sd2Error, match=r"No span has the id 7\. Expected: one of the 2 spans"):
            Edits(TWO, FRAMES).split(7, 2.5)

    @given(time_s=st.floats(1.0, 2.0))
    def test_merged_again_it_is_what_it_was(self, time_s: float) -> None:
        edit = Edits(TWO, FRAMES).split(1, time_s)
        assert merge(edit.labels, edit.ids).labels == TWO


class TestMerge:
    def test_nothing_that_was_said_is_lost(self) -> None:
        one = Span(1, "Gestures", 1.0, 2.0, "up", note="clear", author="A", confidence=0.9)
        other = Span(2, "Gestures", 3.0, 4.0, "down", note="blurred", author="B", confidence=0.4)
        merged = merge(Labels(spans=(one, other)), [2, 1])
        assert merged.labels.spans == (
            Span(1, "Gestures", 1.0, 4.0, "up", "clear; blurred", "A, B", 0.4),
        )
        assert merged.ids == (1,)

    def test_refuses_others_between_and_other_tracks(self) -> None:
        three = labels_of((1.0, 2.0), (3.0, 4.0), (5.0, 6.0))
        with pytest.raises(Sd2Error, match=r"Span 1 .* and Span 2 .* overlap"):
            merge(three, [1, 3])
        assert times(merge(three, [1, 2, 3])) == [(1.0, 6.0)]
        with pytest.raises(Sd2Error, match="1 spans on Gestures are to be merged"):
            merge(three, [1, 1])
        elsewhere = Edits(TWO, FRAMES).create("Other", 5, 6, "up").labels
        with pytest.raises(Sd2Error, match="on Gestures, Other"):
            merge(elsewhere, [1, 3])


class TestMeet:
    def test_a_gap_is_closed_where_one_points(self) -> None:
        assert times(Edits(TWO, FRAMES).join_at(2, 1, 2.44)) == [(1.0, 2.4), (2.4, 4.0)]

    def test_each_keeps_a_frame(self) -> None:
        assert times(Edits(TWO, FRAMES).join_at(1, 2, 0.0)) == [(1.0, 1.1), (1.1, 4.0)]
        assert times(Edits(TWO, FRAMES).join_at(1, 2, 9.0)) == [(1.0, 3.9), (3.9, 4.0)]

    def test_an_overlap_is_cut(self) -> None:
        free = labels_of((1.0, 3.0), (2.0, 4.0), overlap="free")
        assert times(Edits(free, FRAMES).join_at(1, 2, 2.5)) == [(1.0, 2.5), (2.5, 4.0)]

    def test_only_neighbours(self) -> None:
        three = labels_of((1.0, 2.0), (3.0, 4.0), (5.0, 6.0))
        with pytest.raises(Sd2Error, match="two neighbours on one track"):
            Edits(three, FRAMES).join_at(1, 3, 2.5)
        with pytest.raises(Sd2Error, match="two neighbours"):
            Edits(three, FRAMES).join_at(1, 1, 2.5)


class TestOverwrite:
    def test_cuts_trims_and_covers(self) -> None:
        labels = labels_of((0.0, 1.0), (1.0, 1.3), (1.3, 2.0))
        done = Edits(labels, FRAMES).overwrite("Gestures", 0.5, 1.5, "up")
        assert times(done) == [(0.0, 0.5), (0.5, 1.5), (1.5, 2.0)]
        assert [span.label for span in done.labels.spans] == ["label 1", "up", "label 3"]

    def test_a_span_around_it_becomes_two(self) -> None:
        done = Edits(TWO, FRAMES).overwrite("Gestures", 1.4, 1.6, "up")
        assert times(done) == [(1.0, 1.4), (1.4, 1.6), (1.6, 2.0), (3.0, 4.0)]
        assert [span.label for span in done.labels.spans][:3] == ["label 1", "up", "label 1"]
        assert done.labels.span(done.ids[0]).label == "up"

    def test_less_than_a_frame_is_not_left(self) -> None:
        labels = labels_of((1.02, 1.58))
        assert times(Edits(labels, FRAMES).overwrite("Gestures", 1.1, 1.5, "up")) == [
            (1.1, 1.5),
            (1.5, 1.58),
        ]


class TestFillGaps:
    def test_every_gap_gets_a_span(self) -> None:
        filled = Edits(TWO, FRAMES).fill_gaps("Gestures", "background")
        assert times(filled) == [(0, 1), (1, 2), (2, 3), (3, 4), (4, 10)]
        assert [filled.labels.span(one).label for one in filled.ids] == ["background"] * 3
        assert (
            Edits(filled.labels, FRAMES).fill_gaps("Gestures", "background").labels is filled.labels
        )

    def test_what_holds_no_frame_is_no_gap(self) -> None:
        labels = labels_of((0.0, 1.01), (1.09, 10.0))
        assert Edits(labels, FRAMES).fill_gaps("Gestures", "none").labels is labels

    def test_of_overlapping_spans(self) -> None:
        free = labels_of((0.0, 5.0), (1.0, 2.0), (6.0, 10.0), overlap="free")
        assert times(Edits(free, FRAMES).fill_gaps("Gestures", "none"))[2] == (5.0, 6.0)


def test_a_copy_keeps_what_is_said_and_fits_in() -> None:
    labels = labels_of((1.0, 2.0), (3.0, 4.0))
    labels = labels.with_spans([replace(labels.span(1), note="clear", confidence=0.5)])
    copy = Edits(labels, FRAMES).duplicate([1], 2.5)
    assert times(copy)[1] == (2.5, 3.0)
    assert copy.labels.span(3) == replace(labels.span(1), id=3, start_s=2.5, end_s=3.0)
    free = labels_of((1.0, 2.0), overlap="free")
    assert times(Edits(free, FRAMES).duplicate([1], 1.5)) == [(1.0, 2.0), (1.5, 2.5)]
    assert times(Edits(labels, FRAMES).duplicate([1], 9.8))[-1] == (9.0, 10.0)


def test_deleted_spans_are_gone() -> None:
    assert times(delete(TWO, [1])) == [(3.0, 4.0)]
    assert delete(TWO, [1, 2, 2]).name == "Delete 2 spans"
    with pytest.raises(Sd2Error, match="No span has the id 5"):
        delete(TWO, [1, 5])
