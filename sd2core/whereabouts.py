"""Where a body is during a clip, and the sensors that are placed around it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.mesh import MeshSequence
from sd2core.placements import Placements
from sd2core.sensor import Vector, VirtualSensor

_SAMPLED_FRAMES = 200


@dataclass(frozen=True, eq=False)
class Whereabouts:
    """Where a body is, from up to 200 frames with a person, spread over the clip.

    Parameters
    ----------
    target_m : tuple of 3 floats
        What sensors look at: the mean over time of the median vertex, which is inside the
        torso whatever the limbs do.
    low_m, high_m : arrays, shape (n, 3)
        Corners of the box around the body in each of these frames.
    """

    target_m: Vector
    low_m: NDArray[np.float64]
    high_m: NDArray[np.float64]

    @classmethod
    def of(cls, mesh: MeshSequence) -> Whereabouts:
        """Of a clip, which is read frame by frame.

        Raises
        ------
        Sd2Error
            When there is a person in no frame.
        """
        there = np.flatnonzero(mesh.presence.there)
        if not len(there):
            raise Sd2Error(
                f"{mesh.source or 'The mesh'} has a person in no frame",
                "somebody to place sensors around",
            )
        picked = there[np.linspace(0, len(there) - 1, min(len(there), _SAMPLED_FRAMES)).astype(int)]
        middle, low, high = np.empty((3, len(picked), 3))
        for row, frame in enumerate(picked):
            vertices = mesh.frame(int(frame))
            middle[row] = np.median(vertices, axis=0)
            low[row], high[row] = vertices.min(axis=0), vertices.max(axis=0)
        x, y, z = middle.mean(axis=0).tolist()
        return cls((x, y, z), low, high)

    def inside(self, sensors: Sequence[VirtualSensor]) -> NDArray[np.bool_]:
        """Which sensors stand in the box around the body at some time, shape (n,)."""
        result = np.zeros(len(sensors), dtype=bool)
        for number, sensor in enumerate(sensors):
            position = np.asarray(sensor.position_m)
            within = (self.low_m < position) & (position < self.high_m)  # (frames, 3)
            result[number] = bool(within.all(axis=1).any())
        return result

    def sensors(self, placements: Placements) -> tuple[VirtualSensor, ...]:
        """A sensor per place, aimed at the body.

        Raises
        ------
        Sd2Error
            When one would stand in the body.
        """
        sensors = placements.sensors(self.target_m)
        wrong = np.flatnonzero(self.inside(sensors))
        if len(wrong):
            raise Sd2Error(
                f"{len(wrong)} of {len(sensors)} placements stand in the body,"
                f" such as {placements.places()[wrong[0]].words}",
                "sensors outside the box around the body, at any time of the clip",
                "Place them farther away",
            )
        return sensors
