from __future__ import annotations

import math

import numpy as np
import pytest

from sd2core.body.camera import PinholeCamera
from sd2core.body.shaping import overlap, silhouette
from sd2core.compare.measures import (
    correlation,
    jitter,
    line_of_sight_velocity,
    rms,
)

TIMES = np.arange(40) / 30.0


def moving(velocity: tuple[float, float, float], times_s: np.ndarray = TIMES) -> np.ndarray:
    """Two points that move alike, (T, 2, 3)."""
    start = np.array([[0.0, 0.0, 3.0], [0.4, -0.3, 2.5]])
    return start + times_s[:, None, None] * np.array(velocity)


def test_a_point_on_the_axis_approaches_at_its_own_speed() -> None:
    velocity = line_of_sight_velocity(moving((0.0, 0.0, -0.7)), TIMES)
    np.testing.assert_allclose(velocity[:, 0], 0.7, atol=1e-12)


def test_velocity_is_the_exact_change_of_range() -> None:
    """Also of uneven times, of a sensor elsewhere, and at both ends."""
    times = TIMES + 0.004 * np.sin(7.0 * np.arange(40))
    path, sensor = moving((0.8, -0.2, 0.3), times), np.array([0.5, 0.1, 0.2])
    ranges = np.linalg.norm(path - sensor, axis=-1)
    velocity = line_of_sight_velocity(path, times, sensor)
    expected = -(ranges[2:] - ranges[:-2]) / (times[2:] - times[:-2])[:, None]
    np.testing.assert_allclose(velocity[1:-1], expected, atol=1e-12)
    np.testing.assert_allclose(
        velocity[0], -(ranges[1] - ranges[0]) / (times[1] - times[0]), atol=1e-12
    )
    np.testing.assert_allclose(
        velocity[-1], -(ranges[-1] - ranges[-2]) / (times[-1] - times[-2]), atol=1e-12
    )


def test_motion_around_the_sensor_has_no_velocity_along_the_line_of_sight() -> None:
    angle = 0.5 * TIMES
    path = 2.0 * np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)[:, None]
    assert np.abs(line_of_sight_velocity(path, TIMES)).max() < 1e-12


def test_noise_of_positions_is_known_in_velocities() -> None:
    """White noise of 1 mm gives √2 · 1 mm / (2 / 30 s) of central difference."""
    times = np.arange(4000) / 30.0
    still = np.zeros((4000, 6, 3)) + np.array([0.0, 0.0, 50.0])
    noisy = still + np.random.default_rng(0).normal(scale=0.001, size=still.shape)
    velocity = line_of_sight_velocity(noisy, times)[1:-1]
    assert rms(velocity) == pytest.approx(math.sqrt(2) * 0.001 * 15.0, rel=0.02)


def test_equals_are_equal() -> None:
    values = np.random.default_rng(1).normal(size=(30, 4))
    assert rms(values - values) == 0.0
    assert correlation(values, values) == 1.0
    assert correlation(2 * values - 5, values) == pytest.approx(1.0)
    assert correlation(-values, values) == pytest.approx(-1.0)


def test_what_does_not_change_has_no_correlation() -> None:
    assert math.isnan(correlation(np.zeros(5), np.arange(5.0)))


def test_jitter_of_a_parabola_is_nothing_and_of_a_cubic_its_third_derivative() -> None:
    x = TIMES[:, None, None] * np.ones(3)
    assert jitter(1 + 2 * x + 3 * x**2, TIMES).max() < 1e-6
    assert jitter(x**3 * [1, 0, 0], TIMES)[0] == pytest.approx(6.0)


def test_overlap_of_shifted_rectangles() -> None:
    one, other = np.zeros((2, 40, 50), bool)
    one[10:30, 10:30] = True
    other[10:30, 15:35] = True
    assert overlap(one, one) == 1.0
    assert overlap(one, other) == pytest.approx(15 / 25)
    assert overlap(one, ~one) == 0.0
    assert math.isnan(overlap(one & False, one & False))


@pytest.mark.parametrize("size", [None, (64, 48), (160, 60)])
def test_the_silhouette_of_a_square_plate(size: tuple[int, int] | None) -> None:
    """Half a metre square at 2 m: 150 pixels of 640, in any size of the mask."""
    x, y = np.meshgrid([-0.25, 0.25], [-0.25, 0.25])
    plate = np.stack([x.ravel(), y.ravel(), np.full(4, 2.0)], axis=1)
    faces = np.array([[0, 2, 1], [1, 2, 3]], np.int32)  # towards the camera
    camera = PinholeCamera()
    mask = silhouette(plate, faces, camera, size)
    width, height = size or (640, 480)
    assert mask.shape == (height, width)
    rows, columns = np.nonzero(mask)
    assert np.ptp(columns) + 1 == pytest.approx(150 * width / 640, abs=1)
    assert np.ptp(rows) + 1 == pytest.approx(150 * height / 480, abs=1)
    assert columns.mean() + 0.5 == pytest.approx(width / 2, abs=0.6)


def test_what_is_behind_the_camera_is_not_in_the_picture() -> None:
    corners = np.array([[-1.0, 0, 2], [1, 0, 2], [0, 1, 2], [0, 0.5, -1]])
    faces = np.array([[0, 2, 1], [0, 3, 1], [0, 1, 3]], np.int32)
    camera = PinholeCamera()
    np.testing.assert_array_equal(
        silhouette(corners, faces, camera), silhouette(corners[:3], faces[:1], camera)
    )
