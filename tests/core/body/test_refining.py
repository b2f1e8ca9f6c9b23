"""Second pass over a video: which frames are looked at, and what the others get."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest

from sd2core.body.blazepose import POINTS, Pose
from sd2core.body.refining import RefinedFrames, Refiner
from sd2core.body.roi import Roi
from sd2core.timebase import Timebase

ROI = Roi(160.0, 120.0, 200.0)
Path = Callable[[float], float]


class Landmarker:
    """Finds a person whose hand goes a known way; the picture says which frame it is."""

    def __init__(self, frames_per_s: float, path: Path, gone: range = range(0)) -> None:
        self._frames_per_s, self._path, self._gone = frames_per_s, path, gone
        self.looked: list[int] = []

    def on_both_sides(self, crop: np.ndarray, roi: Roi) -> Pose:
        number = int(crop.max()) - 1
        self.looked.append(number)
        points = np.full((POINTS, 2), 120.0)
        points[15] += [self._path(number / self._frames_per_s), 0.0]
        points[33], points[34] = (160.0, 120.0), (160.0, 40.0)
        ones = np.ones(33)
        sure = 0.1 if number in self._gone else 1.0
        mask = np.zeros((256, 256), np.float32)
        return Pose(points, ones, np.ones((33, 3)), ones, ones, sure, mask, roi)


def refined(
    frames_per_s: float, path: Path, frames: int = 90, gone: range = range(0)
) -> tuple[RefinedFrames, list[int]]:
    landmarker = Landmarker(frames_per_s, path, gone)
    video = SimpleNamespace(
        width=320,
        height=240,
        timebase=Timebase(np.arange(frames) / frames_per_s),
        read=lambda frame: np.full((240, 320, 3), frame + 1, np.uint8),
    )
    with Refiner([landmarker]) as refiner:  # type: ignore[list-item]
        found = refiner.stretch(video, 0, [ROI] * frames, frozenset(), lambda *_: None)  # type: ignore[arg-type]
    return found, sorted(landmarker.looked)


def slowly(time_s: float) -> float:
    return 20.0 * np.sin(2.0 * np.pi * 0.5 * time_s)


def quickly(time_s: float) -> float:
    return 60.0 * np.sin(2.0 * np.pi * 3.0 * time_s)


@pytest.mark.parametrize("frames_per_s", [30.0, 60.0, 120.0])
def test_what_is_slow_is_looked_at_fifteen_times_a_second(frames_per_s: float) -> None:
    found, looked = refined(frames_per_s, slowly)
    each = round(frames_per_s / 15.0)
    # Of the ends it is not known whether something is fast.
    inner = [number for number in looked if each <= number < 90 - 2 * each]
    assert inner == [number for number in range(90) if number % each == 0 and number in inner]
    assert len(inner) >= (90 - 3 * each) // each
    truth = [120.0 + slowly(number / frames_per_s) for number in range(90)]
    np.testing.assert_allclose(found.image_px[:, 15, 0], truth, atol=0.05)
    assert (found.confidence == 1.0).all()
    assert (found.visibility == 1.0).all()


def test_what_is_fast_is_looked_at_in_every_frame() -> None:
    found, looked = refined(30.0, quickly)
    assert looked == list(range(90))
    truth = [120.0 + quickly(number / 30.0) for number in range(90)]
    np.testing.assert_allclose(found.image_px[:, 15, 0], truth, atol=1e-3)


def test_a_slow_camera_has_every_frame_looked_at() -> None:
    assert refined(15.0, slowly)[1] == list(range(90))


def test_beside_a_gap_every_frame_is_looked_at() -> None:
    found, looked = refined(30.0, slowly, gone=range(40, 51))
    assert set(range(37, 54)) <= set(looked)
    assert not found.confidence[40:51].any()
    assert np.isnan(found.image_px[40:51]).all()
    assert (found.confidence[[39, 51]] == 1.0).all()
