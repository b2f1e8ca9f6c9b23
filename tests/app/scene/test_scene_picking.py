"""Surfaces under the pointer, by closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2app.scene.camera import EyePose

POSE = EyePose(azimuth_deg=20.0, elevation_deg=-10.0)
SQUARE = np.array([(0, 0), (10, 0), (10, 10), (0, 10)], float)
FACES = np.array([(0, 1, 2), (0, 2, 3)], np.int32)


def in_the_world(pixels: np.ndarray, depths: np.ndarray) -> np.ndarray:
    """Points that are seen at pixels (n, 2) in depths (n,)."""
    rays = np.stack([POSE.ray(*pixel) for pixel in pixels])
    return POSE.position + depths[:, None] * rays


def at_depth(*depths: float) -> np.ndarray:
    """Squares one behind the other."""
    return np.concatenate([in_the_world(SQUARE, np.full(4, one)) for one in depths])


def vertex_under(vertices: np.ndarray, faces: np.ndarray, x: float, y: float) -> int | None:
    hit = POSE.foremost((vertices, faces), x, y)
    return None if hit is None else hit[1]


@given(st.floats(0.01, 9.99), st.floats(0.01, 9.99))
def test_the_nearest_corner_of_a_square_is_found(x: float, y: float) -> None:
    found = vertex_under(at_depth(2.0), FACES, x, y)
    away = np.hypot(*(SQUARE - (x, y)).T)
    assert found is not None
    # Of a triangle that is hit, in which the nearest corner of the square may be missing.
    best = [away[triangle].min() for triangle in FACES if found in triangle]
    assert away[found] == pytest.approx(min(best), abs=1e-6)
    if abs(x - y) > 1e-6:
        assert found in (FACES[0] if y < x else FACES[1])


@given(st.floats(-20, 30), st.floats(-20, 30))
def test_nothing_is_found_beside_the_surface(x: float, y: float) -> None:
    if not (-1e-6 <= x <= 10 + 1e-6 and -1e-6 <= y <= 10 + 1e-6):
        assert vertex_under(at_depth(2.0), FACES, x, y) is None


@pytest.mark.parametrize("turned", [False, True])
def test_the_foremost_of_two_is_found_whichever_way_it_faces(turned: bool) -> None:
    faces = np.concatenate([FACES, FACES + 4])
    faces = faces[:, ::-1] if turned else faces
    assert vertex_under(at_depth(2.0, 1.5), faces, 9.0, 8.0) == 6
    assert vertex_under(at_depth(1.5, 2.0), faces, 9.0, 8.0) == 2
    assert vertex_under(at_depth(-1.5, 2.0), faces, 9.0, 8.0) == 6  # the other is behind the eye


def test_a_slanted_surface_is_in_front_where_it_is() -> None:
    """A triangle from 1 m to 3 m crosses one at 2 m: half of it is hidden."""
    slanted = in_the_world(SQUARE, np.array([1.0, 3.0, 3.0, 1.0]))
    vertices = np.concatenate([slanted, at_depth(2.0)])
    faces = np.concatenate([FACES, FACES + 4])
    # In the picture the inverse of the depth is linear: 1/2 is at three quarters of the way.
    assert vertex_under(vertices, faces, 7.0, 1.0) == 1
    assert vertex_under(vertices, faces, 8.0, 1.0) == 5
    hit = POSE.foremost((slanted, FACES), 7.5, 1.0)
    assert hit is not None
    assert hit[0] == pytest.approx(2.0)


def test_a_surface_that_reaches_behind_the_eye_is_found() -> None:
    right, down, forward = POSE.axes
    vertices = POSE.position + np.stack([forward - right, right - forward + down, 0.5 * forward])
    place = (0.7, 0.2, 0.1) @ vertices
    x, y, depth = POSE.project(place)[0]
    hit = POSE.foremost((vertices, np.array([(0, 1, 2)], np.int32)), x, y)
    assert hit is not None
    assert hit[0] == pytest.approx(depth)
    assert hit[1] in (0, 2)  # the other has no pixel


def test_triangles_without_area_are_no_surface() -> None:
    vertices = in_the_world(np.full((3, 2), 5.0), np.full(3, 2.0))
    assert vertex_under(vertices, np.array([(0, 1, 2)], np.int32), 5.0, 5.0) is None
    assert vertex_under(vertices, np.zeros((0, 3), np.int32), 5.0, 5.0) is None
