"""Edits of what is said of spans; their times stay as they are."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from sd2core.errors import Sd2Error
from sd2core.labels.edits import Edit
from sd2core.labels.free_time import Frames, clipped
from sd2core.labels.spans import Labels, Span
from sd2core.timebase import Timebase


def relabel(labels: Labels, ids: Iterable[int], label: str) -> Edit:
    """Give spans another label."""
    return _with(labels, ids, "Change label", label=label)


def set_note(labels: Labels, ids: Iterable[int], note: str) -> Edit:
    """Write a note to spans, or take it away with an empty one."""
    return _with(labels, ids, "Change note", note=note)


def set_author(labels: Labels, ids: Iterable[int], author: str) -> Edit:
    """Say who marked spans."""
    return _with(labels, ids, "Change author", author=author)


def set_confidence(labels: Labels, ids: Iterable[int], confidence: float | None) -> Edit:
    """Say how sure one is of spans, 0 to 1; None: nobody said."""
    return _with(labels, ids, "Change confidence", confidence=confidence)


def set_track(labels: Labels, ids: Iterable[int], track: str) -> Edit:
    """Put spans on another track, at the times they have.

    Raises
    ------
    Sd2Error
        When they would overlap there and may not; the message names both spans.
    """
    labels.track(track)
    return _with(labels, ids, "Change track", track=track)


def accept(
    labels: Labels,
    timebase: Timebase,
    ids: Iterable[int],
    track: str | None = None,
    *,
    author: str = "",
) -> Edit:
    """Make suggestions a person's own, on another track if one is named.

    There they are clipped like new spans to the longest part that is free, one after the
    other in the order of time.

    Raises
    ------
    Sd2Error
        When one is no suggestion, or no frame of it is free; none is accepted then.
    """
    frames = Frames.of(timebase)
    after = labels
    chosen = _suggestions(labels, ids)
    for span in chosen:
        place: dict[str, Any] = {}
        if track is not None and track != span.track:
            part = clipped(after, track, (span.start_s, span.end_s), frames)
            place = {"track": track, "start_s": part[0], "end_s": part[1]}
        taken = replace(span, origin="person", author=author or span.author, **place)
        after = after.with_spans([taken])
    return Edit(_name("Accept suggestion", len(chosen)), after, tuple(one.id for one in chosen))


def reject(labels: Labels, ids: Iterable[int]) -> Edit:
    """Delete suggestions, and nothing else by mistake."""
    gone = {span.id for span in _suggestions(labels, ids)}
    return Edit(_name("Reject suggestion", len(gone)), labels.with_spans(without=gone))


def _with(labels: Labels, ids: Iterable[int], name: str, **fields: Any) -> Edit:
    changed = [replace(span, **fields) for span in labels.these(ids)]
    return Edit(name, labels.with_spans(changed), tuple(span.id for span in changed))


def _suggestions(labels: Labels, ids: Iterable[int]) -> list[Span]:
    chosen = labels.these(ids)
    for span in chosen:
        if span.origin != "suggestion":
            raise Sd2Error(f"{span.words()} is of origin {span.origin!r}", "a suggestion")
    return chosen


def _name(text: str, count: int) -> str:
    return text if count == 1 else f"{text}s"
