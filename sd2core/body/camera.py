"""Pinhole camera of a video, and its focal length from the user, the file or a default."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.io.video import VideoReader
from sd2core.options.bounds import FIELD_OF_VIEW_DEG

DEFAULT_FIELD_OF_VIEW_DEG = 2.0 * math.degrees(math.atan(320.0 / 600.0))
"""Across the longer side, where neither file nor user says: 56°, a webcam's or phone's."""


@dataclass(frozen=True)
class PinholeCamera:
    """A camera in the camera frame's origin, looking along +z; all sizes are in pixels.

    A point (x, y, z) is seen at pixel coordinates
    (width / 2 + f x / z, height / 2 + f y / z); the centre of pixel (row, column) is at
    (column + 0.5, row + 0.5).
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
    def default(
        cls, width: int, height: int, field_of_view_deg: float = DEFAULT_FIELD_OF_VIEW_DEG
    ) -> PinholeCamera:
        """Camera for pictures of this size, by the angle across their longer side."""
        half = math.radians(field_of_view_deg) / 2.0
        return cls(width, height, max(width, height) / 2.0 / math.tan(half))

    @property
    def centre_px(self) -> NDArray[np.float64]:
        """Principal point, the middle of the picture, (2,)."""
        return np.array([self.width, self.height]) / 2.0

    def project(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Pixel coordinates (..., 2) of points (..., 3) in front of the camera."""
        return self.focal_px * points_m[..., :2] / points_m[..., 2:] + self.centre_px

    def slopes(self, points_px: NDArray[np.float64]) -> NDArray[np.float64]:
        """X / z and y / z of what is seen at pixel coordinates (..., 2)."""
        return (points_px - self.centre_px) / self.focal_px


Source = Literal["user", "metadata", "default"]
"""Source of a focal length, as recordings name it."""

# com.apple.quicktime.camera.focal_length.35mm_equivalent, FocalLengthIn35mmFormat, …
_EQUIVALENT = re.compile(r"focal.?length.*35.?mm", re.IGNORECASE)
_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:/\d+(?:\.\d+)?)?")
_DIAGONAL_35MM = math.hypot(36.0, 24.0)
_PLAUSIBLE_MM = (8.0, 800.0)


def camera_of(
    video: VideoReader, focal_px: float | None = None, field_of_view_deg: float | None = None
) -> tuple[PinholeCamera, Source]:
    """Camera of a video, and the source of its focal length.

    ``focal_px`` (of the upright picture) or ``field_of_view_deg`` (the angle across the
    longer side) is from the user. Source ``metadata``: focal length equivalent on 35 mm
    film, by the diagonal of the picture, as phones write it; ``default``: 56° across the
    longer side.

    Raises Sd2Error if both are given, or are impossible.
    """
    size = video.width, video.height
    if focal_px is not None and field_of_view_deg is not None:
        raise Sd2Error(
            "Both a focal length and a field of view are given", "one of them: each gives the other"
        )
    if focal_px is not None:
        return PinholeCamera(*size, float(focal_px)), "user"
    if field_of_view_deg is not None:
        check_field_of_view(field_of_view_deg)
        return PinholeCamera.default(*size, field_of_view_deg), "user"
    written = written_focal_mm(video.metadata)
    if written is not None:
        return PinholeCamera(*size, written * math.hypot(*size) / _DIAGONAL_35MM), "metadata"
    return PinholeCamera.default(*size), "default"


def check_field_of_view(angle_deg: float) -> None:
    """Refuse an angle that no camera has; Sd2Error."""
    if angle_deg not in FIELD_OF_VIEW_DEG:
        raise Sd2Error(
            f"The field of view is {angle_deg:g}°",
            f"{FIELD_OF_VIEW_DEG.low:g}° to {FIELD_OF_VIEW_DEG.high:g}°, across the longer side of"
            " the picture",
        )


def written_focal_mm(metadata: Mapping[str, str]) -> float | None:
    """35 mm equivalent focal length among a file's metadata, or None."""
    for name, value in metadata.items():
        match = _NUMBER.search(value) if _EQUIVALENT.search(name) else None
        if match is None:
            continue
        numerator, _, denominator = match[0].partition("/")
        focal_mm = float(numerator) / (float(denominator or 1) or math.nan)
        if _PLAUSIBLE_MM[0] <= focal_mm <= _PLAUSIBLE_MM[1]:
            return focal_mm
    return None
