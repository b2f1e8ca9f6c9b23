"""Suggestions are offered, taken and turned down; what was decided is not asked again."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.labels.field_edits import offer, pending, reject, take
from sd2core.labels.free_time import LabelledFrames
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.labels.suggest import TRACK
from sd2core.timebase import Timebase

FRAMES = Timebase.regular(100, 10.0)
MINE = Span(4, "Gestures", 5.0, 6.0, "up-to-down")
HERE = Labels((LabelTrack("Gestures"),), (MINE,))


def of_map(*times_s: tuple[float, float]) -> list[Span]:
    return [
        Span(k, "anything", start_s, end_s, "gesture", confidence=0.5, origin="suggestion")
        for k, (start_s, end_s) in enumerate(times_s, start=1)
    ]


def times(spans) -> list[tuple[float, float]]:
    return [(pytest.approx(span.start_s), pytest.approx(span.end_s)) for span in spans]


def test_they_stand_on_frames_of_their_own_track() -> None:
    done = offer(LabelledFrames(HERE, FRAMES), of_map((1.03, 2.06), (9.5, 11.0)))
    assert done.name == "Suggest 2 spans"
    assert done.labels.tracks == (LabelTrack("Gestures"), LabelTrack(TRACK, "free"))
    assert times(pending(done.labels)) == [(1.0, 2.1), (9.5, 10.0)]
    assert done.ids == (5, 6)
    assert done.labels.span(4) == MINE


def test_what_is_marked_or_was_turned_down_is_not_offered() -> None:
    first = offer(LabelledFrames(HERE, FRAMES), of_map((1.0, 2.0), (3.0, 4.0), (5.1, 6.1)))
    assert times(pending(first.labels)) == [(1.0, 2.0), (3.0, 4.0)]
    declined = [first.labels.span(first.ids[0])]
    again = offer(
        LabelledFrames(first.labels, FRAMES), of_map((1.1, 2.1), (3.0, 3.9), (7.0, 8.0)), declined
    )
    # Those of the last time have gone.
    assert times(pending(again.labels)) == [(3.0, 3.9), (7.0, 8.0)]


def test_nothing_found_leaves_no_track_behind() -> None:
    some = offer(LabelledFrames(HERE, FRAMES), of_map((1.0, 2.0))).labels
    none = offer(LabelledFrames(some, FRAMES), [])
    assert (none.name, none.labels) == ("Remove suggestions", HERE)
    assert offer(LabelledFrames(HERE, FRAMES), []).labels is HERE
    assert reject(some, [5]).labels == HERE


def test_a_person_takes_them_with_a_label() -> None:
    some = offer(LabelledFrames(HERE, FRAMES), of_map((1.0, 2.0), (3.0, 4.0))).labels
    one = take(LabelledFrames(some, FRAMES), [5], "Gestures", "down-to-up")
    assert one.name == "Accept suggestion"
    taken = one.labels.span(5)
    assert (taken.track, taken.label, taken.origin) == ("Gestures", "down-to-up", "person")
    last = take(LabelledFrames(one.labels, FRAMES), [6], "Gestures", "down-to-up")
    assert last.labels.tracks == (LabelTrack("Gestures"),)


def test_a_label_of_the_set_may_stay() -> None:
    named = [Span(9, TRACK, 1.0, 2.0, "background", origin="suggestion"), *of_map((3.0, 4.0))]
    some = offer(LabelledFrames(HERE, FRAMES), named).labels
    done = take(
        LabelledFrames(some, FRAMES), [5, 6], "Gestures", "up-to-down", keep_known=True
    ).labels
    assert [done.span(one).label for one in (5, 6)] == ["background", "up-to-down"]


def test_without_room_it_stays_a_suggestion() -> None:
    some = offer(LabelledFrames(HERE, FRAMES), of_map((1.0, 2.0), (5.2, 5.5))).labels
    done = take(LabelledFrames(some, FRAMES), [5, 6], "Gestures", "up-to-down")
    assert done.ids == (5,)
    assert [span.id for span in pending(done.labels)] == [6]
    with pytest.raises(Sd2Error, match="every frame has a span"):
        take(LabelledFrames(done.labels, FRAMES), [6], "Gestures", "up-to-down")
    with pytest.raises(Sd2Error, match="a suggestion"):
        reject(done.labels, [4])


@given(
    st.lists(
        st.tuples(st.floats(-1, 11), st.floats(0.01, 4)).map(lambda t: (t[0], t[0] + t[1])),
        max_size=8,
    ),
    st.data(),
)
def test_whatever_is_turned_down_stays_away(found_s, data) -> None:
    found = of_map(*found_s)
    offered = offer(LabelledFrames(HERE, FRAMES), found)
    gone = data.draw(st.lists(st.sampled_from(offered.ids), unique=True)) if offered.ids else []
    declined = [offered.labels.span(one) for one in gone]
    left = reject(offered.labels, gone).labels
    assert set(pending(left)) == set(pending(offered.labels)) - set(declined)
    again = offer(
        LabelledFrames(left, FRAMES), [offered.labels.span(one) for one in offered.ids], declined
    )
    kept = {(span.start_s, span.end_s) for span in pending(again.labels)}
    assert kept.isdisjoint((span.start_s, span.end_s) for span in declined)
    assert again.labels.span(4) == MINE
