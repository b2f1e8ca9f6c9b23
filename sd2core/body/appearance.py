"""How a person looks, to tell one from another who crosses their way."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sd2core.body.blazepose import Pose
from sd2core.body.roi import CROP_PX, Floats, Pixels
from sd2core.body.track import LANDMARKS

Signature = NDArray[np.float32]
"""Histograms of colour of torso and thighs, shape (2, 512); each adds up to 1, or is 0."""

_SMALL_PX = 64
_BINS = 8
_SHOULDERS, _HIPS, _KNEES = (
    [LANDMARKS.index(f"{name}.L"), LANDMARKS.index(f"{name}.R")]
    for name in ("shoulder", "hip", "knee")
)


def signature(crop: Pixels, pose: Pose) -> Signature:
    """Colours of a person in a crop of :data:`CROP_PX` pixels."""
    import cv2

    size = (_SMALL_PX, _SMALL_PX)
    small = cv2.cvtColor(cv2.resize(crop, size, interpolation=cv2.INTER_AREA), cv2.COLOR_RGB2LAB)
    person = cv2.resize(pose.mask, size, interpolation=cv2.INTER_AREA) > 0.5
    heights = _in_crop(pose)[:, 1] * (_SMALL_PX / CROP_PX)
    top, middle, end = (float(heights[rows].mean()) for rows in (_SHOULDERS, _HIPS, _KNEES))
    rows = np.arange(_SMALL_PX)[:, None]
    cells = (small // (256 // _BINS)).astype(np.intp)
    numbers = (cells[..., 0] * _BINS + cells[..., 1]) * _BINS + cells[..., 2]
    return np.stack(
        [
            _histogram(numbers[person & (rows >= upper) & (rows < lower)])
            for upper, lower in ((top, middle), (middle, end))
        ]
    )


def similarity(one: Signature, two: Signature) -> float:
    """From 0, nothing in common, to 1, the same colours."""
    both = (one.any(axis=1)) & (two.any(axis=1))
    if not both.any():
        return 0.0
    return float(np.sqrt(one[both] * two[both]).sum(axis=1).mean())


def _histogram(numbers: NDArray[np.intp]) -> NDArray[np.float32]:
    counts = np.bincount(numbers, minlength=_BINS**3).astype(np.float32)
    cube = counts.reshape(_BINS, _BINS, _BINS)
    # Spread over neighbouring bins: a little more light must not change everything.
    for axis in range(3):
        padded = np.pad(cube, [(1, 1) if each == axis else (0, 0) for each in range(3)], "edge")
        ahead, behind = (np.take(padded, np.arange(_BINS) + step, axis) for step in (2, 0))
        cube = 0.5 * cube + 0.25 * (ahead + behind)
    total = cube.sum()
    return (cube / total if total > 0 else cube).ravel()


def _in_crop(pose: Pose) -> Floats:
    matrix = pose.roi.matrix()
    return np.asarray((pose.image_px - matrix[:, 2]) @ np.linalg.inv(matrix[:, :2]).T)
