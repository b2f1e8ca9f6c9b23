"""Landmarks on disk: a whole track in a file, and a search in a folder, read part by part."""

from __future__ import annotations

import hashlib
import json
import os
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from sd2core.body.array_store import ArrayStore, read_arrays, unreadable
from sd2core.body.landmark_repair import repair_landmarks
from sd2core.body.person_selection import Rectangle
from sd2core.body.raw_track import RawTrack
from sd2core.body.refining import RefinedFrames
from sd2core.body.roi import Sightings
from sd2core.body.track import PER_FRAME, Landmarks, LandmarkTrack, parts
from sd2core.files.atomic import atomic_write
from sd2core.files.texts import check_version
from sd2core.io.video import VideoReader
from sd2core.timebase import Timebase

FORMAT = "sd2-landmarks"
VERSION = 1
_SEARCH_VERSION = 5

_ARRAYS = (*PER_FRAME, "silhouette_frames", "silhouettes")
_PLACES = ("image_px", "depth_px", "world_m", "visibility")


def save_track(track: Landmarks, path: Path | str) -> None:
    """Write landmarks to one file (.npz), part by part and in one step."""
    meta = {
        "format": FORMAT,
        "version": VERSION,
        "width": track.width,
        "height": track.height,
        "notes": list(track.notes),
    }
    small = {
        "meta": np.array(json.dumps(meta, ensure_ascii=False)),
        "times_s": track.timebase.times_s,
        "silhouette_frames": track.silhouette_frames,
        "silhouettes": track.silhouettes,
    }
    with (
        atomic_write(Path(path)) as stream,
        zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive,
    ):
        for name, array in small.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, array, allow_pickle=False)
        for name in PER_FRAME:
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                _write_parts(member, track, name)


def _write_parts(member: IO[bytes], track: Landmarks, name: str) -> None:
    """One array of a track as ``.npy``."""
    for start, stop in parts(len(track)):
        values = track.rows(start, stop)[name]
        if start == 0:
            shape = (len(track), *values.shape[1:])
            header = {"descr": values.dtype.str, "fortran_order": False, "shape": shape}
            np.lib.format.write_array_header_1_0(member, header)
        member.write(np.ascontiguousarray(values).tobytes())


def load_track(path: Path | str) -> LandmarkTrack:
    """Read a file of :func:`save_track`; Sd2Error if it is missing, damaged or newer."""
    path = Path(path)
    arrays, meta = read_arrays(path)
    check_version(meta, path, FORMAT, VERSION)
    try:
        frames = len(arrays["times_s"])
        track = LandmarkTrack(
            timebase=Timebase(arrays["times_s"]),
            width=int(meta["width"]),
            height=int(meta["height"]),
            notes=tuple(str(note) for note in meta["notes"]),
            **{name: arrays[name] for name in _ARRAYS},
        )
        shapes = {name: getattr(track, name).shape for name in _ARRAYS[:7]}
    except (KeyError, TypeError, ValueError) as error:
        raise unreadable(path, error) from error
    expected: dict[str, tuple[int, ...]]
    expected = {"image_px": (frames, 33, 2), "world_m": (frames, 33, 3)}
    expected |= dict.fromkeys(("depth_px", "visibility"), (frames, 33))
    for name, shape in shapes.items():
        if shape != expected.get(name, (frames,)):
            raise unreadable(path, f"{name} has shape {shape}")
    return track


def search_store(
    folder: Path | None,
    video: VideoReader,
    person: Rectangle | Sightings | None,
    silhouettes: int | None,
    landmark_model: str,
) -> ArrayStore:
    """Store of a search; files of another one (by any of these) are ignored.

    Parameters
    ----------
    folder : Path or None
        Made where it is missing; None keeps the arrays in memory.
    video : VideoReader
        Known by path, size, time of change, number of frames and size of the picture.
    person : Rectangle, Sightings or None
        Rectangle around the person, or where they were seen; None for the most prominent one.
    silhouettes : int or None
        Number of frames whose mask is kept; None for all.
    landmark_model : str
        Name of the landmark model.
    """
    if folder is None:
        return ArrayStore(None)
    about = os.stat(video.path)
    identity = {
        "version": _SEARCH_VERSION,
        "video": [str(video.path.resolve()), about.st_size, about.st_mtime_ns],
        "frames": [len(video), video.width, video.height],
        "person": _key_of(person),
        "silhouettes": silhouettes,
        "landmark_model": landmark_model,
    }
    return ArrayStore(folder, hashlib.sha256(json.dumps(identity).encode()).hexdigest())


def _key_of(person: Rectangle | Sightings | None) -> list[Any] | str | None:
    if isinstance(person, Sightings):
        return hashlib.sha256(person.rois.tobytes()).hexdigest()
    return None if person is None else list(vars(person).values())


def repaired_track(
    store: ArrayStore,
    video: VideoReader,
    refined: RefinedStretches,
    max_gap_s: float,
    unclear: NDArray[np.bool_] | None = None,
    notes: tuple[str, ...] = (),
) -> TrackInParts:
    """Repair what was found, into a store; see :func:`repair_landmarks`.

    Parameters
    ----------
    store : ArrayStore
        Repaired parts are written to it, and read from it by the track.
    video : VideoReader
        Searched for ``refined``.
    refined : RefinedStretches
        All stretches of the video.
    max_gap_s : float
        Longest gap without the person that is bridged.
    unclear : bool ndarray, (T,), optional
        Frames in which whoever is there may be another person.
    notes : tuple of str
        Sentences that the track has beside those about the repair.
    """
    present, bridged = np.zeros((2, len(video)), bool)
    written = 0

    def write(part: RawTrack) -> None:
        nonlocal written
        frames = slice(written, written + len(part.present))
        known = vars(part) | {"confidence": refined.confidence[frames]}
        store.write(_name(written), {name: known[name] for name in PER_FRAME})
        present[frames], bridged[frames] = part.present, part.bridged
        written = frames.stop

    times_s, seen = video.timebase.times_s, refined.confidence > 0.0
    repairs = repair_landmarks(refined.raw_track, times_s, seen, max_gap_s, write, unclear)
    silhouette_frames, silhouettes = refined.silhouettes()
    return TrackInParts(
        timebase=video.timebase,
        width=video.width,
        height=video.height,
        present=present,
        bridged=bridged,
        silhouette_frames=silhouette_frames,
        silhouettes=silhouettes,
        notes=(*repairs, *notes),
        store=store,
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class TrackInParts(Landmarks):
    """Landmarks in a store, repaired, a stretch at a time in memory."""

    store: ArrayStore

    def rows(self, start: int, stop: int) -> dict[str, NDArray[Any]]:
        """Frames ``start`` to ``stop`` of the arrays of a track."""
        starts = [first for first, _ in parts(len(self))]
        first = int(np.searchsorted(starts, start, side="right")) - 1
        last = max(int(np.searchsorted(starts, stop)), first + 1)
        pieces = [self._kept(begin) for begin in starts[first:last]]
        cut = slice(start - starts[first], stop - starts[first])
        return {name: _joined(pieces, name)[cut] for name in PER_FRAME}

    @cached_property
    def _kept(self) -> Callable[[int], Mapping[str, NDArray[Any]]]:
        return lru_cache(maxsize=2)(
            lambda start: self.store.needed(
                _name(start), f"The landmarks of frames {start} and on have"
            )
        )


class RefinedStretches:
    """Results of the second pass, stretch by stretch in a store."""

    def __init__(self, store: ArrayStore, video: VideoReader, stretch_frames: int) -> None:
        self._store, self._frames_each = store, stretch_frames
        self._times_s = video.timebase.times_s
        self.confidence = np.zeros(len(video), np.float32)
        self._masks: list[tuple[NDArray[np.intp], NDArray[np.uint8]]] = []

    def add(self, start: int, stretch: RefinedFrames) -> None:
        """Keep a stretch that has been looked at."""
        self._store.write(self._name(start), vars(stretch))
        self._count(start, stretch)

    def resumed(self, start: int) -> bool:
        """True if the stretch that begins with a frame is in the store already."""
        arrays = self._store.read(self._name(start))
        if arrays is not None:
            self._count(start, RefinedFrames(**arrays))
        return arrays is not None

    def silhouettes(self) -> tuple[NDArray[np.intp], NDArray[np.uint8]]:
        """All frames with a mask, and the masks."""
        frames, masks = zip(*self._masks, strict=True)
        return np.concatenate(frames), np.concatenate(masks)

    def raw_track(self, start: int, stop: int) -> RawTrack:
        """Frames ``start`` to ``stop``, not repaired."""
        step = self._frames_each
        begin = start // step * step
        stretches = []
        for first in range(begin, stop, step):
            what = f"What was found in frame {first} and on has"
            stretches.append(self._store.needed(self._name(first), what))
        cut = slice(start - begin, stop - begin)
        return RawTrack(
            times_s=self._times_s[start:stop],
            present=self.confidence[start:stop] > 0.0,
            bridged=np.zeros(stop - start, bool),
            **{name: _joined(stretches, name)[cut] for name in _PLACES},
        )

    def _count(self, start: int, stretch: RefinedFrames) -> None:
        """Note what has to be known of the whole clip."""
        self.confidence[start : start + len(stretch.confidence)] = stretch.confidence
        self._masks.append((stretch.silhouette_frames, stretch.silhouettes))

    @staticmethod
    def _name(start: int) -> str:
        return f"refined-{start:07d}.npz"


def _name(start: int) -> str:
    return f"mended-{start:07d}.npz"


def _joined(pieces: Sequence[Mapping[str, NDArray[Any]]], name: str) -> NDArray[Any]:
    return np.concatenate([piece[name] for piece in pieces])
