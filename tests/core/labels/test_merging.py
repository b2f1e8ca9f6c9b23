"""Merging of labels: by hand-made cases, and by what must hold for any edits of two people."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from labelled import even, imported, random_edit

from sd2core.labels.label_set import GESTURES, Label
from sd2core.labels.merging import merge
from sd2core.labels.spans import Labels, LabelTrack, Span

TRACK = "Gestures"


def span(number: int, start_s: float, end_s: float, label: str = "a", track: str = TRACK) -> Span:
    return Span(number, track, start_s, end_s, label)


BASE = Labels((LabelTrack(TRACK),), (span(1, 0, 1), span(2, 2, 3), span(3, 4, 5)))


def spans_of(labels: Labels, track: str = TRACK) -> list[tuple[float, float, str]]:
    return [(one.start_s, one.end_s, one.label) for one in labels.of_track(track)]


class TestSpans:
    def test_what_one_side_did_holds(self) -> None:
        mine = BASE.with_spans([span(1, 0, 1.5), span(4, 6, 7)])
        theirs = BASE.with_spans([span(2, 2, 3, "b"), span(4, 8, 9)], without=[3])
        merged = merge(BASE, mine, theirs)
        assert spans_of(merged.labels) == [(0, 1.5, "a"), (2, 3, "b"), (6, 7, "a"), (8, 9, "a")]
        assert merged.labels.span(4) == span(4, 6, 7)
        assert (merged.both, merged.aside) == (0, 0)

    def test_of_what_both_changed_both_are_kept(self) -> None:
        mine = BASE.with_spans([span(1, 0, 1.5)])
        theirs = BASE.with_spans([span(1, 0, 1, "b")])
        merged = merge(BASE, mine, theirs)
        assert merged.labels.span(1) == span(1, 0, 1.5)
        assert spans_of(merged.labels, "Gestures (both)") == [(0, 1, "b")]
        assert [one.name for one in merged.labels.tracks] == [TRACK, "Gestures (both)"]
        assert (merged.both, merged.aside) == (1, 1)

    def test_on_the_same_track_where_there_is_room(self) -> None:
        mine, theirs = BASE.with_spans([span(1, 0, 0.4)]), BASE.with_spans([span(1, 0.6, 1)])
        merged = merge(BASE, mine, theirs)
        assert spans_of(merged.labels)[:2] == [(0, 0.4, "a"), (0.6, 1, "a")]
        assert (merged.both, merged.aside) == (1, 0)

    def test_changed_goes_before_removed(self) -> None:
        changed, removed = BASE.with_spans([span(1, 0, 1, "b")]), BASE.with_spans(without=[1])
        for mine, theirs in ((changed, removed), (removed, changed)):
            assert merge(BASE, mine, theirs).labels == changed

    def test_what_both_did_alike_is_there_once(self) -> None:
        mine = BASE.with_spans([span(1, 0, 1, "b"), span(4, 6, 7)], without=[2])
        theirs = BASE.with_spans([span(1, 0, 1, "b"), span(9, 6, 7)], without=[2])
        assert merge(BASE, mine, theirs).labels is mine

    def test_the_same_gesture_marked_twice_is_seen_twice(self) -> None:
        mine, theirs = BASE.with_spans([span(4, 6, 7)]), BASE.with_spans([span(4, 6.1, 7.1)])
        merged = merge(BASE, mine, theirs)
        assert spans_of(merged.labels, "Gestures (both)") == [(6.1, 7.1, "a")]
        assert (merged.both, merged.aside) == (0, 1)


class TestTracksAndLabelSet:
    def test_tracks_of_both_sides(self) -> None:
        mine = replace(BASE, tracks=(*BASE.tracks, LabelTrack("Left")))
        theirs = Labels((LabelTrack(TRACK, "free"), LabelTrack("Right")), BASE.spans)
        names = [(one.name, one.overlap) for one in merge(BASE, mine, theirs).labels.tracks]
        assert names == [(TRACK, "free"), ("Left", "exclusive"), ("Right", "exclusive")]

    def test_a_track_that_was_removed_stays_for_what_the_other_put_on_it(self) -> None:
        base = replace(BASE, tracks=(*BASE.tracks, LabelTrack("Left"), LabelTrack("Right")))
        mine = replace(base, tracks=BASE.tracks)
        theirs = base.with_spans([span(4, 0, 1, track="Left")])
        merged = merge(base, mine, theirs).labels
        assert [one.name for one in merged.tracks] == [TRACK, "Left"]

    def test_labels_of_both_sides_with_no_key_twice(self) -> None:
        mine = replace(GESTURES, labels=(*GESTURES.labels, Label("push", "#112233", "p")))
        theirs = replace(GESTURES, labels=(*GESTURES.labels[1:], Label("pull", "#445566", "P")))
        sides = (replace(BASE, label_set=one) for one in (mine, theirs))
        found = merge(BASE, *sides).labels.label_set
        assert [one.name for one in found.labels] == [
            *(one.name for one in GESTURES.labels[1:]), "push", "pull"
        ]  # fmt: skip
        assert [found.find(name).key for name in ("push", "pull")] == ["p", ""]


def edited(labels: Labels, rng: random.Random) -> Labels:
    for _ in range(rng.randrange(8)):
        labels = random_edit(labels, even(120), rng).labels
    return labels


@pytest.mark.parametrize("seed", range(60))
def test_of_any_edits_nothing_is_lost(seed: int) -> None:
    rng = random.Random(seed)
    base = edited(imported(even(120), seed), rng)
    mine, theirs = edited(base, rng), edited(base, rng)
    merged = merge(base, mine, theirs)
    assert merge(base, mine, base).labels == mine
    assert merge(base, base, theirs).labels == theirs
    assert merge(base, mine, mine).labels == mine
    old = {one.id: one for one in base.spans}
    for side in (mine, theirs):
        for one in side.spans:
            alike = [
                other
                for other in merged.labels.spans
                if (other.start_s, other.end_s, other.label) == (one.start_s, one.end_s, one.label)
            ]
            assert alike or old.get(one.id) == one
    assert len(merged.labels.spans) <= len(mine.spans) + len(theirs.spans)
