"""Edits of everything but times: fields of spans, suggestions, tracks and the label set."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import count
from typing import Any, Literal

import numpy as np

from sd2core.errors import Sd2Error
from sd2core.labels.colours import OFFERED
from sd2core.labels.edits import Edit
from sd2core.labels.free_time import LabelledFrames
from sd2core.labels.label_set import Label, LabelSet
from sd2core.labels.matching import iou_of
from sd2core.labels.spans import Labels, LabelTrack, Overlap, Span
from sd2core.labels.suggest import LABEL, TRACK

SpanField = Literal["label", "note", "author", "confidence", "track", "person"]


def change_spans(labels: Labels, ids: Iterable[int], **field: Any) -> Edit:
    """Change a :data:`SpanField` of spans, at the times they have.

    An empty note or person removes it; a confidence is 0 to 1, or None for unknown. Raises Sd2Error
    when the value is none for that field, or spans would overlap on an exclusive track; the message
    names both.
    """
    if "track" in field:
        labels.track(field["track"])
    changed = [replace(span, **field) for span in labels.these(ids)]
    name = f"Change {next(iter(field))}"
    return Edit(name, labels.with_spans(changed), tuple(one.id for one in changed))


def rename_persons(labels: Labels, names: Mapping[str, str]) -> Edit:
    """Give the spans of persons their new names, by the old ones."""
    return _edit("Rename person", labels, replace(labels, spans=_renamed(labels, "person", names)))


def _name(verb: str, count: int) -> str:
    return f"{verb} suggestion" if count == 1 else f"{verb} {count} suggestions"


SAME_IOU = 0.5
"""Overlap (IoU) from which a suggestion is taken for a rejected or a labelled span."""


def pending(labels: Labels) -> tuple[Span, ...]:
    """Return the suggestions that are neither accepted nor rejected, in order."""
    return tuple(span for span in labels.spans if span.origin == "suggestion")


def offer(now: LabelledFrames, suggested: Sequence[Span], declined: Sequence[Span] = ()) -> Edit:
    """Put suggestions on a track of their own, in place of earlier ones, their edges on frames.

    Those that overlap a labelled span, or a rejected (``declined``) one, by :data:`SAME_IOU` are
    left out.
    """
    labels = now.labels
    kept = [one for one in labels.spans if one.origin != "suggestion" or one.track != TRACK]
    known = [*declined, *(one for one in kept if one.origin != "suggestion")]
    again = np.asarray((iou_of(suggested, known) >= SAME_IOU).any(axis=1))
    first = labels.next_id
    made: list[Span] = []
    for span in (one for one, before in zip(suggested, again, strict=True) if not before):
        start_s, end_s = now.stretch(span.start_s, span.end_s)
        made.append(replace(span, id=first + len(made), track=TRACK, start_s=start_s, end_s=end_s))
    tracks = labels.tracks
    if TRACK not in {track.name for track in tracks}:
        tracks = (*tracks, LabelTrack(TRACK, "free"))
    after = tidied(replace(labels, tracks=tracks, spans=(*kept, *made)))
    name = f"Suggest {len(made)} span{'s' * (len(made) != 1)}" if made else "Remove suggestions"
    return Edit(name, labels if after == labels else after, tuple(span.id for span in made))


def take(
    now: LabelledFrames, ids: Iterable[int], track: str, label: str, *, keep_known: bool = False
) -> Edit:
    """Accept suggestions as spans of the user, on a track and with a label.

    Parameters
    ----------
    now : LabelledFrames
    ids : iterable of int
        Suggestions. On another track than their own they are clipped like new spans to the longest
        free part, in this order; those for which there is none stay suggestions.
    track : str
        Added where it is not there.
    label : str
    keep_known : bool
        Keeps the label of suggestions that name a gesture or a label of the set.

    Raises
    ------
    Sd2Error
        When none can be accepted: no id is a suggestion that has free time.
    """
    labels, done, refusal = now.labels, [], None
    if track not in {one.name for one in labels.tracks}:
        now = replace(now, labels=replace(labels, tracks=(LabelTrack(track), *labels.tracks)))
    for span in [labels.span(one) for one in dict.fromkeys(ids)]:
        start_s, end_s = span.start_s, span.end_s
        try:
            _check_suggestion(span)
            if track != span.track:
                start_s, end_s = now.clip_to_free(track, (start_s, end_s))
        except Sd2Error as error:
            refusal = refusal or error
            continue
        known = span.label != LABEL or labels.label_set.find(span.label) is not None
        given = span.label if keep_known and known else label
        taken = replace(
            span, track=track, start_s=start_s, end_s=end_s, label=given, origin="person"
        )
        now = replace(now, labels=now.labels.with_spans([taken]))
        done.append(span.id)
    if refusal is not None and not done:
        raise refusal
    return Edit(_name("Accept", len(done)), tidied(now.labels), tuple(done))


def reject(labels: Labels, ids: Iterable[int]) -> Edit:
    """Delete suggestions, and nothing else by mistake."""
    gone = labels.these(ids)
    for span in gone:
        _check_suggestion(span)
    return Edit(_name("Reject", len(gone)), delete(labels, ids).labels)


def delete(labels: Labels, ids: Iterable[int]) -> Edit:
    """Delete spans; the track of suggestions goes with the last of them."""
    gone = {span.id for span in labels.these(ids)}
    name = "Delete span" if len(gone) == 1 else f"Delete {len(gone)} spans"
    return Edit(name, tidied(labels.with_spans(without=gone)))


def _check_suggestion(span: Span) -> None:
    if span.origin != "suggestion":
        raise Sd2Error(f"{span.words()} is of origin {span.origin!r}", "a suggestion")


def tidied(labels: Labels) -> Labels:
    """Remove the track of suggestions where it is empty."""
    if labels.of_track(TRACK):
        return labels
    return replace(labels, tracks=tuple(one for one in labels.tracks if one.name != TRACK))


def add_track(labels: Labels, name: str, overlap: Overlap = "exclusive") -> Edit:
    """Add a track, below the others."""
    tracks = (*labels.tracks, LabelTrack(name, overlap))
    return _edit("Add track", labels, replace(labels, tracks=tracks))


def change_track(labels: Labels, old: str, **field: Any) -> Edit:
    """Change the ``name`` of a track, which its spans follow, or its ``overlap``.

    Raises Sd2Error when spans overlap on a track that forbids it; the message names two of them.
    """
    changed = replace(labels.track(old), **field)
    tracks = tuple(changed if one.name == old else one for one in labels.tracks)
    spans = _renamed(labels, "track", {old: changed.name})
    step = "Rename track" if "name" in field else "Change overlaps of track"
    return _edit(step, labels, replace(labels, tracks=tracks, spans=spans))


def remove_track(labels: Labels, name: str) -> Edit:
    """Remove a track with the spans on it; the name of the step says how many."""
    gone = labels.track(name)
    spans = tuple(span for span in labels.spans if span.track != name)
    count = len(labels.spans) - len(spans)
    text = f"Remove track with {count} span{'s' * (count != 1)}" if count else "Remove track"
    tracks = tuple(track for track in labels.tracks if track != gone)
    return _edit(text, labels, replace(labels, tracks=tracks, spans=spans))


def move_track(labels: Labels, name: str, place: int) -> Edit:
    """Move a track to a place among the others; 0 is the top."""
    moved = labels.track(name)
    tracks = [track for track in labels.tracks if track != moved]
    tracks.insert(place, moved)
    return _edit("Move track", labels, replace(labels, tracks=tuple(tracks)))


def _edit(name: str, before: Labels, after: Labels) -> Edit:
    return Edit(name, before if after == before else after)


CLASSES = ("horizontal", "vertical", "background")
"""Classes that the default classifier tells apart."""


def set_label_set(labels: Labels, label_set: LabelSet) -> Edit:
    """Use another label set; spans keep their labels, also those it does not have."""
    return _edit("Change label set", labels, replace(labels, label_set=label_set))


def new_label(label_set: LabelSet) -> Label:
    """Make a label with a name, a colour and a digit that the set does not use yet."""
    names = {one.name for one in label_set.labels}
    keys = {one.key for one in label_set.labels}
    colours = [one.colour for one in label_set.labels]
    return Label(
        next(name for number in count(1) if (name := f"label {number}") not in names),
        min((colour for _, colour in OFFERED), key=colours.count),
        next((digit for digit in "123456789" if digit not in keys), ""),
    )


def add_label(labels: Labels, label: Label) -> Edit:
    """Add a label, after the others."""
    return _edit("Add label", labels, _with_set(labels, [*labels.label_set.labels, label]))


def change_label(labels: Labels, old: str, **field: str) -> Edit:
    """Change the ``name``, ``colour`` (``#rrggbb``), ``key`` or ``gesture_class`` of a label.

    Its spans follow a new name; an empty key or class removes it.
    """
    known = _known(labels, old)
    changed = replace(known, **field)
    offered = [changed if one == known else one for one in labels.label_set.labels]
    spans = _renamed(labels, "label", {old: changed.name})
    after = replace(_with_set(labels, offered), spans=spans)
    return _edit(_STEPS[next(iter(field))], labels, after)


_STEPS = {
    "name": "Rename label",
    "colour": "Change colour of label",
    "key": "Change key of label",
    "gesture_class": "Change class of label",
}


def move_label(labels: Labels, name: str, place: int) -> Edit:
    """Move a label to a place in the set; 0 is the first."""
    moved = _known(labels, name)
    offered = [one for one in labels.label_set.labels if one != moved]
    offered.insert(place, moved)
    return _edit("Move label", labels, _with_set(labels, offered))


def remove_label(labels: Labels, name: str, instead: str | None = None) -> Edit:
    """Remove a label from the set; its spans keep it, or get another label of the set instead.

    The name of the step says which.
    """
    gone = _known(labels, name)
    offered = [one for one in labels.label_set.labels if one != gone]
    spans, text = labels.spans, "Remove label"
    having = sum(span.label == name for span in spans)
    if having:
        whose = "1 span" if having == 1 else f"{having} spans"
        text += f", {whose} keep{'s' * (having == 1)} it"
    if having and instead is not None:
        if instead == name:
            raise Sd2Error(f"Spans of {name!r} were to get that label itself", "another label")
        _known(labels, instead)
        spans = _renamed(labels, "label", {name: instead})
        text = f"Remove label, {whose} become {instead}"
    return _edit(text, labels, replace(_with_set(labels, offered), spans=spans))


def _renamed(labels: Labels, field: str, names: Mapping[str, str]) -> tuple[Span, ...]:
    """All spans, those with a field of an old name with the new one."""
    if all(old == new for old, new in names.items()):
        return labels.spans
    spans: list[Span] = []
    for span in labels.spans:
        old = getattr(span, field)
        now: dict[str, Any] = {field: names.get(old, old)}
        spans.append(span if now[field] == old else replace(span, **now))
    return tuple(spans)


def _known(labels: Labels, name: str) -> Label:
    label = labels.label_set.find(name)
    if label is None:
        raise Sd2Error(
            f"The set {labels.label_set.name!r} has no label {name!r}",
            f"one of {', '.join(one.name for one in labels.label_set.labels)}",
        )
    return label


def _with_set(labels: Labels, offered: list[Label]) -> Labels:
    return replace(labels, label_set=replace(labels.label_set, labels=tuple(offered)))
