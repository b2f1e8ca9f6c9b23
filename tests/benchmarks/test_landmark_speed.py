"""What finding landmarks costs, and what the second pass gains, on the bundled sample.

Truth is known there: the landmarks of the body that was rendered. Times are printed;
what is asserted are ratios within one run.
"""

from __future__ import annotations

import time
from functools import partial

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from timing import best_s

from sd2core.body.blazepose import PoseDetector, PoseLandmarker
from sd2core.body.landmark_models import LandmarkModels
from sd2core.body.landmarks import find_landmarks
from sd2core.body.model import Body
from sd2core.body.rig import KeypointSpace
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.body.track import LANDMARKS
from sd2core.files.resources import resource_path
from sd2core.io.video import VideoReader, open_video
from tools.build_sample.render import Camera
from tools.build_sample.sample import _PLACE_ACROSS_M, DISTANCE_M
from tools.build_sample.swipes import swipes

TRUNK = [LANDMARKS.index(f"{name}.{side}") for name in ("shoulder", "hip", "knee") for side in "LR"]
WRISTS = [LANDMARKS.index(f"wrist.{side}") for side in "LR"]


@pytest.fixture(scope="module")
def video() -> VideoReader:
    return open_video(resource_path("swipes.sd2") / "video.mp4")


def truth_px(times_s: NDArray[np.float64]) -> NDArray[np.float64]:
    camera, space, body = Camera(), ShapeSpace(), Body.load("low")
    motion = swipes(body.skeleton, times_s)
    place = np.array([_PLACE_ACROSS_M, camera.above_floor_m, DISTANCE_M])
    transforms = body.skeleton.transforms(motion.rotations, motion.translation_m + place)
    shape = BodyShape(np.zeros(len(space)), space.base_stature_m)
    return camera.project(KeypointSpace(space).of(shape).positions(transforms))


def jitter(error_px: NDArray[np.float64]) -> float:
    """The part of an error faster than 0.1 s, root mean square."""
    return float(np.sqrt(np.mean((error_px - gaussian_filter1d(error_px, 3, axis=0)) ** 2)))


@pytest.mark.benchmark(group="landmarks")
def test_one_look(benchmark: object, video: VideoReader, models: LandmarkModels) -> None:
    picture = video.read(40)
    for threads in (1, 2):
        detector = PoseDetector(models.detector, threads)
        landmarker = PoseLandmarker(models.landmarker, threads)
        roi = detector.people(picture)[0].roi
        crop = roi.cut(picture)
        whole = 1e3 * best_s(partial(detector.people, picture), 20)
        one = 1e3 * best_s(partial(landmarker.on_crop, crop, roi), 20)
        both = 1e3 * best_s(partial(landmarker.on_both_sides, crop, roi), 20)
        print(f"\n{threads} threads: detection {whole:.1f} ms, one look {one:.1f} ms,", end="")
        print(f" from both sides {both:.1f} ms")
        assert both < 3.0 * one
    benchmark(lambda: landmarker.on_crop(crop, roi))  # type: ignore[operator]


@pytest.mark.benchmark(group="landmarks")
def test_the_second_pass(benchmark: object, video: VideoReader, models: LandmarkModels) -> None:
    truth = truth_px(video.timebase.times_s)
    landmarker = PoseLandmarker(models.landmarker, 2)
    roi = PoseDetector(models.detector, 2).people(video.read(0))[0].roi
    single = np.empty_like(truth)
    for frame in range(len(video)):
        pose = landmarker.in_picture(video.read(frame), roi)
        single[frame], roi = pose.image_px[:33], pose.next_roi
    spent, processor = time.perf_counter(), time.process_time()
    found = find_landmarks(video, models)
    track = found.part(0, len(found))
    spent, processor = time.perf_counter() - spent, time.process_time() - processor
    frames = len(video)
    print(f"\nboth passes {1e3 * spent / frames:.0f} ms per frame,", end="")
    print(f" {1e3 * processor / frames:.0f} ms of processor time")
    for name, rows in (("trunk and knees", TRUNK), ("wrists", WRISTS)):
        before, after = (jitter((each - truth)[:, rows]) for each in (single, track.image_px))
        print(f"jitter of {name}: {before:.2f} px followed, {after:.2f} px looked at again")
        assert after < 0.75 * before
    benchmark.pedantic(lambda: None)  # type: ignore[attr-defined]
