"""The eye of the scene: projection, framing and dragging are exact."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sd2app.scene.camera import EyePose, Margins, drag_along, drag_in_view

SIZE = (640.0, 460.0)
coordinates = st.floats(-3.0, 3.0)
points = st.tuples(coordinates, coordinates, coordinates)
poses = st.builds(
    EyePose,
    focus=points,
    azimuth_deg=st.floats(-180.0, 180.0),
    elevation_deg=st.floats(-89.0, 89.0),
    distance_m=st.floats(4.0, 12.0),
    angle_deg=st.floats(15.0, 70.0),
    size_px=st.just(SIZE),
)
pixels = st.tuples(st.floats(0.0, SIZE[0]), st.floats(0.0, SIZE[1]))


@given(poses)
def test_axes_are_orthonormal_and_the_picture_stands_upright(pose: EyePose) -> None:
    axes = np.stack(pose.axes)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(np.cross(axes[0], axes[1]), axes[2], atol=1e-12)
    assert axes[0][1] == 0.0  # the horizon is level
    assert axes[1][1] > 0.0  # down in the picture is down in the world


def test_looking_along_z_shows_x_to_the_right_and_y_downwards() -> None:
    pose = EyePose(focus=(0.0, 0.0, 2.0), distance_m=2.0, size_px=SIZE)
    x, y, depth = pose.project([(0.1, 0.2, 2.0)])[0]
    assert x > SIZE[0] / 2
    assert y > SIZE[1] / 2
    assert depth == pytest.approx(2.0)


@given(poses, pixels, st.floats(0.5, 20.0))
def test_a_ray_goes_through_its_pixel(
    pose: EyePose, pixel: tuple[float, float], depth: float
) -> None:
    there = pose.position + depth * pose.ray(*pixel)
    np.testing.assert_allclose(pose.project(there)[0], (*pixel, depth), atol=1e-6)


def test_what_lies_behind_the_eye_has_no_pixel() -> None:
    x, y, depth = EyePose(focus=(0, 0, 2), distance_m=2, size_px=SIZE).project([(0, 0, -1)])[0]
    assert np.isnan(x)
    assert np.isnan(y)
    assert depth == pytest.approx(-1.0)


@given(poses, st.floats(-80, 80), st.floats(-80, 80))
def test_turning_keeps_focus_and_distance(pose: EyePose, dx: float, dy: float) -> None:
    turned = pose.orbited(dx, dy)
    x, y, depth = turned.project(pose.focus)[0]
    np.testing.assert_allclose((x, y, depth), (320.0, 230.0, pose.distance_m), atol=1e-6)


def test_turning_to_the_right_carries_the_near_side_to_the_right() -> None:
    pose = EyePose(focus=(0, 0, 3), distance_m=3, size_px=SIZE)
    near_side = (0.0, 0.0, 2.0)
    assert pose.orbited(10, 0).project(near_side)[0][0] > SIZE[0] / 2
    assert pose.orbited(0, 10).project(near_side)[0][1] > SIZE[1] / 2


@given(poses, st.floats(-100, 100), st.floats(-100, 100))
def test_shifting_carries_the_focus_with_the_pointer(pose: EyePose, dx: float, dy: float) -> None:
    x, y, _ = pose.panned(dx, dy).project(pose.focus)[0]
    np.testing.assert_allclose((x, y), (320.0 + dx, 230.0 + dy), atol=1e-6)


@given(poses, pixels, st.floats(0.5, 2.0))
def test_zooming_keeps_what_is_under_the_pointer(
    pose: EyePose, pixel: tuple[float, float], factor: float
) -> None:
    there = pose.position + pose.distance_m * pose.ray(*pixel)
    zoomed = pose.zoomed(factor, *pixel)
    assert zoomed.distance_m == pytest.approx(factor * pose.distance_m)
    np.testing.assert_allclose(zoomed.project(there)[0][:2], pixel, atol=1e-6)


@given(poses, st.lists(points, min_size=2, max_size=12, unique=True))
def test_framing_fits_every_point_and_not_farther_than_needed(
    pose: EyePose, where: list[tuple[float, float, float]]
) -> None:
    spread = np.ptp(np.asarray(where), axis=0).max()
    assume(spread > 0.05)
    margins = Margins(left=20, top=30, right=100, bottom=10)
    framed = pose.framed(where, margins)
    x, y, depth = framed.project(where).T
    assert (depth > 0).all()
    slack = 1e-6
    assert x.min() >= 20 - slack
    assert x.max() <= 540 + slack
    assert y.min() >= 30 - slack
    assert y.max() <= 450 + slack
    touches = (
        abs(x.min() - 20) + abs(x.max() - 540) < 1e-3
        or abs(y.min() - 30) + abs(y.max() - 450) < 1e-3
    )
    assert touches or depth.min() == pytest.approx(0.1)


@given(poses, points, pixels)
def test_a_drag_in_the_view_ends_under_the_pointer(
    pose: EyePose, start: tuple[float, float, float], pixel: tuple[float, float]
) -> None:
    depth = pose.project(start)[0][2]
    assume(depth > 0.2)
    moved = pose.project(drag_in_view(start, pose, *pixel))[0]
    np.testing.assert_allclose(moved, (*pixel, depth), atol=1e-6)


@given(poses, points, points, pixels)
def test_a_drag_along_a_line_stays_on_it_nearest_to_the_pointer(
    pose: EyePose,
    start: tuple[float, float, float],
    direction: tuple[float, float, float],
    pixel: tuple[float, float],
) -> None:
    assume(np.linalg.norm(direction) > 0.1)
    assume(pose.project(start)[0][2] > 0.2)
    moved = drag_along(start, direction, pose, *pixel)
    assume(moved is not None)
    offset = moved - np.asarray(start)
    length = max(float(np.linalg.norm(offset)), 1e-12)
    assert np.linalg.norm(np.cross(offset, direction)) <= 1e-6 * length * 5
    unit = np.asarray(direction) / np.linalg.norm(direction)
    along = pose.project([moved - 1e-4 * unit, moved, moved + 1e-4 * unit])[:, :2]
    away = np.linalg.norm(along - pixel, axis=1)
    assert away[1] <= away[0] + 1e-6
    assert away[1] <= away[2] + 1e-6


def test_a_line_that_points_at_the_eye_cannot_be_dragged_along() -> None:
    pose = EyePose(focus=(0, 0, 3), distance_m=3, size_px=SIZE)
    assert drag_along((0, 0, 2), (0, 0, 1), pose, 400.0, 300.0) is None
