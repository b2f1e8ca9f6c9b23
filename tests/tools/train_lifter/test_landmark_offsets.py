"""Offsets of the landmark model, measured back from what it sees."""

from __future__ import annotations

import numpy as np

from sd2core.body.camera import PinholeCamera
from sd2core.body.track import LANDMARKS
from tools.train_lifter.emulate import landmark_offsets
from tools.train_lifter.takes import Take


def test_offsets_are_measured_back_from_pictures() -> None:
    rng = np.random.default_rng(0)
    offsets = 0.02 * rng.standard_normal((33, 3))
    camera, stature_m = PinholeCamera(640, 480, 600.0), 1.7
    takes = []
    for _ in range(3):
        places = rng.normal([0.0, 0.0, 3.0], 0.3, (40, 33, 3))
        turns = np.linalg.qr(rng.standard_normal((40, 33, 3, 3)))[0]
        moved = stature_m * (turns @ offsets[:, :, None])[..., 0]
        # Seen at the keypoint's own depth, as the measurement takes it to be.
        seen = camera.project(np.concatenate([(places + moved)[..., :2], places[..., 2:]], -1))
        ones = np.ones((40, 33), np.float32)
        takes.append(
            Take(
                camera,
                stature_m,
                places.astype(np.float32),
                turns.astype(np.float32),
                seen.astype(np.float32),
                0.0 * ones,
                places.astype(np.float32),
                ones,
                ones[:, 0],
            )
        )
    np.testing.assert_allclose(landmark_offsets(takes), offsets, atol=2e-4)
    assert len(offsets) == len(LANDMARKS)
