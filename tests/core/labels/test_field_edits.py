"""What is said of spans and tracks changes; times and everything else stay."""

from __future__ import annotations

from dataclasses import replace

import pytest

from sd2core.errors import Sd2Error
from sd2core.labels.field_edits import (
    SpanField,
    add_track,
    change_spans,
    change_track,
    move_track,
    reject,
    remove_track,
    take,
)
from sd2core.labels.free_time import LabelledFrames
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.timebase import Timebase

FRAMES = Timebase.regular(100, 10.0)
LABELS = Labels(
    (LabelTrack("Gestures"), LabelTrack("Suggested", "free")),
    (
        Span(1, "Gestures", 1.037, 2.0, "up-to-down"),
        Span(2, "Suggested", 1.5, 2.5, "down-to-up", confidence=0.7, origin="suggestion"),
        Span(3, "Suggested", 1.6, 1.9, "background", origin="suggestion"),
    ),
)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("label", "left-to-right"),
        ("note", "clear"),
        ("author", "B"),
        ("confidence", 0.2),
        ("track", "Suggested"),
        ("person", "anna"),
    ],
)
def test_one_field_changes(field: SpanField, value: object) -> None:
    edit = change_spans(LABELS, [1, 3], **{field: value})
    after = edit.labels
    assert (edit.name, edit.ids) == (f"Change {field}", (1, 3))
    for span in LABELS.spans:
        expected = replace(span, **{field: value}) if span.id in (1, 3) else span
        assert after.span(span.id) == expected
    assert after.tracks == LABELS.tracks


def test_bad_values_are_refused() -> None:
    with pytest.raises(Sd2Error, match="name of a person"):
        change_spans(LABELS, [1], person="two\nlines")
    with pytest.raises(Sd2Error, match=r"confidence 1\.5.*0 to 1"):
        change_spans(LABELS, [1], confidence=1.5)
    with pytest.raises(Sd2Error, match="No track is called 'Feet'"):
        change_spans(LABELS, [1], track="Feet")
    with pytest.raises(Sd2Error, match=r"Span 1 .* and Span 2 .* overlap on 'Gestures'"):
        change_spans(LABELS, [2], track="Gestures")


class TestSuggestions:
    def test_accepted_it_is_a_persons(self) -> None:
        edit = take(LabelledFrames(LABELS, FRAMES), [2], "Suggested", "wave", keep_known=True)
        assert edit.labels.span(2) == replace(LABELS.span(2), origin="person")
        assert edit.name == "Accept suggestion"

    def test_on_another_track_it_takes_the_free_part(self) -> None:
        after = take(LabelledFrames(LABELS, FRAMES), [2], "Gestures", "wave").labels
        assert (after.span(2).track, after.span(2).start_s, after.span(2).end_s) == (
            "Gestures", 2.0, 2.5,
        )  # fmt: skip

    def test_without_room_the_refusal_says_where(self) -> None:
        with pytest.raises(Sd2Error, match=r"From 1\.600 to 1\.900 s every frame has a span"):
            take(LabelledFrames(LABELS, FRAMES), [3], "Gestures", "wave")

    def test_rejected_it_is_gone(self) -> None:
        assert [span.id for span in reject(LABELS, [2, 3]).labels.spans] == [1]
        for edit in (
            lambda: reject(LABELS, [1]),
            lambda: take(LabelledFrames(LABELS, FRAMES), [1], "Gestures", "wave"),
        ):
            with pytest.raises(Sd2Error, match=r"Span 1 .*origin 'person'. Expected: a sugg"):
                edit()


class TestTracks:
    def test_added_below(self) -> None:
        assert add_track(LABELS, "C").labels.tracks == (*LABELS.tracks, LabelTrack("C"))
        assert add_track(LABELS, "C", "free").labels.tracks[-1] == LabelTrack("C", "free")
        with pytest.raises(Sd2Error, match="a name of its own"):
            add_track(LABELS, "Gestures")

    def test_renamed_with_its_spans(self) -> None:
        after = change_track(LABELS, "Suggested", name="Model").labels
        assert [span.track for span in after.spans] == ["Gestures", "Model", "Model"]
        assert after.tracks[1] == LabelTrack("Model", "free")
        assert change_track(after, "Model", name="Suggested").labels == LABELS
        with pytest.raises(Sd2Error, match="a name of its own"):
            change_track(LABELS, "Suggested", name="Gestures")

    def test_removed_with_its_spans(self) -> None:
        edit = remove_track(LABELS, "Suggested")
        assert edit.name == "Remove track with 2 spans"
        assert [span.id for span in edit.labels.spans] == [1]
        assert edit.labels.tracks == (LabelTrack("Gestures"),)

    def test_put_in_another_order(self) -> None:
        after = move_track(LABELS, "Suggested", 0).labels
        assert [track.name for track in after.tracks] == ["Suggested", "Gestures"]
        assert after.spans == LABELS.spans

    def test_overlaps_forbidden_only_where_there_are_none(self) -> None:
        with pytest.raises(Sd2Error, match=r"Span 2 .* and Span 3 .* overlap"):
            change_track(LABELS, "Suggested", overlap="exclusive")
        after = change_track(reject(LABELS, [3]).labels, "Suggested", overlap="exclusive").labels
        assert after.track("Suggested").overlap == "exclusive"


def test_spans_are_found_by_their_ids_in_the_order_of_time() -> None:
    assert [span.id for span in LABELS.these([3, 1, 3])] == [1, 3]
    assert LABELS.these([]) == []
    with pytest.raises(Sd2Error, match="No span has the id 9"):
        LABELS.these([1, 9])
