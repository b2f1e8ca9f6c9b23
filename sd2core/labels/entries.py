"""JSON entries of labels, for files and the journal, checked when they are read."""

from __future__ import annotations

from dataclasses import asdict, fields
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict

from sd2core.labels.label_set import LabelSet
from sd2core.labels.spans import Labels, LabelTrack, ShownFrames, Span
from sd2core.timebase import Timebase


class Entry(BaseModel):
    """Base of the entries; unknown keys are refused, because an edit would lose them."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


def _without_frames(entry: Any) -> Any:
    if not isinstance(entry, dict):
        return entry
    return {name: value for name, value in entry.items() if name != "frames"}


SpanEntry = Annotated[Span, BeforeValidator(_without_frames)]
"""Entry of a span; its ``frames`` are informative, the times count."""


class LabelsEntry(Entry):
    """Entry of a whole :class:`Labels`."""

    label_set: LabelSet
    tracks: tuple[LabelTrack, ...]
    spans: tuple[SpanEntry, ...]

    def made(self) -> Labels:
        """Make the labels."""
        return Labels(self.tracks, self.spans, self.label_set)


_DEFAULTS = {field.name: field.default for field in fields(Span)}


def span_entry(span: Span, frames: ShownFrames | None = None) -> dict[str, Any]:
    """Encode a span; fields at their defaults are left out."""
    entry: dict[str, Any] = {}
    for name, default in _DEFAULTS.items():
        value = getattr(span, name)
        if value != default:
            entry[name] = value
        if name == "end_s" and frames is not None:
            entry["frames"] = asdict(frames)
    return entry


def track_entries(tracks: tuple[LabelTrack, ...]) -> list[dict[str, Any]]:
    """Encode tracks."""
    return [asdict(track) for track in tracks]


def label_set_entry(label_set: LabelSet) -> dict[str, Any]:
    """Encode a label set."""
    return {"name": label_set.name, "labels": [asdict(label) for label in label_set.labels]}


def labels_entry(labels: Labels, timebase: Timebase | None = None) -> dict[str, Any]:
    """Encode all labels of a recording; with the frames of every span, given the timebase."""
    return {
        "label_set": label_set_entry(labels.label_set),
        "tracks": track_entries(labels.tracks),
        "spans": [span_entry(span, span.frames(timebase)) for span in labels.spans],
    }
