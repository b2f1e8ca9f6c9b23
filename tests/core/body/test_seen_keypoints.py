"""Where the landmark model sees landmarks beside the keypoints of a body."""

from __future__ import annotations

import numpy as np

from sd2core.body.keypoints import KeypointSpace, seen_beside
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.body.track import MIRRORED


def test_offsets_are_mirrored_and_a_matter_of_centimetres() -> None:
    offsets = seen_beside()
    np.testing.assert_allclose(offsets[list(MIRRORED)] * [-1.0, 1.0, 1.0], offsets)
    assert np.linalg.norm(offsets, axis=1).max() < 0.04


def test_seen_landmarks_grow_with_the_body() -> None:
    space = ShapeSpace()
    keypoints = KeypointSpace(space)
    small = BodyShape(np.zeros(len(space)), 1.5)
    tall = BodyShape(np.zeros(len(space)), 1.8)
    ratio = keypoints.seen_on(tall).rest_m - 1.2 * keypoints.seen_on(small).rest_m
    np.testing.assert_allclose(ratio, 0.0, atol=1e-12)
    assert (keypoints.seen_on(tall).bones == keypoints.of(tall).bones).all()
