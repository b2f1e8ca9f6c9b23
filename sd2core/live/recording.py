"""Recording that grows frame by frame, and is whole at any moment."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.appended import AppendedFile
from sd2core.files.atomic import atomic_write_text, full_disk_named
from sd2core.files.lock import FileLock
from sd2core.files.recording_json import FILE_NAME
from sd2core.files.texts import first_difference
from sd2core.io.radar.growing import (
    ENTRY,
    HEAD_NAME,
    INDEX_NAME,
    SAMPLES_NAME,
    GrowingHead,
    frame_count,
    is_growing,
    read_entries,
    read_head,
)
from sd2core.live.clocks import ARRIVALS_NAME, CLOCKS_NAME
from sd2core.live.sources import Frame
from sd2core.recording.recording import Recording, folder_named, open_recording

RADAR_FOLDER = "radar"
_LOCK_NAME = "listening.lock"
_MAX_COUNT = 2**32 - 1


_LOOK_S = 1.0


class GrowingRecording:
    """A recording that frames of a radar are appended to.

    Nothing is written before the first frame. A recording that is there is continued if it was
    written by listening to the same radar; its times go on by the wall clock, so that the pause is
    a gap.

    Parameters
    ----------
    folder : path
        ``NAME.sd2``; the suffix is appended where it is not there.
    keep_arrivals : bool
        True to keep when each frame arrived, by which clocks are compared
        (:mod:`sd2core.live.clocks`); then it cannot be continued.

    Raises
    ------
    Sd2Error
        When something else is there, or another process listens into it.
    """

    def __init__(self, folder: Path | str, *, keep_arrivals: bool = False) -> None:
        self.folder = folder_named(folder)
        self.radar = self.folder / RADAR_FOLDER
        self.frames = 0
        self._head: GrowingHead | None = None
        self._streams: tuple[AppendedFile, ...] | None = None
        self._keeps_arrivals = keep_arrivals
        self._looked_s = 0.0  # when it was last seen to be there, by the monotonic clock
        self.times_put_back = 0  # after it had been deleted
        self._session = 0
        self._begin_s: float | None = None  # of this session; None before its first frame
        self._last_s = -np.inf
        if not self.folder.parent.is_dir():
            raise Sd2Error(f"The folder {self.folder.parent} does not exist", "an existing folder")
        self._check_is_ours()
        self._lock: FileLock | None = None
        if is_growing(self.radar):
            if keep_arrivals or (self.folder / CLOCKS_NAME).exists():
                raise Sd2Error(
                    f"{self.folder} exists",
                    "a new folder: what was recorded with a camera is not continued",
                    "Give another folder as --out",
                )
            self._continue()

    @property
    def is_continued(self) -> bool:
        """True if it was begun before."""
        return self._session > 0

    @property
    def channel(self) -> tuple[int | None, int | None]:
        """Receiver and transmitter that the recording is shown with; None: all."""
        if not (self.folder / FILE_NAME).is_file():
            return None, None
        recording = open_recording(self.folder)
        return recording.radar_receiver, recording.radar_transmitter

    def check(self, head: GrowingHead) -> None:
        """Raise Sd2Error if frames of this head do not fit those that are there."""
        if self._head is None:
            return
        for name in ("radar", "word", "full_scale_known", "simulated", "replayed"):
            existing, given = getattr(self._head, name), getattr(head, name)
            if existing != given:
                what, before, now = first_difference(existing, given, name)
                message = f"{name} of {self.folder} is {before}"
                if name == "radar":
                    message = f"{self.folder} is of another radar or configuration: {what} {before}"
                raise Sd2Error(message, f"to continue it, {now}", "Give another folder as --out")

    def time_of(self, time_s: float, head: GrowingHead) -> float:
        """Time in the recording of a frame of this session, see :meth:`append`.

        The first call opens the files, and raises what keeps them from being written.
        """
        if self._streams is None:
            self._start(head)
        assert self._head is not None
        if self._begin_s is None:
            self._begin_s = 0.0
            if self.is_continued:
                pause_s = head.start_unix_s - self._head.start_unix_s
                self._begin_s = max(pause_s, self._last_s + head.radar.frame_repetition_s)
        return self._begin_s + time_s

    def append(
        self, words: NDArray[Any], head: GrowingHead, frame: Frame, dropped: int = 0
    ) -> None:
        """Append a frame; OSError, after which all before it is there, if it cannot be written.

        Parameters
        ----------
        words : array
            As :meth:`GrowingHead.as_stored` gives them.
        head : GrowingHead
            What the frame is of; ``start_unix_s`` is the wall-clock time of this session's time 0.
        frame : Frame
            At its time since the first frame of this session.
        dropped : int
            See :data:`~sd2core.io.radar.growing.ENTRY`.
        """
        at_s = self.time_of(frame.time_s, head)
        assert self._streams is not None
        if self.frames and not at_s > self._last_s:
            raise Sd2Error(
                f"A frame at {at_s:.6f} s follows one at {self._last_s:.6f} s",
                "times that increase",
            )
        counts = dropped, frame.lost, frame.missing_bytes, self._session
        entry = np.array([(at_s, *(min(one, _MAX_COUNT) for one in counts))], ENTRY)
        with full_disk_named(self.radar / SAMPLES_NAME):
            self._streams[0].write(np.ascontiguousarray(words).view(np.uint8).data.cast("B"))
            self._streams[1].write(entry.tobytes())
            for arrivals in self._streams[2:]:
                arrivals.write(np.float64(frame.received_s).tobytes())
        if not self.frames:
            self._make_recording()
        self.frames += 1  # last, as others open the recording once it has frames
        self._last_s = at_s
        if time.monotonic() > self._looked_s + _LOOK_S:
            self._look()

    def _look(self) -> None:
        """Put the recording back if somebody has deleted it."""
        assert self._streams is not None
        assert self._head is not None
        self._looked_s = time.monotonic()
        if (self.folder / FILE_NAME).is_file() and all(one.is_there for one in self._streams):
            return
        with full_disk_named(self.radar / SAMPLES_NAME):
            for one in self._streams:
                one.put_back()
            self._write_head(self._head)
        if not (self.folder / FILE_NAME).is_file():
            self._make_recording()
        self.times_put_back += 1

    def close(self, dropped: int = 0) -> None:
        """End this session; ``dropped`` frames came after its last one."""
        if self._streams is not None:
            self._look()
            for stream in self._streams:
                stream.close()
            self._streams = None
            if dropped and self._head is not None:
                total = self._head.dropped_at_ends + dropped
                self._write_head(self._head.model_copy(update={"dropped_at_ends": total}))
        if self._lock is not None:
            self._lock.release(delete=True)
            self._lock = None

    def _check_is_ours(self) -> None:
        if (self.folder / FILE_NAME).exists():
            if open_recording(self.folder).radar == self.radar and is_growing(self.radar):
                return
        elif not self.radar.exists() or is_growing(self.radar):
            return
        raise Sd2Error(
            f"{self.folder} exists, and no radar was recorded into it that could be continued",
            "a new folder, or a recording of a radar by this program",
            "Choose another folder (--out)",
        )

    def _continue(self) -> None:
        """Take up what a session before has left, without a frame that it left torn."""
        self._take_lock()
        try:
            self._head = read_head(self.radar)
            self.frames = frame_count(self.radar, self._head)
            sizes = (self.frames * self._head.frame_bytes, self.frames * ENTRY.itemsize)
            for name, size in zip((SAMPLES_NAME, INDEX_NAME), sizes, strict=True):
                if (self.radar / name).stat().st_size > size:
                    with (self.radar / name).open("r+b") as stream:
                        stream.truncate(size)
            if self.frames:
                last = read_entries(self.radar, self.frames)[-1]
                self._last_s, self._session = float(last["time_s"]), int(last["session"]) + 1
                if not (self.folder / FILE_NAME).exists():
                    self._make_recording()
        except BaseException:
            self.close()
            raise

    def _start(self, head: GrowingHead) -> None:
        """Open the files for the first frame of a session."""
        self.check(head)
        self.radar.mkdir(parents=True, exist_ok=True)
        if self._lock is None:
            self._take_lock()
        if self._head is None or not self.frames:
            self._write_head(head)
        names = [SAMPLES_NAME, INDEX_NAME, *([ARRIVALS_NAME] if self._keeps_arrivals else [])]
        self._streams = tuple(AppendedFile(self.radar / name) for name in names)

    def _write_head(self, head: GrowingHead) -> None:
        atomic_write_text(self.radar / HEAD_NAME, head.model_dump_json(indent=2) + "\n")
        self._head = head

    def _make_recording(self) -> None:
        assert self._head is not None
        Recording.create(self.folder, radar=self.radar, simulated=self._head.simulated)

    def _take_lock(self) -> None:
        lock = FileLock(self.radar / _LOCK_NAME)
        if not lock.take():
            raise Sd2Error(
                f"Another process listens into {self.folder}",
                "one that listens into a recording",
                "Stop that one, or give another folder as --out",
            )
        self._lock = lock


def wall_clock_s(monotonic_s: float) -> float:
    """Wall-clock time (unix) of a time of the monotonic clock."""
    return time.time() - (time.monotonic() - monotonic_s)
