"""A square in a picture, turned with the person in it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.uint8]
Floats = NDArray[np.float64]

CROP_PX = 256
"""Side of what the landmark network sees."""

_MARGIN = 1.25
"""How much larger than the person's circle the square around it is."""


@dataclass(frozen=True)
class Roi:
    """A square in the picture, turned so that the person in it stands upright.

    Parameters
    ----------
    centre_x_px, centre_y_px : float
        Pixel coordinates; the centre of the first pixel is at 0.5.
    size_px : float
        Side of the square.
    angle_rad : float
        How far it is turned clockwise, as seen in the picture.
    """

    centre_x_px: float
    centre_y_px: float
    size_px: float
    angle_rad: float = 0.0

    @classmethod
    def around(cls, centre_px: Floats, rim_px: Floats) -> Roi:
        """The square around a person whose hips are at ``centre_px``.

        ``rim_px`` lies above the head, on the circle around the person.
        """
        dx, dy = (float(value) for value in np.subtract(rim_px, centre_px))
        angle = math.pi / 2.0 - math.atan2(-dy, dx)
        return cls(
            float(centre_px[0]),
            float(centre_px[1]),
            2.0 * _MARGIN * math.hypot(dx, dy),
            math.remainder(angle, math.tau),
        )

    def scaled(self, factor: float) -> Roi:
        """A square of another size around the same point."""
        return replace(self, size_px=factor * self.size_px)

    def matrix(self, crop_px: int = CROP_PX) -> Floats:
        """From pixel coordinates (x, y, 1) of the crop to those of the picture, (2, 3)."""
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
        """What is in the square, (crop_px, crop_px, 3); black outside the picture."""
        return _sampled(picture, self.matrix(crop_px), crop_px)


def _sampled(picture: Pixels, matrix: Floats, crop_px: int) -> Pixels:
    """The crop whose pixel coordinates ``matrix`` takes to the picture's."""
    import cv2

    # OpenCV counts from the centre of the first pixel, we from its corner.
    centred = matrix.copy()
    centred[:, 2] += matrix[:, :2] @ [0.5, 0.5] - 0.5
    crop: Pixels = cv2.warpAffine(
        picture,
        centred,
        (crop_px, crop_px),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_CONSTANT,
    )
    return crop
