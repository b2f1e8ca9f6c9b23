"""Frame-exact reading of video files, also of variable frame rate and with B-frames."""

from __future__ import annotations

import math
import threading
from collections import OrderedDict
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from av.error import FFmpegError
from av.video.reformatter import VideoReformatter
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.paths import as_path
from sd2core.io.video_index import FrameIndex, build_index, decoded_frames, open_stream
from sd2core.progress import Progress, silent
from sd2core.timebase import Timebase

_CACHE_BYTES = 96 * 2**20
_SEEK_COST_FRAMES = 4
"""A seek costs about as much as decoding this many frames more."""
_MATRIX_NUMBERS = 9
_SLANTED = 0.01
"""Share of an axis that may lie along another one before a turn is no quarter turn."""


@dataclass(frozen=True)
class Upright:
    """Quarter turns and mirroring of stored pictures: along which axes they are shown.

    Parameters
    ----------
    swaps : bool
        Rows become columns, before the picture is reversed.
    down, right : int
        -1 where the shown picture is reversed from top to bottom, or from left to right.
    """

    swaps: bool = False
    down: int = 1
    right: int = 1
    notes: tuple[str, ...] = ()

    @classmethod
    def of(cls, frame: Any) -> Upright:
        """Read the display matrix of a frame of PyAV; as stored without one.

        A stored place (x, y) is shown at (a x + c y, b x + d y), with a, b and c, d in the first
        two rows of the matrix.
        """
        matrix = frame.side_data.get("DISPLAYMATRIX")
        numbers = np.frombuffer(b"" if matrix is None else bytes(matrix), np.int32)
        if numbers.size < _MATRIX_NUMBERS:
            return cls()
        (a, b), (c, d) = numbers[:_MATRIX_NUMBERS].reshape(3, 3)[:2, :2].astype(float).tolist()
        size = max(map(abs, (a, b, c, d)))
        if size == 0.0:
            return cls()
        swaps = abs(a) + abs(d) < abs(b) + abs(c)
        across, along = ((b, c), (a, d)) if swaps else ((d, a), (b, c))
        notes = []
        if max(map(abs, along)) > _SLANTED * size:
            notes.append(
                f"The file asks for a rotation by {frame.rotation}°; only quarter turns are made."
            )
        if a * d - b * c < 0:
            notes.append("The file asks for a mirrored picture, and is shown so.")
        down, right = (-1 if one < 0 else 1 for one in across)
        return cls(swaps, down, right, tuple(notes))

    def picture(self, rgb: NDArray[Any]) -> NDArray[Any]:
        """Turn a stored picture, (height, width, 3)."""
        turned = rgb.swapaxes(0, 1) if self.swaps else rgb
        return turned[:: self.down, :: self.right]


class VideoReader(AbstractContextManager["VideoReader"]):
    """Random access to the frames of one video file.

    Made by :func:`open_video`. Safe to use from several threads; a context
    manager. Frame ``k`` is the k-th frame shown, whatever the container says.

    Attributes
    ----------
    path : Path
    timebase : Timebase
        When each frame that really decodes is shown; the first at 0 s.
    metadata : mapping of str to str
        Of the file: of the container, then of the stream.
    width, height : int
        Of the upright picture.

    Examples
    --------
    >>> import sd2core as sd2
    >>> from sd2core.files.resources import resource_path
    >>> with sd2.open_video(resource_path("swipes.sd2") / "video.mp4") as video:
    ...     first, second = video.frames(0, 2)
    ...     first.shape, round(video.timebase.frames_per_s)
    ((480, 640, 3), 30)
    """

    def __init__(self, path: Path, index: FrameIndex) -> None:
        self.path = path
        self.timebase = Timebase(index.times_s)
        self._index = index
        self._notes = list(index.notes)
        self._lock = threading.Lock()
        self._converter = VideoReformatter()
        self._cache: OrderedDict[int, tuple[Any, int]] = OrderedDict()  # frame, its bytes
        self._cached_bytes = 0
        self._substitutes: dict[int, int] = {}
        self._frames: Iterator[tuple[int, Any]] | None = None
        self._next = 0  # number of the frame that decoding on would give
        self._entry = 0  # where decoding began
        self._gave_earlier = False
        self._container, self._stream = open_stream(path)
        self.metadata: Mapping[str, str] = {**self._container.metadata, **self._stream.metadata}
        try:
            self._begin(0)
            first = self._find(0)
        except BaseException:
            self.close()
            raise
        self._turned = Upright.of(first)
        self._notes.extend(self._turned.notes)
        # Of an absurd ratio nothing is believed.
        aspect = self._stream.sample_aspect_ratio or 1
        stretch = float(aspect) if 0.1 < aspect < 10 else 1.0
        self._size = (round(first.width * stretch), first.height)
        self.width, self.height = self._size[:: -1 if self._turned.swaps else 1]
        if self._size[0] != first.width:
            self._notes.append(
                f"Pixels are not square (ratio {aspect}): the picture is stretched to"
                f" {self.width} × {self.height}, as players show it."
            )
        with suppress(ValueError):  # as Android's cameras write it
            taken = float(self.metadata.get("com.android.capture.fps", ""))
            shown = self.timebase.frames_per_s
            if 0 < taken < math.inf and not 0.67 < taken / shown < 1.5:
                self._notes.append(
                    f"The camera took {taken:g} frames/s and the file shows {shown:.4g}: all is"
                    f" {shown / taken:.3g} times as fast as it was, velocities too."
                    f" 'ffmpeg -itsscale {shown / taken:.6g} -i FILE -c copy copy.mp4' mends it."
                )
        if first.interlaced_frame:
            self._notes.append(
                "The picture is interlaced: its lines are of two moments, and what moves is torn."
                " 'ffmpeg -i FILE -vf bwdif copy.mp4' makes a picture of each."
            )

    @property
    def notes(self) -> tuple[str, ...]:
        """Oddities of the file, for the user."""
        return tuple(self._notes)

    def __len__(self) -> int:
        return len(self.timebase)

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; a second time does nothing."""
        with self._lock:
            self._frames = None
            self._cache.clear()
            self._cached_bytes = 0
            if self._container is not None:
                self._container.close()
                self._container = None

    def read(self, frame: int) -> NDArray[np.uint8]:
        """Picture of one frame.

        Parameters
        ----------
        frame : int
            From 0 to ``len(reader) - 1``.

        Returns
        -------
        uint8 array, shape (height, width, 3)
            RGB; the caller's own.

        Raises
        ------
        IndexError
            When there is no such frame.
        Sd2Error
            When the reader is closed or the file can no longer be read.
        """
        if not 0 <= frame < len(self):
            raise IndexError(f"frame {frame} of {len(self)}")
        with self._lock:
            if self._container is None:
                raise Sd2Error(f"{self.path} is closed", "an open video", "Open it again")
            width, height = self._size
            # A frame that converts itself makes a converter of its own, with a pool of threads.
            picture = self._converter.reformat(self._find(frame), width, height, "rgb24", threads=1)
            rgb = picture.to_ndarray()
        return np.ascontiguousarray(self._turned.picture(rgb))

    def frames(self, start: int = 0, stop: int | None = None) -> Iterator[NDArray[np.uint8]]:
        """Pictures of frames ``start`` to ``stop`` (exclusive), in order."""
        for frame in range(start, len(self) if stop is None else stop):
            yield self.read(frame)

    def _find(self, frame: int) -> Any:
        frame = self._substitutes.get(frame, frame)
        if frame in self._cache:
            self._cache.move_to_end(frame)
            return self._cache[frame][0]
        key = self._index.keys[frame]
        entry = max(int(np.searchsorted(self._index.entry_keys, key, side="right")) - 1, 0)
        if not self._is_ahead(frame, entry):
            self._begin(entry)
        back = 1
        while True:
            picture = self._decode_to(frame)
            if picture is not None:
                return picture
            # The file may lead to a later place than asked, or the decoder need
            # earlier pictures than the file admits: begin further back. When
            # that gives the frames around this one again and not this one, it
            # is damaged.
            if self._entry == 0 or (back > 2 and self._gave_earlier):
                return self._hold_before(frame)
            entry = max(entry - back, 0)
            back *= 2
            self._begin(entry)

    def _is_ahead(self, frame: int, entry: int) -> bool:
        """True if decoding on reaches ``frame`` sooner than a seek."""
        if self._frames is None or frame < self._next:
            return False
        if self._index.counted or not self._index.entry_keys.size:
            return True
        first = int(np.searchsorted(self._index.keys, self._index.entry_keys[entry]))
        return self._next >= first or frame - self._next <= frame - first + _SEEK_COST_FRAMES

    def _begin(self, entry: int) -> None:
        """Make decoding continue at ``entry`` (0 is the start of the file)."""
        begin: int | None = None
        if entry > 0:
            begin = int(self._index.entry_keys[entry])
            try:
                self._container.seek(begin, stream=self._stream, backward=True)
            except (FFmpegError, OSError):
                entry, begin = 0, None  # a format that cannot seek
        if entry == 0:
            # Opening again reaches the start of every file; seeking does not.
            container, stream = open_stream(self.path)
            self._container.close()
            self._container, self._stream = container, stream
        self._entry = entry
        self._next = 0 if begin is None else int(np.searchsorted(self._index.keys, begin))
        self._frames = self._numbered(begin)

    def _numbered(self, begin: int | None) -> Iterator[tuple[int, Any]]:
        """Decoded frames with their numbers; what precedes ``begin`` may be incomplete."""
        keys = self._index.keys
        frames = decoded_frames(self._container, self._stream)
        for count, picture in enumerate(frames):
            key = count if self._index.counted else picture.pts
            if key is None or (begin is not None and key < begin):
                continue
            number = int(np.searchsorted(keys, key))
            if number < len(keys) and keys[number] == key:
                yield number, picture

    def _decode_to(self, frame: int) -> Any | None:
        """Decode up to ``frame``; None when the decoder has passed it."""
        assert self._frames is not None
        self._gave_earlier = False
        for number, picture in self._frames:
            self._remember(number, picture)
            self._next = number + 1
            if number == frame:
                return picture
            if number > frame + self._index.late:
                return None
            self._gave_earlier |= number < frame
        self._frames = None
        return None

    def _remember(self, number: int, picture: Any) -> None:
        if number in self._cache:
            self._cache.move_to_end(number)
            return
        size = sum(plane.buffer_size for plane in picture.planes)
        self._cache[number] = (picture, size)
        self._cached_bytes += size
        while self._cached_bytes > _CACHE_BYTES and len(self._cache) > 1:
            _, (_, freed) = self._cache.popitem(last=False)
            self._cached_bytes -= freed

    def _hold_before(self, frame: int) -> Any:
        """Show the frame before one that is damaged inside the file."""
        neighbours = [k for k in self._cache if k < frame] or list(self._cache)
        if not neighbours:
            raise Sd2Error(
                f"{self.path}: frame {frame} does not decode any more",
                "the file as it was when it was opened",
                "Open it again",
            )
        held = min(neighbours, key=lambda k: abs(k - frame))
        self._substitutes[frame] = held
        self._notes.append(f"Frame {frame} is damaged; frame {held} is shown in its place.")
        return self._cache[held][0]


def open_video(path: Path | str, progress: Progress = silent) -> VideoReader:
    """Open a video file for frame-exact reading.

    Parameters
    ----------
    path : path
        Any file that FFmpeg reads.
    progress : callable
        Called while the frames are listed; may raise ``Cancelled``.

    Returns
    -------
    VideoReader

    Raises
    ------
    Sd2Error
        When the file is missing, is no video, or no frame of it decodes.

    Examples
    --------
    >>> import sd2core as sd2
    >>> from sd2core.files.resources import resource_path
    >>> with sd2.open_video(resource_path("swipes.sd2") / "video.mp4") as video:
    ...     len(video), video.width, video.height
    (450, 640, 480)
    """
    path = as_path(path)
    return VideoReader(path, build_index(path, progress))
