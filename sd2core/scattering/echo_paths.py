"""Ways of an echo from a sensor to a body and back: directly, or one way by a wall.

By the image method a wall's way there (or back) is the straight one from (or to) the sensor's
image behind the wall. Sensor → wall → body → sensor and the reverse are as long as each other:
half their length and of its change are the means of both ends'.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.mesh.walls import Wall
from sd2core.scattering.amplitude import NEAREST_RANGE_M
from sd2core.scattering.beam import angles_deg, one_way, sensor_axes
from sd2core.sensor import VirtualSensor


@dataclass(frozen=True, eq=False)
class EchoPath:
    """Two ends of the way of an echo, which are one where it is direct."""

    sensor: VirtualSensor
    ends_m: NDArray[np.float64]  # (1 or 2, 3), in the camera frame: the sensor, and its image
    axes: NDArray[np.float64]  # of each end: right, down and ahead, (1 or 2, 3, 3)
    share: float = 1.0
    """Of the power that passes: 10^(-loss / 10) of two equal ways by a wall. Powers add up."""
    wall: Wall | None = None

    def gain(self, points_m: NDArray[Any], ends: NDArray[np.float64]) -> NDArray[np.float64]:
        """Share of an echo's power that the beam lets pass, there and back, (V,).

        Points (3, V) and ends (1 or 2, 3) are in one frame.
        """
        if self.sensor.beam is None:
            return np.ones(points_m.shape[1])
        gains = [
            one_way(self.sensor.beam, *angles_deg(axes, points_m - end[:, None]))
            for axes, end in zip(self.axes, ends, strict=True)
        ]
        return gains[0] * gains[-1]


def echo_paths(sensor: VirtualSensor, walls: Iterable[Wall] = ()) -> list[EchoPath]:
    """Direct way, and that by each wall which the sensor is before."""
    place, axes = np.asarray(sensor.position_m, np.float64), sensor_axes(sensor)
    paths = [EchoPath(sensor, place[None], axes[None])]
    for wall in walls:
        if wall.before_m(place) > 0:
            turned = axes - 2.0 * np.outer(axes @ wall.outward, wall.outward)
            ends_m = np.stack([place, wall.mirrored(place)])
            share = 2.0 * 10.0 ** (-0.1 * wall.loss_db)
            paths.append(EchoPath(sensor, ends_m, np.stack([axes, turned]), share, wall))
    return paths


def mean_distance_m(points_m: NDArray[Any], ends: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance (V,) whose square is the product of those of points (3, V) from both ends."""
    each = [
        np.maximum(np.linalg.norm(points_m - end[:, None], axis=0), NEAREST_RANGE_M) for end in ends
    ]
    return each[0] if len(each) == 1 else np.asarray(np.sqrt(each[0] * each[1]))
