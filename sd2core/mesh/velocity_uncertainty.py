"""Uncertainty of the velocities of a fitted mesh, limb by limb."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sd2core.errors import Sd2Error

_MAX_LIMBS = 255


@dataclass(frozen=True, eq=False)
class VelocityUncertainty:
    """Standard deviations of the velocities of a body's limbs.

    A video shows motion across the view well and motion along the line of sight badly,
    so there are two of them, and a sensor elsewhere sees a mixture
    (:meth:`towards`). All vertices of a limb are wrong by the same velocity; limbs are
    wrong independently of each other (docs/decisions/0021).
    """

    limbs: tuple[str, ...]  # Names, L of them.
    vertex_limb: NDArray[np.uint8]  # Limb that each vertex follows, (V,).
    along_mps: NDArray[np.float32]  # Along the line from the camera to the limb, (T, L).
    across_mps: NDArray[np.float32]  # In any direction at right angles to that line, (T, L).
    camera_m: tuple[float, float, float] = (0.0, 0.0, 0.0)  # Of a body that was moved, its own.

    def __post_init__(self) -> None:
        limbs = tuple(str(name) for name in self.limbs)
        if not 0 < len(limbs) <= _MAX_LIMBS:
            raise Sd2Error(f"The uncertainty names {len(limbs)} limbs", f"1 to {_MAX_LIMBS}")
        which = np.array(self.vertex_limb)
        if which.ndim != 1 or which.dtype.kind not in "iu" or not which.size:
            raise Sd2Error(
                f"vertex_limb is of type {which.dtype} and shape {which.shape}",
                "one number of a limb per vertex",
            )
        if which.min() < 0 or which.max() >= len(limbs):
            raise Sd2Error(
                f"vertex_limb runs from {which.min()} to {which.max()}",
                f"numbers of limbs from 0 to {len(limbs) - 1}",
            )
        object.__setattr__(self, "limbs", limbs)
        object.__setattr__(self, "vertex_limb", which.astype(np.uint8))
        frames = np.shape(self.along_mps)[:1]
        for name in ("along_mps", "across_mps"):
            sigma = np.array(getattr(self, name))
            if sigma.shape != (*frames, len(limbs)) or sigma.dtype.kind not in "fiu":
                raise Sd2Error(
                    f"{name} is of type {sigma.dtype} and shape {sigma.shape}",
                    f"(frames, {len(limbs)} limbs), in m/s",
                )
            if not (np.isfinite(sigma).all() and (sigma >= 0).all()):
                raise Sd2Error(f"{name} holds numbers that are negative or not finite", "0 or more")
            object.__setattr__(self, name, sigma.astype(np.float32))

    @property
    def frame_count(self) -> int:
        """Number of frames T."""
        return len(self.along_mps)

    def of_vertices(self, columns: NDArray[np.integer[Any]]) -> VelocityUncertainty:
        """Uncertainty of some of the vertices."""
        return replace(self, vertex_limb=self.vertex_limb[columns])

    def of_frames(self, frames: NDArray[np.integer[Any]] | slice) -> VelocityUncertainty:
        """Uncertainty in some of the frames."""
        return replace(self, along_mps=self.along_mps[frames], across_mps=self.across_mps[frames])

    def times(self, factor: float) -> VelocityUncertainty:
        """Uncertainty of a mesh whose velocities are ``factor`` times as large."""
        return replace(self, along_mps=self.along_mps * factor, across_mps=self.across_mps * factor)

    def towards(
        self, sensor_m: ArrayLike, limbs_m: NDArray[np.floating[Any]], start: int = 0
    ) -> NDArray[np.float64]:
        """Standard deviation of each limb's velocity along the line to a sensor, m/s, (n, L).

        With the angle between the lines from the limb to the camera and to the sensor, σ² =
        σ_along² cos² + σ_across² sin². The sensor and the places of the limbs, (n, L, 3) in the
        frames from ``start`` on, are in the camera frame. Of two sensors (2, 3), the deviation
        of the mean of the velocities towards them.
        """
        place = np.asarray(limbs_m, np.float64)
        to_camera = np.asarray(self.camera_m, np.float64) - place
        lines = [end - place for end in np.atleast_2d(np.asarray(sensor_m, np.float64))]
        # On camera or sensor there is no line; the worse of the two is then taken.
        cosines, lengths = zip(*(_cosine(to_camera, line) for line in lines), strict=True)
        squared = np.clip(sum(cosines) / len(lines), -1.0, 1.0) ** 2
        # Square of the mean of unit vectors along these lines.
        level = 1.0 if len(lines) == 1 else 0.5 + 0.5 * _cosine(*lines)[0]
        frames = slice(start, start + len(place))
        along = self.along_mps[frames].astype(np.float64)
        across = self.across_mps[frames].astype(np.float64)
        sigma: NDArray[np.float64] = np.sqrt(
            squared * along**2 + np.maximum(level - squared, 0.0) * across**2
        )
        return np.where(np.min(lengths, axis=0) > 0, sigma, np.maximum(along, across))


def _cosine(
    one: NDArray[np.float64], other: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Cosine between vectors (..., 3), 1 where one of them is zero, and the product of lengths."""
    squares, others, product = (
        np.einsum("...i,...i", a, b) for a, b in ((one, one), (other, other), (one, other))
    )
    lengths = np.sqrt(squares) * np.sqrt(others)
    return np.divide(product, lengths, out=np.ones_like(lengths), where=lengths > 0), lengths
