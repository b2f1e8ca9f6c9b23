"""A second look at the mirror image of a picture, as the takes of the bundled lifter have it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sd2core.body.blazepose import POINTS, Pose, PoseLandmarker
from sd2core.body.roi import CROP_PX, Floats, Pixels, Roi
from sd2core.body.track import MIRRORED

_DISAGREEMENT = 0.04
_MIRRORED = list(MIRRORED)


def on_both_sides(landmarker: PoseLandmarker, crop: Pixels, roi: Roi) -> Pose:
    """Landmarks of the person in a crop and in its mirror image, averaged.

    The network is not symmetric. Where the two differ by much more than 4 % of the square, one of
    them has taken one hand for the other, and only the first counts.
    """
    one = landmarker.on_crop(crop, roi)
    mirror_image = np.ascontiguousarray(crop[:, ::-1])
    two = _unmirrored(landmarker.on_crop(mirror_image, _upright(roi)), roi)
    apart = np.hypot(*(one.image_px - two.image_px).T) / (_DISAGREEMENT * roi.size_px)
    share = 0.5 * np.exp(-(apart**2))  # (39,)
    body = share[:33]
    return replace(
        one,
        image_px=_mean(one.image_px, two.image_px, share),
        depth_px=_mean(one.depth_px, two.depth_px, body),
        world_m=_mean(one.world_m, two.world_m, body),
        visibility=_mean(one.visibility, two.visibility, body),
        presence=_mean(one.presence, two.presence, body),
        confidence=0.5 * (one.confidence + two.confidence),
        mask=0.5 * (one.mask + two.mask),
    )


def _upright(roi: Roi) -> Roi:
    """Square of the same size that is the whole picture: points are those of the crop."""
    return Roi(roi.size_px / 2.0, roi.size_px / 2.0, roi.size_px)


def _unmirrored(pose: Pose, roi: Roi) -> Pose:
    """Landmarks found in a mirror image, turned back into those of the square."""
    turned = roi.matrix()
    turn = turned[:, :2] / (roi.size_px / CROP_PX)
    points = pose.image_px[[*_MIRRORED, *range(33, POINTS)]] * [-1.0, 1.0] + [roi.size_px, 0.0]
    points = points @ turn.T + turned[:, 2]
    metres = pose.world_m[_MIRRORED] * [-1.0, 1.0, 1.0]
    metres[:, :2] = metres[:, :2] @ turn.T
    return Pose(
        image_px=points,
        depth_px=pose.depth_px[_MIRRORED],
        world_m=metres,
        visibility=pose.visibility[_MIRRORED],
        presence=pose.presence[_MIRRORED],
        confidence=pose.confidence,
        mask=pose.mask[:, ::-1],
        roi=roi,
    )


def _mean(one: Floats, two: Floats, share: Floats) -> Floats:
    """Weighted mean of rows, ``share`` (up to a half) of the second."""
    share = share.reshape(-1, *(1,) * (one.ndim - 1))
    return (1.0 - share) * one + share * two
