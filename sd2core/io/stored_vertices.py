"""Vertices of a mesh that stay on disk."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.stores import Damage, StoredArray
from sd2core.mesh.sequence import refuse_missing

_LARGEST_CHUNK_BYTES = 64 * 2**20
_KEPT_BYTES = 32 * 2**20
"""Chunks that were read last: all of a short clip, which several threads read at once."""


class StoredVertices:
    """Vertices (T, V, 3) that stay on disk; scaled, turned, moved and checked when read.

    Frames in ``damaged`` chunks hold the last pose before them (at the start, the next after them).
    """

    def __init__(self, array: StoredArray, damaged: tuple[Damage, ...] = ()) -> None:
        self._array = array
        self._source = str(array.path)
        self._kept: dict[int, NDArray[Any]] = {}  # frames by chunk number, newest last
        self._reading = threading.Lock()
        self.damaged = damaged
        self._lost = {one.start // self.frames_per_chunk for one in damaged}  # chunk numbers
        self.scale = 1.0
        self.rotation: NDArray[np.float64] | None = None  # (3, 3)
        self.shift_m = np.zeros(3, np.float32)
        self.shape: tuple[int, ...] = array.shape
        self.dtype = real_type(array.dtype)

    @property
    def frames_per_chunk(self) -> int:
        """Frames that come from the disk together."""
        return self._array.chunks[0]

    @property
    def chunk_bytes(self) -> int:
        """Memory of those frames."""
        return self.frames_per_chunk * int(np.prod(self.shape[1:])) * self.dtype.itemsize

    @property
    def large_chunks(self) -> bool:
        """True if chunks are too large to be kept, so that every frame is read with its chunk."""
        return self.chunk_bytes > _LARGEST_CHUNK_BYTES

    def __getitem__(self, key: Any) -> NDArray[Any]:
        first = None
        if isinstance(key, int | np.integer):
            first = range(self.shape[0])[key]
            part = self._stretch(first, first + 1)[0]
        elif isinstance(key, slice) and key.step in (None, 1):
            first, stop, _ = key.indices(self.shape[0])
            part = self._stretch(first, stop)
        else:
            part = self._read(key)
        # A sum is finite only when its terms are, and costs next to nothing
        # beside the reading; a sum that overflowed is looked at again.
        with np.errstate(all="ignore"):
            suspect = not np.isfinite(part.sum())
        if suspect and first is not None:
            refuse_missing(part.reshape(-1, *self.shape[1:]), first, self._source)
        if suspect and not np.isfinite(part).all():
            raise Sd2Error(
                f"{self._source}: vertices that are NaN or infinite in {_where(key)}",
                "finite coordinates in metres in every frame",
                "Fill or leave out those frames where the file is written",
            )
        if self.scale != 1.0:
            part = part * part.dtype.type(self.scale)
        if self.rotation is not None:
            part = part @ self.rotation.T.astype(part.dtype)
        if self.shift_m.any():
            part = part + self.shift_m.astype(part.dtype)
        return part

    def _stretch(self, start: int, stop: int) -> NDArray[Any]:
        """Frames ``start`` to ``stop``, chunk by chunk: Zarr is slower on many at once."""
        if (self.large_chunks and not self._lost) or stop <= start:
            return self._read(slice(start, stop))
        part = np.empty((stop - start, *self.shape[1:]), self.dtype)
        step = self.frames_per_chunk
        for number in range(start // step, (stop - 1) // step + 1):
            first, last = max(start, number * step), min(stop, (number + 1) * step)
            chunk = self._chunk(number)
            part[first - start : last - start] = chunk[first - number * step :][: last - first]
        return part

    def _chunk(self, number: int) -> NDArray[Any]:
        """One chunk; the last ones are kept, because frames are played one by one."""
        kept = self._kept.get(number)
        if kept is not None:
            return kept
        with self._reading:
            chunk = self._kept.get(number)
            if chunk is None:
                chunk = self._chunk_from_disk(number)
                while self._kept and (len(self._kept) + 1) * self.chunk_bytes > _KEPT_BYTES:
                    del self._kept[next(iter(self._kept))]
                self._kept[number] = chunk
        return chunk

    def _chunk_from_disk(self, number: int) -> NDArray[Any]:
        """Frames of one chunk; of a lost one, a pose that stands in for them."""
        step = self.frames_per_chunk
        frames = slice(number * step, min((number + 1) * step, self.shape[0]))
        if number not in self._lost:
            return self._read(frames)
        pose = self._read(self._pose_frame(number))
        return np.broadcast_to(pose, (frames.stop - frames.start, *pose.shape))

    def _pose_frame(self, lost: int) -> int:
        """Frame whose pose stands in for those of a lost chunk."""
        step = self.frames_per_chunk
        before = next((n for n in range(lost - 1, -1, -1) if n not in self._lost), None)
        if before is not None:
            return (before + 1) * step - 1
        return next(n for n in range(lost + 1, self.shape[0]) if n not in self._lost) * step

    def _read(self, key: Any) -> NDArray[Any]:
        try:
            return np.asarray(self._array[key], dtype=self.dtype)
        except Sd2Error as error:
            remedy = f"{error.remedy}; without its file, a chunk's frames are left out"
            raise Sd2Error(error.found, error.expected, remedy) from error


def damaged_frames(vertices: Any) -> int:
    """Number of frames of a mesh that were lost to damaged chunks of its file."""
    return sum(one.stop - one.start for one in getattr(vertices, "damaged", ()))


def real_type(dtype: Any) -> np.dtype[Any]:
    """Single precision where it holds every number of this type, otherwise double."""
    return np.dtype(np.float32 if np.can_cast(dtype, np.float32) else np.float64)


def _where(key: Any) -> str:
    if isinstance(key, slice):
        return f"frames {key.start or 0} to {(key.stop or 0) - 1}"
    return f"frame {key}"
