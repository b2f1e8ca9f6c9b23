"""Landmarks of one person in a video: found, followed, refined and repaired."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sd2core.body.array_store import ArrayStore
from sd2core.body.blazepose import Pose, PoseDetector, PoseLandmarker
from sd2core.body.landmark_files import RefinedStretches, repaired_track, search_store
from sd2core.body.landmark_models import LandmarkModels
from sd2core.body.landmark_repair import who_else
from sd2core.body.person_selection import Rectangle, Start, find_person_in, find_prominent_person
from sd2core.body.person_tracker import PersonTracker
from sd2core.body.refining import Refiner
from sd2core.body.roi import Roi, Sightings, roi_numbers, roi_of, roi_path
from sd2core.body.track import LandmarkTrack
from sd2core.body.tracking import Search
from sd2core.errors import Sd2Error
from sd2core.io.video import VideoReader
from sd2core.numerics.compiled import worker_count
from sd2core.progress import Progress, silent

SearchStage = Literal["find", "refine"]
"""Passes over the video, in order."""

OnFrame = Callable[[SearchStage, int, NDArray[np.float32], NDArray[np.float32]], None]
"""``on_frame(stage, frame, image_px (33, 2), visibility (33,))``."""

DEFAULT_MAX_GAP_S = 0.5
DEFAULT_SILHOUETTES = 24

SIGHTINGS = "sightings.npz"
"""In a workspace: what the first pass found."""

_STRETCH_FRAMES = 256
_SAVE_EVERY = 300
_MAX_THREADS = 8


def find_landmarks(
    video: VideoReader,
    models: LandmarkModels,
    *,
    person: Rectangle | Sightings | None = None,
    max_gap_s: float = DEFAULT_MAX_GAP_S,
    silhouettes: int | None = DEFAULT_SILHOUETTES,
    threads: int | None = None,
    progress_of: Callable[[SearchStage], Progress] = lambda stage: silent,
    on_frame: OnFrame = lambda *_: None,
    workspace: Path | None = None,
) -> LandmarkTrack:
    """Find the landmarks of one person in every frame.

    The person is followed from a first frame both ways; the path of the square around them
    is smoothed without lag, and every frame is looked at again in it. Swapped sides and
    outliers are repaired, short gaps bridged.

    Parameters
    ----------
    video : VideoReader
        Two frames or more.
    person : Rectangle or Sightings, optional
        Around the person in one frame, or all of their sightings, which are not looked for then;
        otherwise the most prominent one.
    max_gap_s : float
        Longest gap without the person that is bridged; longer ones stay empty.
    silhouettes : int or None
        Number of frames, evenly spread, whose mask is kept; None for all.
    threads : int, optional
        All cores (up to 8) unless given.
    progress_of : callable, optional
        Gives the progress callback of a stage that begins, which counts frames and may raise
        ``Cancelled``.
    on_frame : callable, optional
        Called with the findings of each stage in a frame; may raise ``Cancelled``.
    workspace : Path, optional
        Folder from which a stopped search can go on. Results of another video or other options
        in it are not used.

    Raises
    ------
    Sd2Error
        If the video is a single picture, or no person is found in it.
    """
    if len(video) < 2:
        raise Sd2Error(
            f"{video.path} holds a single picture", "a video of two frames or more: motion"
        )
    if not max_gap_s >= 0.0:
        raise Sd2Error(f"the longest gap to bridge is {max_gap_s} s", "0 s or more")
    if threads is None:
        threads = min(worker_count(), _MAX_THREADS)
    store = search_store(workspace, video, person, silhouettes, models.name)
    if isinstance(person, Sightings):
        sightings = person
        store.write(SIGHTINGS, vars(sightings))
    else:
        sightings = _sighted(video, models, person, threads, progress_of("find"), on_frame, store)
    progress = progress_of("refine")
    refined = _refined(video, models, sightings, silhouettes, threads, progress, on_frame, store)
    unclear = sightings.unclear_frames(len(video))
    others = who_else(sightings, video.timebase.times_s)
    track = repaired_track(video, refined, max_gap_s, unclear, others)
    if not track.confidence.any():
        raise Sd2Error(
            f"No person could be followed through {video.path}",
            "a person who is seen in some frames in succession",
            "Mark the person in one frame (--person-box X,Y,WIDTH,HEIGHT --person-frame FRAME)",
        )
    return track


def _sighted(
    video: VideoReader,
    models: LandmarkModels,
    person: Rectangle | None,
    threads: int,
    progress: Progress,
    on_frame: OnFrame,
    store: ArrayStore,
) -> Sightings:
    """The first pass."""
    kept = store.read(SIGHTINGS)
    if kept is not None:
        return Sightings(**kept)
    detector = PoseDetector(models.detector, threads)
    landmarker = PoseLandmarker(models.follower, threads)
    kept = store.read("start.npz")
    if kept is not None:
        x, y, size, angle = (float(value) for value in kept["roi"])
        start = Start(int(kept["frame"]), Roi(x, y, size, angle))
    elif person is not None:
        start = find_person_in(person, video, detector, landmarker)
    else:
        start = find_prominent_person(video, detector, landmarker, progress)
    store.write("start.npz", {"frame": np.array(start.frame), "roi": roi_numbers(start.roi)})
    search = Search(video, start, PersonTracker(detector, landmarker))
    kept = store.read("search.npz")
    if kept is not None:
        search.restore(kept)

    def seen(frame: int, pose: Pose | None) -> None:
        done, total = search.done
        _show("find", frame, pose, on_frame)
        if done % _SAVE_EVERY == 0 and done < total and search.settled:
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
    on_frame: OnFrame,
    store: ArrayStore,
) -> RefinedStretches:
    """The second pass."""
    frames = len(video)
    path = roi_path(sightings, video.timebase.times_s)
    kept = _spread(np.flatnonzero(np.isfinite(path[:, 0])), silhouettes)

    def seen(frame: int, pose: Pose | None) -> None:
        _show("refine", frame, pose, on_frame)
        progress(frame + 1, frames)

    refined = RefinedStretches(store)
    landmarkers = [PoseLandmarker(models.landmarker) for _ in range(threads)]
    with Refiner(landmarkers) as refiner:
        for start in range(0, frames, _STRETCH_FRAMES):
            if refined.resumed(start):
                progress(min(start + _STRETCH_FRAMES, frames), frames)
                continue
            rois = [roi_of(row) for row in path[start : start + _STRETCH_FRAMES]]
            refined.add(start, refiner.stretch(video, start, rois, kept, seen))
    return refined


def _spread(frames: NDArray[np.intp], count: int | None) -> frozenset[int]:
    """``count`` of the frames, evenly spread."""
    if count is None or count >= len(frames):
        return frozenset(frames.tolist())
    rows = [round(k) for k in np.linspace(0, len(frames) - 1, count)]
    return frozenset(frames[rows].tolist())


def _show(stage: SearchStage, frame: int, pose: Pose | None, on_frame: OnFrame) -> None:
    if pose is not None:
        visibility = (pose.visibility * pose.presence).astype(np.float32)
        on_frame(stage, frame, pose.image_px[:33].astype(np.float32), visibility)
