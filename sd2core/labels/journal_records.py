r"""Records of a journal: each says its own length and checksum, and what an edit changed.

A record is one line: eight hexadecimal digits of length in bytes, a space, eight of the CRC-32,
a space, JSON in UTF-8, and ``\n``. A file that ends in the middle of a record, or goes on
with something else, is read up to the last whole one.
"""

from __future__ import annotations

import json
import zlib
from dataclasses import dataclass
from typing import Any, Literal

from pydantic import FiniteFloat, NonNegativeInt

from sd2core.labels.comparison import same_ends
from sd2core.labels.entries import (
    Entry,
    LabelsEntry,
    LabelSetEntry,
    SpanEntry,
    TrackEntry,
    label_set_entry,
    labels_entry,
    span_entry,
    track_entries,
)
from sd2core.labels.spans import Labels

FORMAT: Literal["sd2-labels-journal"] = "sd2-labels-journal"
VERSION = 1

_PREFIX_BYTES = 18


class Head(Entry):
    """The first record: whose labels these are, and all of them as they were.

    Parameters
    ----------
    recording : str
        Absolute path.
    unsaved : int
        Edits up to here that the user's file does not hold.
    time_unix_s : float
        When the last of them was made.
    """

    format: Literal["sd2-labels-journal"]
    version: Literal[1]
    recording: str
    unsaved: NonNegativeInt
    last: str
    time_unix_s: FiniteFloat
    labels: LabelsEntry


class Change(Entry):
    """What one edit changed: spans that went, and came or became others; tracks, label set.

    An edit without any of it says that the user's file holds what is here (``saved``).
    """

    name: str
    time_unix_s: FiniteFloat
    saved: bool = False
    gone: tuple[int, ...] = ()
    put: tuple[SpanEntry, ...] = ()
    tracks: tuple[TrackEntry, ...] | None = None
    label_set: LabelSetEntry | None = None


@dataclass(frozen=True)
class Replayed:
    """What the records of a file lead to.

    Parameters
    ----------
    recording : str
    labels : Labels
    unsaved : int
        Edits that the user's file does not hold.
    last : str
        Name of the last of them.
    time_unix_s : float
        When it was made.
    """

    recording: str
    labels: Labels
    unsaved: int
    last: str
    time_unix_s: float


def packed(content: dict[str, Any]) -> bytes:
    """One record."""
    payload = json.dumps(content, ensure_ascii=False, separators=(",", ":")).encode()
    return b"%08x %08x %b\n" % (len(payload), zlib.crc32(payload), payload)


def unpacked(content: bytes) -> tuple[list[bytes], int]:
    """The JSON of all whole records from the start on, and where they end."""
    records: list[bytes] = []
    at = 0
    while True:
        prefix = content[at : at + _PREFIX_BYTES]
        try:
            length = int(prefix[:8], 16)
        except ValueError:
            return records, at
        start, end = at + _PREFIX_BYTES, at + _PREFIX_BYTES + length
        payload = content[start:end]
        if (
            prefix != b"%08x %08x " % (length, zlib.crc32(payload))
            or content[end : end + 1] != b"\n"
        ):
            return records, at
        records.append(payload)
        at = end + 1


def head(
    recording: str, labels: Labels, unsaved: int, last: str, time_unix_s: float
) -> dict[str, Any]:
    """Content of the first record."""
    return {
        "format": FORMAT,
        "version": VERSION,
        "recording": recording,
        "unsaved": unsaved,
        "last": last,
        "time_unix_s": time_unix_s,
        "labels": labels_entry(labels),
    }


def change(name: str, time_unix_s: float, before: Labels, after: Labels) -> dict[str, Any]:
    """Content of the record of an edit."""
    content: dict[str, Any] = {"name": name, "time_unix_s": time_unix_s}
    if before.spans is not after.spans:
        # Spans that an edit did not touch are the very same; those that equal others do no harm.
        first, stop = same_ends(before.spans, after.spans)
        old = {span.id: span for span in before.spans[first : len(before.spans) - stop]}
        new = after.spans[first : len(after.spans) - stop]
        put = [span_entry(span) for span in new if old.pop(span.id, None) is not span]
        if old:
            content["gone"] = list(old)
        if put:
            content["put"] = put
    if before.tracks != after.tracks:
        content["tracks"] = track_entries(after.tracks)
    if before.label_set != after.label_set:
        content["label_set"] = label_set_entry(after.label_set)
    return content


def replay(records: list[bytes]) -> Replayed:
    """Do the edits again.

    Raises
    ------
    ValueError
        When a record holds something else than this version writes (pydantic's error).
    Sd2Error
        When what comes of it cannot be.
    """
    first = Head.model_validate_json(records[0])
    spans = {span.id: span for span in first.labels.spans}
    tracks, label_set = first.labels.tracks, first.labels.label_set
    unsaved, last, time_unix_s = first.unsaved, first.last, first.time_unix_s
    for record in records[1:]:
        edit = Change.model_validate_json(record)
        for span_id in edit.gone:
            spans.pop(span_id, None)
        spans.update((span.id, span) for span in edit.put)
        tracks = tracks if edit.tracks is None else edit.tracks
        label_set = label_set if edit.label_set is None else edit.label_set
        unsaved = 0 if edit.saved else unsaved + 1
        last, time_unix_s = edit.name, edit.time_unix_s
    # Only the end is checked: what is between was whole when it was written.
    entry = LabelsEntry(label_set=label_set, tracks=tracks, spans=tuple(spans.values()))
    return Replayed(first.recording, entry.made(), unsaved, last, time_unix_s)
