"""Labels of a file taken into a recording: nothing is lost without being named."""

from __future__ import annotations

from dataclasses import replace

import pytest
from any_labels import any_labels
from hypothesis import HealthCheck, given, settings

from sd2core.errors import Sd2Error
from sd2core.labels.formats import FORMATS, read_labels, would_lose, write_labels
from sd2core.labels.free_time import LabelledFrames
from sd2core.labels.import_labels import Incoming, free_name
from sd2core.labels.label_set import GESTURES, Label, LabelSet
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.timebase import Timebase

FRAMES = Timebase.regular(100, 10.0)
HERE = Labels((LabelTrack("Gestures"),), (Span(7, "Gestures", 1.0, 2.0, "up-to-down"),))
moderate = settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])


def file_of(*spans: tuple[float, float, str], label_set: LabelSet = GESTURES) -> Labels:
    made = tuple(
        Span(number, "Gestures", start_s, end_s, label, origin="import")
        for number, (start_s, end_s, label) in enumerate(spans, start=1)
    )
    return Labels((LabelTrack("Gestures"),), made, label_set)


def test_what_lies_beyond_the_recording_is_cut_or_left_out() -> None:
    found = Incoming.of(
        file_of((-1.0, 0.5, "a"), (3.033, 3.044, "b"), (9.5, 12.0, "c"), (12.0, 13.0, "d")), FRAMES
    )
    assert [(span.start_s, span.end_s, span.label) for span in found.labels.spans] == [
        (0.0, 0.5, "a"),
        (3.033, 3.044, "b"),
        (9.5, 10.0, "c"),
    ]
    assert [span.label for span in found.cut] == ["a", "c"]
    assert [(span.start_s, span.label) for span in found.outside] == [(12.0, "d")]
    assert found.unknown(GESTURES) == {"a": 1, "b": 1, "c": 1}


def test_a_cut_that_leaves_no_frame_leaves_the_span_out() -> None:
    found = Incoming.of(file_of((-1.0, 0.0, "before"), (9.95, 10.5, "late")), FRAMES)
    assert not found.labels.spans
    assert len(found.outside) == 2


@pytest.mark.slow
@moderate
@given(any_labels())
def test_every_span_is_taken_or_named(labels: Labels) -> None:
    found = Incoming.of(labels, FRAMES)
    low_s, high_s = LabelledFrames(Labels(), FRAMES).whole
    assert all(low_s <= span.start_s < span.end_s <= high_s for span in found.labels.spans)
    ids = {span.id for span in found.labels.spans}
    assert ids.isdisjoint(span.id for span in found.outside)
    assert ids | {span.id for span in found.outside} == {span.id for span in labels.spans}
    kept = {span.id: span for span in labels.spans}
    cut = {span.id for span in found.cut}
    assert all(span == kept[span.id] for span in found.labels.spans if span.id not in cut)


@pytest.mark.slow
@moderate
@given(any_labels(), any_labels())
def test_adding_changes_nothing_that_is_there(here: Labels, brought: Labels) -> None:
    found = Incoming.of(brought, FRAMES)
    if not found.labels.spans:
        with pytest.raises(Sd2Error, match="file holds no spans"):
            found.take_into(here, "add", "file")
        return
    done = found.take_into(here, "add", "file")
    assert done.labels.tracks[: len(here.tracks)] == here.tracks
    assert set(here.spans) <= set(done.labels.spans)
    assert done.labels.label_set.labels[: len(here.label_set.labels)] == here.label_set.labels
    added = [span for span in done.labels.spans if span.id in done.ids]
    assert len(added) == len(found.labels.spans)
    assert len(done.labels.spans) == len(here.spans) + len(added)


def test_replacing_takes_the_file_as_it_is_and_keeps_the_set_it_does_not_have() -> None:
    own = LabelSet("Own", (Label("wave", "#112233", "w"),))
    here = replace(HERE, label_set=own)
    done = Incoming.of(file_of((1.0, 2.0, "wave")), FRAMES).take_into(here, "replace", "ben")
    assert done.name == "Import 1 span"
    assert done.labels.label_set == own
    assert [span.label for span in done.labels.spans] == ["wave"]
    theirs = file_of((1.0, 2.0, "push"), label_set=LabelSet("Theirs", (Label("push", "#445566"),)))
    assert Incoming.of(theirs, FRAMES).take_into(here, "replace", "ben").labels == theirs
    assert Incoming.of(theirs, FRAMES).take_into(theirs, "replace", "ben").labels is theirs


def test_added_tracks_have_names_of_their_own_and_labels_bring_their_colours() -> None:
    theirs = LabelSet("Theirs", (Label("push", "#445566", "1"), Label("unused", "#000000", "u")))
    brought = file_of((1.0, 2.0, "push"), label_set=theirs)
    done = Incoming.of(brought, FRAMES).take_into(HERE, "add", "ben")
    assert [track.name for track in done.labels.tracks] == ["Gestures", "Gestures (ben)"]
    assert [(span.id, span.track) for span in done.labels.spans] == [
        (7, "Gestures"),
        (8, "Gestures (ben)"),
    ]
    # Its key is taken by another label, its colour is not.
    assert done.labels.label_set.find("push") == Label("push", "#445566")
    assert done.labels.label_set.find("unused") is None
    again = Incoming.of(brought, FRAMES).take_into(done.labels, "add", "ben").labels
    assert again.tracks[-1].name == "Gestures (ben, 2)"


def test_an_empty_file_is_not_added() -> None:
    with pytest.raises(Sd2Error, match="ben holds no spans"):
        Incoming.of(Labels(), FRAMES).take_into(HERE, "add", "ben")


def test_names_stay_within_what_a_name_may_be() -> None:
    long = "x" * 200
    name = free_name(long, "y" * 300 + "\n", {long})
    assert LabelTrack(name).name != long


@pytest.mark.parametrize("name", [one.name for one in FORMATS])
def test_losses_are_known_beforehand(name: str, tmp_path) -> None:
    labels = replace(
        HERE,
        spans=(replace(HERE.spans[0], note="n", author="a", confidence=0.5),),
        label_set=GESTURES,
    )
    path = tmp_path / "labels"
    assert would_lose(labels, FRAMES, name) == write_labels(path, labels, FRAMES, name)
    assert len(read_labels(path, FRAMES, name).spans) == 1
