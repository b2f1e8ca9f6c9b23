"""Every edit on disk when it is made, apart from the user's file.

A session of editing writes parts: files of records (:mod:`.journal_records`) that begin with
all labels, followed by what each edit changed. When the edits of a part have grown longer
than its labels, the next part begins, and the one before the last is deleted: what is read
back is in the newest part, and in the one before it should the newest be damaged.

A record is written in one go and flushed to the disk (``fsync``) before :meth:`Journal.write`
returns. So neither the end of the process nor of the power loses an edit that has returned,
as far as the disk keeps what it says it has (on macOS, ``fsync`` does not empty the drive's
own cache). It costs some milliseconds per edit; a drag is one edit.
"""

from __future__ import annotations

import os
import time
from pathlib import Path

from sd2core.files.atomic import atomic_write
from sd2core.labels.journal_records import change, head, packed
from sd2core.labels.spans import Labels

SUFFIX = ".journal"
KEPT_PARTS = 2
SHORTEST_BYTES = 1 << 18
"""Edits of a part may be as long as this, or as its labels, before the next part begins."""


class Journal:
    """The edits of one session; made by :meth:`.recovery.RecoveryPlace.begin`.

    Parameters
    ----------
    folder : Path
        There it writes ``SESSION-PART.journal``.
    session : int
    recording : Path
    labels : Labels
        As they are when the session begins.
    unsaved : int
        How many edits the user's file does not hold by then.
    last : str
        Name of the last of them.

    Raises
    ------
    OSError
        When the first part cannot be written. No journal is no reason not to edit: say it.
    """

    def __init__(
        self,
        folder: Path,
        session: int,
        recording: Path,
        labels: Labels,
        *,
        unsaved: int = 0,
        last: str = "",
    ) -> None:
        self._folder, self._session, self._recording = folder, session, recording
        self._labels, self._unsaved, self._last = labels, unsaved, last
        self._parts: list[Path] = []
        self._part = 0
        self._stream: int | None = None
        self._left_bytes = 0
        self._begin_part()

    @property
    def unsaved(self) -> int:
        """Edits since the user's file was last saved."""
        return self._unsaved

    def write(self, name: str, labels: Labels) -> None:
        """Note what an edit, a step back or a step forward has led to; on disk on return.

        Raises
        ------
        OSError
            When it cannot be written. The next one is tried in a new part, with all labels.
        """
        now_s = time.time()
        record = packed(change(name, now_s, self._labels, labels))
        self._labels, self._last = labels, name
        self._unsaved += 1
        self._append(record)

    def saved(self) -> None:
        """Note that the user's file holds what is here."""
        self._unsaved = 0
        self._append(packed({"name": self._last, "time_unix_s": time.time(), "saved": True}))

    def close(self) -> None:
        """End the session and delete its parts: all is saved, or the user wants none of it."""
        self._close_stream()
        for path in self._parts:
            path.unlink(missing_ok=True)
        self._parts = []

    def _append(self, record: bytes) -> None:
        stream = self._stream
        # Where somebody has deleted the file, what is appended would be nowhere.
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
        record = packed(
            head(str(self._recording), self._labels, self._unsaved, self._last, time.time())
        )
        with atomic_write(path) as stream:
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
