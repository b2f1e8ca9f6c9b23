"""A video's landmarks: one person, found, followed, looked at again, and mended."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.body.blazepose import Pose, PoseDetector, PoseLandmarker
from sd2core.body.choosing import Rectangle, Start, choose, chosen_by
from sd2core.body.landmark_files import load_track, read_arrays, save_track, write_arrays
from sd2core.body.landmark_models import LandmarkModels
from sd2core.body.refining import Refiner, Stretch
from sd2core.body.repair import Found, repaired
from sd2core.body.roi import Roi
from sd2core.body.roi_path import Sightings, roi_numbers, roi_path
from sd2core.body.track import LandmarkTrack
from sd2core.body.tracking import Follower, Search
from sd2core.compiled import worker_count
from sd2core.errors import Sd2Error
from sd2core.io.video import VideoReader
from sd2core.progress import Progress, silent

__all__ = ["Rectangle", "find_landmarks", "load_track", "save_track"]

OnFrame = Callable[[int, NDArray[np.float32], NDArray[np.float32]], None]
"""``on_frame(frame, image_px (33, 2), visibility (33,))``."""

DEFAULT_MAX_GAP_S = 0.5
DEFAULT_SILHOUETTES = 24

SIGHTINGS = "sightings.npz"
"""In a workspace: what the first pass found."""

_WORKSPACE_VERSION = 1
_STRETCH_FRAMES = 256
_SAVE_EVERY = 300
_MOST_THREADS = 8


def find_landmarks(
    video: VideoReader,
    models: LandmarkModels,
    *,
    person: Rectangle | None = None,
    max_gap_s: float = DEFAULT_MAX_GAP_S,
    silhouettes: int | None = DEFAULT_SILHOUETTES,
    threads: int | None = None,
    progress: Progress = silent,
    on_stage: Callable[[str], None] | None = None,
    on_frame: OnFrame | None = None,
    workspace: Path | None = None,
) -> LandmarkTrack:
    """Find the landmarks of one person in every frame.

    The person is followed from a first frame both ways; the path of the square around
    them is smoothed without lag, and every frame looked at again in it. Swapped sides
    and outliers are mended, short gaps bridged.

    Parameters
    ----------
    video : VideoReader
        Two frames or more.
    models : LandmarkModels
    person : Rectangle, optional
        Where the person is in one frame; otherwise the most prominent one.
    max_gap_s : float
        The longest gap without the person that is bridged; longer ones stay empty.
    silhouettes : int or None
        Of how many frames, evenly spread, the model's mask is kept; None for all.
    threads : int, optional
        All cores (up to 8) unless given.
    progress : callable
        Counts frames, of each stage anew; may raise ``Cancelled``.
    on_stage : callable, optional
        Called with ``"find"`` and ``"refine"`` when that stage begins.
    on_frame : callable, optional
        Called with what each stage found in a frame.
    workspace : Path, optional
        A folder for what a stopped search can go on from. What is there of another
        video or other options is not used.

    Returns
    -------
    LandmarkTrack

    Raises
    ------
    Sd2Error
        When the video is a single picture, or nobody is found in it.
    """
    if len(video) < 2:
        raise Sd2Error(
            f"{video.path} holds a single picture", "a video of two frames or more: motion"
        )
    if not max_gap_s >= 0.0:
        raise Sd2Error(f"the longest gap to bridge is {max_gap_s} s", "0 s or more")
    if threads is None:
        threads = min(worker_count(), _MOST_THREADS)
    store = _Store(workspace, video, person, silhouettes)
    begin = on_stage or (lambda stage: None)
    begin("find")
    sightings = _found(video, models, person, threads, progress, on_frame, store)
    begin("refine")
    stretches = _refined(video, models, sightings, silhouettes, threads, progress, on_frame, store)
    return _track(video, stretches, max_gap_s)


def _found(
    video: VideoReader,
    models: LandmarkModels,
    person: Rectangle | None,
    threads: int,
    progress: Progress,
    on_frame: OnFrame | None,
    store: _Store,
) -> Sightings:
    """The first pass."""
    kept = store.read(SIGHTINGS)
    if kept is not None:
        return Sightings(**kept)
    detector = PoseDetector(models.detector, threads)
    landmarker = PoseLandmarker(models.landmarker, threads)
    kept = store.read("start.npz")
    if kept is not None:
        x, y, size, angle = (float(value) for value in kept["roi"])
        start = Start(int(kept["frame"]), Roi(x, y, size, angle))
    elif person is not None:
        start = chosen_by(person, video, detector, landmarker)
    else:
        start = choose(video, detector, landmarker, progress)
    store.write("start.npz", {"frame": np.array(start.frame), "roi": roi_numbers(start.roi)})
    search = Search(video, start, Follower(detector, landmarker))
    kept = store.read("search.npz")
    if kept is not None:
        search.restore(kept)

    def seen(frame: int, pose: Pose | None) -> None:
        done, total = search.done
        _show(frame, pose, on_frame)
        if done % _SAVE_EVERY == 0 and done < total:
            store.write("search.npz", search.state())
        progress(round(done * len(video) / total), len(video))

    sightings = search.run(seen)
    store.write(SIGHTINGS, vars(sightings))
    return sightings


def _refined(
    video: VideoReader,
    models: LandmarkModels,
    sightings: Sightings,
    silhouettes: int | None,
    threads: int,
    progress: Progress,
    on_frame: OnFrame | None,
    store: _Store,
) -> list[Stretch]:
    """The second pass."""
    frames = len(video)
    rois = roi_path(sightings, video.timebase.times_s)
    kept = _spread([frame for frame in range(frames) if rois[frame] is not None], silhouettes)

    def seen(frame: int, pose: Pose | None) -> None:
        _show(frame, pose, on_frame)
        progress(frame + 1, frames)

    stretches = []
    landmarkers = [PoseLandmarker(models.landmarker) for _ in range(threads)]
    with Refiner(landmarkers) as refiner:
        for start in range(0, frames, _STRETCH_FRAMES):
            name = f"refined-{start:07d}.npz"
            arrays = store.read(name)
            if arrays is None:
                part = rois[start : start + _STRETCH_FRAMES]
                stretch = refiner.stretch(video, start, part, kept, seen)
                store.write(name, vars(stretch))
            else:
                stretch = Stretch(**arrays)
                progress(start + len(stretch.confidence), frames)
            stretches.append(stretch)
    return stretches


def _spread(frames: list[int], count: int | None) -> frozenset[int]:
    """``count`` of the frames, evenly spread."""
    if count is None or count >= len(frames):
        return frozenset(frames)
    return frozenset(frames[round(k)] for k in np.linspace(0, len(frames) - 1, count))


def _show(frame: int, pose: Pose | None, on_frame: OnFrame | None) -> None:
    if pose is not None and on_frame is not None:
        visibility = pose.visibility * pose.presence
        on_frame(frame, pose.image_px[:33].astype(np.float32), visibility.astype(np.float32))


def _track(video: VideoReader, stretches: list[Stretch], max_gap_s: float) -> LandmarkTrack:
    """Everything together, mended."""
    joined = {
        name: np.concatenate([getattr(stretch, name) for stretch in stretches])
        for name in vars(stretches[0])
    }
    confidence = joined["confidence"]
    if not confidence.any():
        raise Sd2Error(
            f"Nobody could be followed through {video.path}",
            "a person who is seen in some frames in succession",
            "Say where the person is: --person X,Y,WIDTH,HEIGHT --person-frame FRAME",
        )
    found = Found(
        times_s=video.timebase.times_s,
        present=confidence > 0.0,
        bridged=np.zeros(len(confidence), bool),
        **{name: joined[name] for name in ("image_px", "depth_px", "world_m", "visibility")},
    )
    found, notes = repaired(found, max_gap_s)
    return LandmarkTrack(
        timebase=video.timebase,
        width=video.width,
        height=video.height,
        image_px=found.image_px,
        depth_px=found.depth_px,
        world_m=found.world_m,
        visibility=found.visibility,
        confidence=confidence,
        present=found.present,
        bridged=found.bridged,
        silhouette_frames=joined["silhouette_frames"],
        silhouettes=joined["silhouettes"],
        notes=notes,
    )


class _Store:
    """What is kept of a search; files of another search are as if not there."""

    def __init__(
        self,
        folder: Path | None,
        video: VideoReader,
        person: Rectangle | None,
        silhouettes: int | None,
    ) -> None:
        self._folder = folder
        if folder is None:
            return
        folder.mkdir(parents=True, exist_ok=True)
        about = os.stat(video.path)
        identity = {
            "version": _WORKSPACE_VERSION,
            "video": [str(video.path.resolve()), about.st_size, about.st_mtime_ns],
            "frames": [len(video), video.width, video.height],
            "person": None if person is None else list(vars(person).values()),
            "silhouettes": silhouettes,
        }
        self._key = hashlib.sha256(json.dumps(identity).encode()).hexdigest()

    def read(self, name: str) -> dict[str, Any] | None:
        if self._folder is None or not (self._folder / name).is_file():
            return None
        try:
            arrays, meta = read_arrays(self._folder / name)
        except Sd2Error:
            return None
        return arrays if meta.get("key") == self._key else None

    def write(self, name: str, arrays: Mapping[str, Any]) -> None:
        if self._folder is not None:
            write_arrays(self._folder / name, arrays, {"key": self._key})
