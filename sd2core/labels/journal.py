"""Journal of label edits: each edit is on disk when it is made, apart from the user's file.

A session of editing writes parts. A part begins with all labels, and every edit adds a record
of what it changed. When the edits of a part have grown longer than its labels, the next part
begins and the one before the last is deleted: the labels are read back from the newest part, and
from the one before it should the newest be damaged.

A record is one line: eight hexadecimal digits of length in bytes, a space, eight of the CRC-32,
a space, JSON in UTF-8, and a newline. A file that ends in the middle of a record, or goes on
with something else, is read up to the last whole record.

A record is written in one go and flushed to the disk (``fsync``) before :meth:`Journal.write`
returns, so neither the end of the process nor of the power loses an edit that has returned, as
far as the disk keeps what it says it has (on macOS, ``fsync`` does not empty the drive's own
cache). Decision 43 compares this with SQLite.
"""

from __future__ import annotations

import os
import time
import zlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from pydantic import FiniteFloat, NonNegativeInt

from sd2core.files.atomic import atomic_write, to_json
from sd2core.labels.comparison import same_ends
from sd2core.labels.entries import (
    Entry,
    LabelsEntry,
    SpanEntry,
    label_set_entry,
    labels_entry,
    span_entry,
    track_entries,
)
from sd2core.labels.label_set import LabelSet
from sd2core.labels.spans import Labels, LabelTrack

FORMAT: Literal["sd2-labels-journal"] = "sd2-labels-journal"
VERSION = 2

_PREFIX_BYTES = 18


class Head(Entry):
    """First record of a part: the recording, and all its labels at that point.

    ``unsaved`` counts the edits up to here that the user's file does not hold; ``time_unix_s`` is
    when the last of them was made. ``others`` are other fields of the recording, where they were
    edited since the file was saved (version 2).
    """

    format: Literal["sd2-labels-journal"]
    version: Literal[1, 2]
    recording: str
    unsaved: NonNegativeInt
    last: str
    time_unix_s: FiniteFloat
    labels: LabelsEntry
    others: dict[str, Any] | None = None


class Change(Entry):
    """Record of one edit: spans deleted (``gone``), new or changed (``put``), tracks, label set.

    ``others`` are other fields of the recording, all of them where one was edited.
    A record without any of them says that the user's file was written (``saved``).
    """

    name: str
    time_unix_s: FiniteFloat
    saved: bool = False
    gone: tuple[int, ...] = ()
    put: tuple[SpanEntry, ...] = ()
    tracks: tuple[LabelTrack, ...] | None = None
    label_set: LabelSet | None = None
    others: dict[str, Any] | None = None


@dataclass(frozen=True)
class Kept:
    """Labels that a journal keeps, with ``edits`` that the user's file does not hold."""

    recording: Path  # Absolute path of the labelled recording or video.
    labels: Labels  # After the last whole edit.
    edits: int = 0  # Number of unsaved edits.
    last: str = ""  # Name of the last edit, such as "Move span".
    time_unix_s: float = 0.0  # Time of the last edit.
    others: dict[str, Any] | None = None  # Other fields of the recording, where they were edited.


def packed(content: dict[str, Any]) -> bytes:
    """Encode one record."""
    payload = to_json(content, separators=(",", ":")).encode()
    return b"%08x %08x %b\n" % (len(payload), zlib.crc32(payload), payload)


def unpacked(content: bytes) -> tuple[list[bytes], int]:
    """Return the JSON of all whole records from the start on, and the byte at which they end."""
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
            length < 0
            or prefix != b"%08x %08x " % (length, zlib.crc32(payload))
            or content[end : end + 1] != b"\n"
        ):
            return records, at
        records.append(payload)
        at = end + 1


def head(kept: Kept) -> dict[str, Any]:
    """Return the content of the first record."""
    return {
        "format": FORMAT,
        "version": VERSION,
        "recording": str(kept.recording),
        "unsaved": kept.edits,
        "last": kept.last,
        "time_unix_s": kept.time_unix_s,
        "labels": labels_entry(kept.labels),
        "others": kept.others,
    }


def change(before: Labels, after: Labels) -> dict[str, Any]:
    """Return what of the labels an edit has changed, for its record."""
    content: dict[str, Any] = {}
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


def replay(records: list[bytes]) -> Kept:
    """Replay the edits of a part.

    Raises ValueError (pydantic's) when a record holds something else than this version writes;
    Sd2Error when the resulting labels are not valid.
    """
    first = Head.model_validate_json(records[0])
    spans = {span.id: span for span in first.labels.spans}
    tracks, label_set = first.labels.tracks, first.labels.label_set
    unsaved, last, time_unix_s = first.unsaved, first.last, first.time_unix_s
    others = first.others
    for record in records[1:]:
        edit = Change.model_validate_json(record)
        for span_id in edit.gone:
            spans.pop(span_id, None)
        spans.update((span.id, span) for span in edit.put)
        tracks = tracks if edit.tracks is None else edit.tracks
        label_set = label_set if edit.label_set is None else edit.label_set
        others = None if edit.saved else edit.others or others
        unsaved = 0 if edit.saved else unsaved + 1
        last, time_unix_s = edit.name, edit.time_unix_s
    # Only the end is checked: what is between was whole when it was written.
    labels = Labels(tracks, tuple(spans.values()), label_set)
    return Kept(Path(first.recording), labels, unsaved, last, time_unix_s, others)


SUFFIX = ".journal"
KEPT_PARTS = 2
SHORTEST_BYTES = 1 << 18
"""Edits of a part may be as long as this, or as its labels, before the next part begins."""


class Journal:
    """Journal of one editing session; made by :meth:`.recovery.RecoveryPlace.begin`.

    ``folder`` holds the parts, ``SESSION-PART.journal``; ``kept`` is what there is at the beginning
    of the session, and from then on. Raises OSError when the first part cannot be written: editing
    may go on without a journal, but tell the user.
    """

    def __init__(self, folder: Path, session: int, kept: Kept) -> None:
        self._folder, self._session = folder, session
        self.kept = replace(kept, time_unix_s=time.time())
        self._parts: list[Path] = []
        self._part = 0
        self._stream: int | None = None
        self._left_bytes = 0
        self._begin_part()

    def write(self, name: str, labels: Labels, others: dict[str, Any] | None = None) -> None:
        """Record an edit, an undo or a redo; on disk on return.

        ``others`` are other fields of the recording, as JSON holds them, where they were edited.
        Raises OSError when it cannot be written. The next one is tried in a new part, with all
        labels.
        """
        before, now_s = self.kept, time.time()
        content = {"name": name, "time_unix_s": now_s} | change(before.labels, labels)
        if others is not None:
            content["others"] = others
        self.kept = Kept(
            before.recording, labels, before.edits + 1, name, now_s, others or before.others
        )
        self._append(packed(content))

    def saved(self) -> None:
        """Record that the user's file holds the current labels."""
        now_s = time.time()
        self.kept = replace(self.kept, edits=0, time_unix_s=now_s, others=None)
        self._append(packed({"name": self.kept.last, "time_unix_s": now_s, "saved": True}))

    def close(self) -> None:
        """End the session and delete its parts: all is saved, or the user discards it."""
        self._close_stream()
        for path in self._parts:
            path.unlink(missing_ok=True)
        self._parts = []

    def _append(self, record: bytes) -> None:
        stream = self._stream
        # Appending to a deleted file would keep nothing.
        if stream is None or self._left_bytes < len(record) or os.fstat(stream).st_nlink == 0:
            self._begin_part()
            return
        try:
            rest = memoryview(record)
            while rest:
                rest = rest[os.write(stream, rest) :]
            os.fsync(stream)
        except OSError:
            # Half a record may be there: nothing after it would be read.
            self._close_stream()
            raise
        self._left_bytes -= len(record)

    def _begin_part(self) -> None:
        self._close_stream()
        self._part += 1
        path = self._folder / f"{self._session:06d}-{self._part:06d}{SUFFIX}"
        record = packed(head(self.kept))
        with atomic_write(path, mode=0o600) as stream:
            stream.write(record)
        self._parts.append(path)
        self._stream = os.open(path, os.O_WRONLY | os.O_APPEND | getattr(os, "O_BINARY", 0))
        self._left_bytes = max(SHORTEST_BYTES, len(record))
        for old in self._parts[:-KEPT_PARTS]:
            old.unlink(missing_ok=True)
        self._parts = self._parts[-KEPT_PARTS:]

    def _close_stream(self) -> None:
        if self._stream is not None:
            os.close(self._stream)
            self._stream = None
