"""Edits of the tracks."""

from __future__ import annotations

from dataclasses import replace

from sd2core.labels.edits import Edit
from sd2core.labels.spans import Labels, Overlap, Track


def add_track(
    labels: Labels, name: str, overlap: Overlap = "exclusive", place: int | None = None
) -> Edit:
    """Add a track, below the others or at a place among them (0: at the top)."""
    tracks = list(labels.tracks)
    tracks.insert(len(tracks) if place is None else place, Track(name, overlap))
    return _edit("Add track", labels, replace(labels, tracks=tuple(tracks)))


def rename_track(labels: Labels, old: str, new: str) -> Edit:
    """Give a track another name; its spans stay on it."""
    tracks = _instead(labels, old, replace(labels.track(old), name=new))
    spans = tuple(replace(span, track=new) if span.track == old else span for span in labels.spans)
    return _edit("Rename track", labels, replace(labels, tracks=tracks, spans=spans))


def remove_track(labels: Labels, name: str) -> Edit:
    """Remove a track with the spans on it; the name of the step says how many."""
    gone = labels.track(name)
    spans = tuple(span for span in labels.spans if span.track != name)
    count = len(labels.spans) - len(spans)
    text = f"Remove track with {count} span{'s' * (count != 1)}" if count else "Remove track"
    tracks = tuple(track for track in labels.tracks if track != gone)
    return _edit(text, labels, replace(labels, tracks=tracks, spans=spans))


def move_track(labels: Labels, name: str, place: int) -> Edit:
    """Put a track at a place among the others; 0 is the top."""
    moved = labels.track(name)
    tracks = [track for track in labels.tracks if track != moved]
    tracks.insert(place, moved)
    return _edit("Move track", labels, replace(labels, tracks=tuple(tracks)))


def set_overlap(labels: Labels, name: str, overlap: Overlap) -> Edit:
    """Say whether the spans of a track may overlap.

    Raises
    ------
    Sd2Error
        When some do that may not; the message names two of them.
    """
    tracks = _instead(labels, name, replace(labels.track(name), overlap=overlap))
    return _edit("Change overlaps of track", labels, replace(labels, tracks=tracks))


def _edit(name: str, before: Labels, after: Labels) -> Edit:
    return Edit(name, before if after == before else after)


def _instead(labels: Labels, name: str, track: Track) -> tuple[Track, ...]:
    return tuple(track if one.name == name else one for one in labels.tracks)
