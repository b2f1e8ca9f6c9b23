"""Radial velocity and counting at the extremes of distance, speed, rate, scale and place.

References are exact ranges in decimal arithmetic (see ``extreme_tables``). Every
tolerance is a number of roundings of the largest coordinate over the time between two
positions: a range is a distance, so it can be no better than the places it lies between.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from extreme_tables import Scene, every_scene, exact_velocities
from numpy.typing import NDArray

from sd2core.doppler.histogram import relative_range
from sd2core.precision import velocity_error_mps
from sd2core.scattering.velocity import radial_velocity

DOUBLE = 2.0**-53
POINTS = 60
EVERY_SCENE = pytest.mark.parametrize("scene", every_scene(), ids=str)


def ends(scene: Scene, count: int = POINTS) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions one frame before and one after, (3, count) each."""
    middle, step = scene.points(count), scene.step(count)
    return middle - step, middle + step


def largest(*arrays: Any) -> float:
    return float(max(np.abs(array).max() for array in arrays))


@EVERY_SCENE
def test_radial_velocity_in_double_precision(scene: Scene) -> None:
    before, after = ends(scene)
    truth = exact_velocities(before, after, scene.sensor_m, scene.duration_s)
    found = radial_velocity(before, after, scene.sensor_m, scene.duration_s)
    # The inputs are exact and every difference of two of them is rounded relative to
    # itself, so what is wrong is a few parts of the step (10 operations, 2 more to divide).
    speed = np.linalg.norm(after - before, axis=0).max() / scene.duration_s
    assert np.abs(found - truth).max() <= 12 * DOUBLE * speed
    assert np.isfinite(found).all()


@EVERY_SCENE
def test_single_precision_is_as_good_as_predicted(scene: Scene) -> None:
    before, after = ends(scene)
    truth = exact_velocities(before, after, scene.sensor_m, scene.duration_s)
    # As prepared: around an origin near the body, which is taken off in double precision.
    origin = np.full(3, scene.offset_m)
    place = scene.sensor_m - origin
    near = [(points - origin[:, None]) for points in (before, after)]
    tolerance = velocity_error_mps(largest(*near), scene.duration_s)
    first, last = (points.astype(np.float32) for points in near)
    ranges = [relative_range(points, place).astype(float) for points in (first, last)]
    for found in (
        (ranges[0] - ranges[1]) / scene.duration_s,
        radial_velocity(first, last, place, scene.duration_s),
    ):
        assert np.abs(found - truth).max() <= tolerance
