"""Landmarks on disk: a whole track in a file, and a search in a folder, from which it goes on."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.body.array_store import ArrayStore, read_arrays, unreadable
from sd2core.body.landmark_repair import repair_landmarks
from sd2core.body.person_selection import Rectangle
from sd2core.body.raw_track import RawTrack
from sd2core.body.refining import RefinedFrames
from sd2core.body.roi import Sightings
from sd2core.body.track import PER_FRAME, LandmarkTrack
from sd2core.files.atomic import atomic_write
from sd2core.files.texts import check_version
from sd2core.io.video import VideoReader
from sd2core.timebase import Timebase

FORMAT = "sd2-landmarks"
VERSION = 1
_SEARCH_VERSION = 5

_ARRAYS = (*PER_FRAME, "silhouette_frames", "silhouettes")
_PLACES = ("image_px", "depth_px", "world_m", "visibility")


def save_track(track: LandmarkTrack, path: Path | str) -> None:
    """Write landmarks to one file (.npz) in one step."""
    meta = {
        "format": FORMAT,
        "version": VERSION,
        "width": track.width,
        "height": track.height,
        "notes": list(track.notes),
    }
    with atomic_write(Path(path)) as stream:
        np.savez_compressed(
            stream,
            meta=np.array(json.dumps(meta, ensure_ascii=False)),
            times_s=track.timebase.times_s,
            **{name: getattr(track, name) for name in _ARRAYS},
        )


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
        Made where it is missing; None keeps nothing.
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
    video: VideoReader,
    refined: RefinedStretches,
    max_gap_s: float,
    unclear: NDArray[np.bool_] | None = None,
    notes: tuple[str, ...] = (),
) -> LandmarkTrack:
    """Repair what was found; see :func:`repair_landmarks`.

    Parameters
    ----------
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
    found = refined.joined()
    raw = RawTrack(
        times_s=video.timebase.times_s,
        present=found["confidence"] > 0.0,
        bridged=np.zeros(len(video), bool),
        **{name: found[name] for name in _PLACES},
    )
    track, repairs = repair_landmarks(raw, max_gap_s, unclear)
    arrays = {name: values for name, values in vars(track).items() if name != "times_s"}
    return LandmarkTrack(
        timebase=video.timebase,
        width=video.width,
        height=video.height,
        **found | arrays,
        notes=(*repairs, *notes),
    )


class RefinedStretches:
    """Results of the second pass, stretch by stretch, kept in a store as they come."""

    def __init__(self, store: ArrayStore) -> None:
        self._store = store
        self._stretches: list[RefinedFrames] = []

    def add(self, start: int, stretch: RefinedFrames) -> None:
        """Keep the next stretch that has been looked at."""
        self._store.write(self._name(start), vars(stretch))
        self._stretches.append(stretch)

    def resumed(self, start: int) -> bool:
        """True if the stretch that begins with a frame is in the store already."""
        arrays = self._store.read(self._name(start))
        if arrays is not None:
            self._stretches.append(RefinedFrames(**arrays))
        return arrays is not None

    def joined(self) -> dict[str, NDArray[Any]]:
        """Arrays of :class:`~sd2core.body.refining.RefinedFrames`, of all stretches."""
        return {
            one.name: np.concatenate([getattr(each, one.name) for each in self._stretches])
            for one in fields(RefinedFrames)
        }

    @staticmethod
    def _name(start: int) -> str:
        return f"refined-{start:07d}.npz"
