"""Fits to long videos: what they take, and how much their seams change.

``python tests/benchmarks/long_fits.py 2 5 15`` prints time and memory of fits of so many minutes,
``python tests/benchmarks/long_fits.py seams`` compares a clip that is fitted whole with the same
clip fitted as if it were long.

Finding landmarks takes longest and is the same for every frame. So they are found in the
sample's video once, and go forwards and backwards from there for as long as it takes; all that
follows is done as always.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import repeat
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray
from peaks import forget_peak, peak_mb

from sd2core.body import fit as fitting
from sd2core.body import fit_windows, lifter
from sd2core.body import track as tracks
from sd2core.body.array_store import ArrayStore
from sd2core.body.camera import PinholeCamera
from sd2core.body.fit_video import LANDMARKS, MARKER, PARTIAL, FitChoices, FitReport, fit_video
from sd2core.body.landmark_files import RefinedStretches, search_store
from sd2core.body.landmark_models import DEFAULT_MODEL, landmark_models
from sd2core.body.landmarks import DEFAULT_SILHOUETTES, SIGHTINGS, find_landmarks
from sd2core.body.refining import RefinedFrames
from sd2core.body.roi import Sightings
from sd2core.body.track import LandmarkTrack
from sd2core.files.resources import resource_path
from sd2core.io.video import open_video
from sd2core.io.video_writing import write_video
from sd2core.processes import ONE_THREAD

_RATE_HZ = 30
_STRETCH_FRAMES = 256


@dataclass(frozen=True)
class LongFit:
    """A fit of so many frames.

    Parameters
    ----------
    frames : int
    seconds : float
        Of processor time, without finding the landmarks.
    peak_mb : dict of str to float
        The most memory in each stage.
    """

    frames: int
    seconds: float
    peak_mb: dict[str, float]


def sample_landmarks(folder: Path, frames: int | None = None) -> LandmarkTrack:
    """Those of the sample's video, or of its first frames."""
    path = resource_path("swipes.sd2") / "video.mp4"
    with open_video(path) as video:
        if frames is not None:
            size = (video.width, video.height)
            path = folder / "short.mp4"
            write_video(path, video.frames(0, frames), _RATE_HZ, size, preset="ultrafast")
    with open_video(path) as video:
        return find_landmarks(video, landmark_models())


def long_fit(track: LandmarkTrack, frames: int, folder: Path) -> LongFit:
    """A fit, in a process of its own, to so many frames with the landmarks of a track.

    Raises
    ------
    subprocess.CalledProcessError
        When it fails.
    """
    path, out = folder / f"{frames}.mp4", folder / f"{frames}.zarr"
    # Nobody looks at the pictures.
    size = (track.width, track.height)
    black = np.zeros((track.height, track.width, 3), np.uint8)
    write_video(path, repeat(black, frames), _RATE_HZ, size, preset="ultrafast")
    partial = out.with_name(out.name + PARTIAL)
    partial.mkdir()
    (partial / MARKER).write_text("{}")
    with open_video(path) as video:
        store = search_store(partial / LANDMARKS, video, None, DEFAULT_SILHOUETTES, DEFAULT_MODEL)
        _fill(store, len(video), track)
    told = subprocess.run(
        [sys.executable, __file__, "fit", str(path), str(out)],
        env=os.environ | ONE_THREAD,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return LongFit(frames, **json.loads(told.stdout.splitlines()[-1]))


@dataclass(frozen=True)
class Apart:
    """Vertex velocities of a clip fitted in stretches, less those of it fitted whole.

    Parameters
    ----------
    typical_mps : float
        Root mean square of the velocities themselves.
    at_seams_mps, elsewhere_mps : float
        Root mean square, in frames that two windows share and in all others.
    most_mps : float
        Of any vertex in any frame.
    """

    typical_mps: float
    at_seams_mps: float
    elsewhere_mps: float
    most_mps: float


def seams(track: LandmarkTrack, part_frames: int, window_frames: int) -> Apart:
    """How much it changes to fit a clip in parts and windows of so many frames."""
    camera = PinholeCamera.default(track.width, track.height)
    frames = len(track)
    velocities = []
    for part, window in ((frames, frames), (part_frames, window_frames)):
        with ExitStack() as stack:
            for module in (tracks, fitting, lifter):
                stack.enter_context(patch.object(module, "PART_FRAMES", part))
            stack.enter_context(patch.object(fit_windows, "_WINDOW_FRAMES", window))
            spans = fit_windows.Windows(track.present, None).spans
            mesh = fitting.fit_motion(track, camera).mesh("low")
        velocities.append(np.gradient(mesh.read(0, frames), mesh.times_s, axis=0))
    shared = np.zeros(frames, bool)
    for start, _, overlap in spans:
        shared[start : start + overlap] = True
    apart = np.linalg.norm(velocities[1] - velocities[0], axis=-1)

    def rms(values: NDArray[np.floating]) -> float:
        return float(np.sqrt((values**2).mean()))

    return Apart(
        rms(np.linalg.norm(velocities[0], axis=-1)),
        rms(apart[shared]) if shared.any() else 0.0,
        rms(apart[~shared]),
        float(apart.max()),
    )


def there_and_back(count: int, frames: int) -> NDArray[np.intp]:
    """Numbers from 0 to ``count - 1``, forwards and backwards again and again."""
    place = np.arange(frames) % (2 * count - 2)
    return np.minimum(place, 2 * count - 2 - place)


def _fill(store: ArrayStore, frames: int, track: LandmarkTrack) -> None:
    """As if they had been found."""
    rows = there_and_back(len(track), frames)
    sightings = Sightings(  # of the first frame, where alone somebody was searched for
        np.zeros(1, np.intp),
        np.array([[0.0, 0.0, 1.0, 0.0]]),
        np.ones(1),
        np.zeros(1, bool),
        np.zeros((1, 4), bool),
    )
    store.write(SIGHTINGS, vars(sightings))
    drawn = track.silhouette_frames[:8]
    drawn = drawn[drawn < frames]
    refined = RefinedStretches(store)
    for start in range(0, frames, _STRETCH_FRAMES):
        part = rows[start : start + _STRETCH_FRAMES]
        refined.add(
            start,
            RefinedFrames(
                image_px=track.image_px[part],
                depth_px=track.depth_px[part],
                world_m=track.world_m[part],
                visibility=track.visibility[part],
                confidence=track.confidence[part],
                silhouette_frames=drawn if not start else drawn[:0],
                silhouettes=track.silhouettes[: 0 if start else len(drawn)],
            ),
        )


def _fit_in_this_process(video: str, out: str) -> None:
    peaks: dict[str, float] = {}
    stages = ["start"]

    def progress_of(stage: str) -> Any:
        peaks[stages[-1]] = peak_mb()
        forget_peak()
        stages.append(stage)
        return lambda done, total: None

    begun_s = time.process_time()
    quiet = FitReport(progress_of, lambda *_: None, lambda *_: None)
    fit_video(Path(video), Path(out), FitChoices(), quiet)
    peaks[stages[-1]] = peak_mb()
    print(json.dumps({"seconds": time.process_time() - begun_s, "peak_mb": peaks}))


if __name__ == "__main__":
    if sys.argv[1] == "fit":
        _fit_in_this_process(*sys.argv[2:])
    elif sys.argv[1] == "seams":
        with tempfile.TemporaryDirectory() as name:
            known = sample_landmarks(Path(name))
            for part_frames, window_frames in ((150, 210), (150, len(known)), (len(known), 210)):
                apart = seams(known, part_frames, window_frames)
                print(f"parts of {part_frames}, windows of {window_frames}: {apart}", flush=True)
    else:
        with tempfile.TemporaryDirectory() as name:
            known = sample_landmarks(Path(name))
            for minutes in sys.argv[1:]:
                frames = round(60 * _RATE_HZ * float(minutes))
                print(long_fit(known, frames, Path(name)), flush=True)
