"""The camera that took a video: a pinhole at the origin of the camera frame."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error

DEFAULT_FIELD_OF_VIEW_DEG = 2.0 * math.degrees(math.atan(320.0 / 600.0))
"""Across the longer side, where neither file nor user says: 56°, a webcam's or phone's."""


@dataclass(frozen=True)
class PinholeCamera:
    """A camera in the camera frame's origin, looking along +z.

    A point (x, y, z) is seen at pixel coordinates
    (width / 2 + f x / z, height / 2 + f y / z); the centre of pixel (row, column) is
    at (column + 0.5, row + 0.5).

    Parameters
    ----------
    width, height : int
        Pixels.
    focal_px : float
    """

    width: int = 640
    height: int = 480
    focal_px: float = 600.0

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1 or not 0.0 < self.focal_px < math.inf:
            raise Sd2Error(
                f"The camera is {self.width} × {self.height} pixels, focal length {self.focal_px}",
                "positive numbers",
            )

    @classmethod
    def default(cls, width: int, height: int) -> PinholeCamera:
        """A camera of :data:`DEFAULT_FIELD_OF_VIEW_DEG` for pictures of this size."""
        half = math.radians(DEFAULT_FIELD_OF_VIEW_DEG) / 2.0
        return cls(width, height, max(width, height) / 2.0 / math.tan(half))

    @property
    def centre_px(self) -> NDArray[np.float64]:
        """Where the optical axis meets the picture, (2,)."""
        return np.array([self.width, self.height]) / 2.0

    def project(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Pixel coordinates (..., 2) of points (..., 3) in front of the camera."""
        return self.focal_px * points_m[..., :2] / points_m[..., 2:] + self.centre_px

    def slopes(self, points_px: NDArray[np.float64]) -> NDArray[np.float64]:
        """X / z and y / z of what is seen at pixel coordinates (..., 2)."""
        return (points_px - self.centre_px) / self.focal_px
