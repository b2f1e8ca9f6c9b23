"""Takes for the tests of what is learnt from them."""

from __future__ import annotations

import numpy as np
import pytest

from sd2core.body.blazepose import CROP_PX, Pose, Roi
from tools.train_lifter.takes import Motion, Take, TakeMaker


class _PerfectLandmarker:
    """Says where a fixed person is, whatever the picture shows."""

    def on_crop(self, crop: np.ndarray, roi: Roi) -> Pose:
        assert crop.shape == (CROP_PX, CROP_PX, 3)
        middle = np.array([roi.centre_x_px, roi.centre_y_px])
        image = np.tile(middle, (39, 1)) + roi.size_px * 0.2 * np.sin(np.arange(78)).reshape(39, 2)
        image[33], image[34] = middle, middle - [0.0, roi.size_px / 2.5]
        ones = np.ones(33)
        mask = np.zeros((CROP_PX, CROP_PX), np.float32)
        world = np.sin(np.arange(99.0)).reshape(33, 3)
        return Pose(image, ones, world, ones, ones, 1.0, mask, roi)

    on_both_sides = on_crop


@pytest.fixture(scope="session")
def takes() -> list[Take]:
    maker = TakeMaker(_PerfectLandmarker(), Motion(seed=7))  # type: ignore[arg-type]
    return [maker.make(number, frames=24) for number in range(4)]
