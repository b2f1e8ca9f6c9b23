"""Journal of label edits: each edit is on disk when it is made, apart from the user's file.

A session of editing has a file, which every edit replaces by one with all labels: a record in one
line, of eight hexadecimal digits of length in bytes, a space, eight of the CRC-32, a space, JSON in
UTF-8, and a newline. Earlier versions began with such a record, too, and added one of what it
changed for every edit, in parts of which the last two are there; those are read as far as their
records are whole.

The file is flushed to the disk (``fsync``) before it replaces the one before and
:meth:`Journal.write` returns, so neither the end of the process nor of the power loses an edit that
has returned, as far as the disk keeps what it says it has (on macOS, ``fsync`` does not empty the
drive's own cache). Decision 30 compares this with SQLite, and with records of changes.
"""

from __future__ import annotations

import time
import zlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from pydantic import FiniteFloat, NonNegativeInt
from pydantic_core import to_json

from sd2core.files.atomic import atomic_write
from sd2core.labels.entries import Entry, LabelsEntry, SpanEntry, labels_entry
from sd2core.labels.label_set import LabelSet
from sd2core.labels.spans import Labels, LabelTrack

FORMAT: Literal["sd2-labels-journal"] = "sd2-labels-journal"
VERSION = 2

_PREFIX_BYTES = 18


class Head(Entry):
    """Record of a part: the recording, and all its labels at that point.

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
    """Record of an edit, by an earlier version.

    Spans deleted (``gone``), new or changed (``put``), tracks, label set.
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


def packed(kept: Kept) -> bytes:
    """Encode the record of what a journal keeps."""
    content = {
        "format": FORMAT,
        "version": VERSION,
        "recording": str(kept.recording),
        "unsaved": kept.edits,
        "last": kept.last,
        "time_unix_s": kept.time_unix_s,
        "labels": labels_entry(kept.labels),
        "others": kept.others,
    }
    payload = to_json(content)
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


def replay(records: list[bytes]) -> Kept:
    """Return what the records of a file keep, with the edits of earlier versions done again.

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


class Journal:
    """Journal of one editing session; made by :meth:`.recovery.RecoveryPlace.begin`.

    ``folder`` holds its file; ``kept`` is what there is at the beginning of the session, and from
    then on. Raises OSError when the file cannot be written: editing may go on without a journal,
    but tell the user.
    """

    def __init__(self, folder: Path, session: int, kept: Kept) -> None:
        self._path = folder / f"{session:06d}-000001{SUFFIX}"
        self._keep(replace(kept, time_unix_s=time.time()))

    def write(self, name: str, labels: Labels, others: dict[str, Any] | None = None) -> None:
        """Record an edit, an undo or a redo; on disk on return.

        ``others`` are other fields of the recording, as JSON holds them, where they were edited.
        Raises OSError when it cannot be written; with the next one all labels are.
        """
        before = self.kept
        others = others or before.others
        edits = before.edits + 1
        self._keep(Kept(before.recording, labels, edits, name, time.time(), others))

    def saved(self) -> None:
        """Record that the user's file holds the current labels."""
        self._keep(replace(self.kept, edits=0, time_unix_s=time.time(), others=None))

    def close(self) -> None:
        """End the session and delete its file: all is saved, or the user discards it."""
        self._path.unlink(missing_ok=True)

    def _keep(self, kept: Kept) -> None:
        self.kept = kept
        with atomic_write(self._path, mode=0o600) as stream:
            stream.write(packed(kept))
