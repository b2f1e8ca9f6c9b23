"""Squares in pictures, turned with the person in them, and their path through a video."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sd2core.mesh.presence import runs

Pixels = NDArray[np.uint8]
Floats = NDArray[np.float64]

CROP_PX = 256
"""Side of what the landmark network sees."""

_CENTRE_S = 0.2
_SIZE_S = 0.5
_ANGLE_S = 0.5
MARGIN = 1.25
"""Side of the square over the diameter of the person's circle."""


@dataclass(frozen=True)
class Roi:
    """A square in the picture, turned so that the person in it stands upright.

    Pixel coordinates; the centre of the first pixel is at 0.5. The angle is clockwise, as seen in
    the picture.
    """

    centre_x_px: float
    centre_y_px: float
    size_px: float
    angle_rad: float = 0.0

    @classmethod
    def around(cls, centre_px: Floats, rim_px: Floats) -> Roi:
        """Square around a person whose hips are at ``centre_px``.

        ``rim_px`` lies above the head, on the circle around the person.
        """
        dx, dy = (float(value) for value in np.subtract(rim_px, centre_px))
        angle = math.pi / 2.0 - math.atan2(-dy, dx)
        return cls(
            float(centre_px[0]),
            float(centre_px[1]),
            2.0 * MARGIN * math.hypot(dx, dy),
            math.remainder(angle, math.tau),
        )

    def scaled(self, factor: float) -> Roi:
        """Square of another size around the same point."""
        return replace(self, size_px=factor * self.size_px)

    def matrix(self, crop_px: int = CROP_PX) -> Floats:
        """Map (2, 3) from pixel coordinates (x, y, 1) of the crop to those of the picture."""
        scale = self.size_px / crop_px
        c, s = scale * math.cos(self.angle_rad), scale * math.sin(self.angle_rad)
        half = crop_px / 2.0
        return np.array(
            [
                [c, -s, self.centre_x_px - (c - s) * half],
                [s, c, self.centre_y_px - (s + c) * half],
            ]
        )

    def cut(self, picture: Pixels, crop_px: int = CROP_PX) -> Pixels:
        """Crop (crop_px, crop_px, 3) of the square; black outside the picture."""
        import cv2

        # OpenCV counts from the centre of the first pixel, we from its corner.
        centred = self.matrix(crop_px)
        centred[:, 2] += centred[:, :2] @ [0.5, 0.5] - 0.5
        return cv2.warpAffine(
            picture,
            centred,
            (crop_px, crop_px),
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_CONSTANT,
        )


PLACES = ("left of the person", "right of the person", "without the person", "like the person")
"""Where others are, as the picture shows them."""


@dataclass(frozen=True, eq=False)
class Sightings:
    """Frames in which the person was searched for."""

    frames: NDArray[np.intp]  # (N,) ascending
    rois: Floats  # (N, 4) centre x and y, size, angle of the square; NaN where not found
    confidence: Floats  # (N,)
    unclear: NDArray[np.bool_]  # (N,) whoever is seen may be another person
    others: NDArray[np.bool_]  # (N, 4) somebody else is seen in each of PLACES

    def unclear_frames(self, frames: int) -> NDArray[np.bool_]:
        """Frames (T,) of a video whose nearest sighting is not clear."""
        after = np.searchsorted(self.frames, np.arange(frames)).clip(1, len(self.frames) - 1)
        middle = (self.frames[after - 1] + self.frames[after]) / 2.0
        return self.unclear[np.where(np.arange(frames) <= middle, after - 1, after)]


def apart_px(one: Roi, two: Roi) -> float:
    """Distance between the centres of two squares."""
    return float(np.hypot(one.centre_x_px - two.centre_x_px, one.centre_y_px - two.centre_y_px))


def roi_numbers(roi: Roi) -> Floats:
    """Row of :attr:`Sightings.rois`."""
    return np.array([roi.centre_x_px, roi.centre_y_px, roi.size_px, roi.angle_rad])


def roi_of(row: Floats) -> Roi | None:
    """Square of a row of :attr:`Sightings.rois`; None where it is NaN."""
    if np.isnan(row[0]):
        return None
    return Roi(*(float(number) for number in row))


def roi_path(sightings: Sightings, times_s: Floats) -> Floats:
    """Smooth path (T, 4) of the square through every frame, without lag.

    Rows as in :attr:`Sightings.rois`; NaN where the person was not found in the sightings before
    and after.
    """
    path = np.full((len(times_s), 4), np.nan)
    sighted = np.isfinite(sightings.rois[:, 0])
    # Stretches of sightings in which the person was never lost.
    for start, stop in runs(sighted):
        frames = sightings.frames[start:stop]
        times = times_s[frames]
        rois = sightings.rois[start:stop].copy()
        rois[:, 2] = np.log(rois[:, 2])
        rois[:, 3] = np.unwrap(rois[:, 3])
        smooth = np.concatenate(
            [
                smooth_over_time(times, rois[:, :2], _CENTRE_S),
                smooth_over_time(times, rois[:, 2:3], _SIZE_S),
                smooth_over_time(times, rois[:, 3:], _ANGLE_S),
            ],
            axis=1,
        )
        inside = np.arange(frames[0], frames[-1] + 1)
        for number, column in enumerate(smooth.T):
            path[inside, number] = np.interp(times_s[inside], times, column)
        for frame in inside:
            path[frame, 2] = math.exp(path[frame, 2])
            path[frame, 3] = math.remainder(path[frame, 3], math.tau)
    return path


def smooth_over_time(times_s: Floats, values: Floats, sigma_s: float) -> Floats:
    """Smooth values (N, K) by a line fitted around each time with Gaussian weights.

    Straight lines stay as they are, to the very ends; times may be uneven.
    """
    ahead = np.searchsorted(times_s, times_s + 3.0 * sigma_s) - np.arange(len(times_s))
    reach = min(int(ahead.max(initial=0)), len(times_s) - 1)
    rows = np.arange(len(times_s))
    sums = np.zeros((3, len(times_s)))  # of the weights times 1, t and t²
    products = np.zeros((2, *values.shape))
    for step in range(-reach, reach + 1):
        other = np.clip(rows + step, 0, len(rows) - 1)
        t = times_s[other] - times_s
        weights = np.where(rows + step == other, np.exp(-0.5 * (t / sigma_s) ** 2), 0.0)
        for power in range(3):
            sums[power] += weights * t**power
        for power in range(2):
            products[power] += (weights * t**power)[:, None] * values[other]
    spread = sums[0] * sums[2] - sums[1] ** 2
    line = spread > 1e-9 * sums[0] ** 2 * sigma_s**2
    mean = products[0] / sums[0][:, None]
    fitted = (sums[2][:, None] * products[0] - sums[1][:, None] * products[1]) / np.where(
        line, spread, 1.0
    )[:, None]
    return np.where(line[:, None], fitted, mean)
