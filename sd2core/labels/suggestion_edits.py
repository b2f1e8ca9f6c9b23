"""Suggestions among the labels: offered, taken, turned down."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from sd2core.errors import Sd2Error
from sd2core.labels.edits import Edit
from sd2core.labels.free_time import Frames
from sd2core.labels.matching import iou_of
from sd2core.labels.span_fields import accept, reject, relabel
from sd2core.labels.spans import Labels, Span, Track
from sd2core.labels.suggest import LABEL, TRACK
from sd2core.timebase import Timebase

SAME_IOU = 0.5
"""From here on a suggestion is one that was turned down, or marked, before."""


def pending(labels: Labels) -> tuple[Span, ...]:
    """The suggestions that nobody has decided on, in order."""
    return tuple(span for span in labels.spans if span.origin == "suggestion")


def offer(
    labels: Labels, timebase: Timebase, found: Sequence[Span], declined: Sequence[Span] = ()
) -> Edit:
    """Put suggestions on a track of their own, in place of those of the last time.

    What was turned down does not come again, and what is marked already is not suggested.

    Parameters
    ----------
    found : sequence of Span
        Of a map; their edges are put on frames of the recording.
    declined : sequence of Span
    """
    kept = [one for one in labels.spans if one.origin != "suggestion" or one.track != TRACK]
    known = [*declined, *(one for one in kept if one.origin != "suggestion")]
    again = np.asarray((iou_of(found, known) >= SAME_IOU).any(axis=1))
    frames, first = Frames.of(timebase), labels.next_id
    made: list[Span] = []
    for span in (one for one, before in zip(found, again, strict=True) if not before):
        start_s, end_s = frames.stretch(span.start_s, span.end_s)
        made.append(replace(span, id=first + len(made), track=TRACK, start_s=start_s, end_s=end_s))
    tracks = labels.tracks
    if TRACK not in {track.name for track in tracks}:
        tracks = (*tracks, Track(TRACK, "free"))
    after = _tidied(replace(labels, tracks=tracks, spans=(*kept, *made)))
    name = f"Suggest {len(made)} span{'s' * (len(made) != 1)}"
    return Edit(name, labels if after == labels else after, tuple(span.id for span in made))


def take(
    labels: Labels,
    timebase: Timebase,
    ids: Iterable[int],
    track: str,
    label: str,
    *,
    keep_known: bool = False,
) -> Edit:
    """Make suggestions a person's own, on a track and with a label.

    Those for which the track has no room stay suggestions.

    Parameters
    ----------
    keep_known : bool
        Those keep their label that say what they are: of which more is known than that
        something moves, or whose label is one of the label set.

    Raises
    ------
    Sd2Error
        When one is no suggestion, or there is room for none.
    """
    after, done, refusal = labels, [], None
    for one in ids:
        span = labels.span(one)
        try:
            after = accept(after, timebase, [one], track).labels
        except Sd2Error as error:
            refusal = refusal or error
            continue
        done.append(one)
        known = span.label != LABEL or labels.label_set.find(span.label) is not None
        if not (keep_known and known):
            after = relabel(after, [one], label).labels
    if refusal is not None and not done:
        raise refusal
    name = "Accept suggestion" if len(done) == 1 else f"Accept {len(done)} suggestions"
    return Edit(name, _tidied(after), tuple(done))


def turn_down(labels: Labels, ids: Iterable[int]) -> Edit:
    """Take suggestions away."""
    gone = tuple(ids)
    name = "Reject suggestion" if len(gone) == 1 else f"Reject {len(gone)} suggestions"
    return Edit(name, _tidied(reject(labels, gone).labels))


def _tidied(labels: Labels) -> Labels:
    """Without a track of suggestions that has none left."""
    if labels.of_track(TRACK):
        return labels
    return replace(labels, tracks=tuple(one for one in labels.tracks if one.name != TRACK))
