"""Vertices under the pointer, by closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2app.scene.inertial import vertex_under

SQUARE = np.array([(0, 0), (10, 0), (10, 10), (0, 10)], float)
FACES = np.array([(0, 1, 2), (0, 2, 3)], np.int32)


def at_depth(*depths: float) -> np.ndarray:
    """Pixels of squares one behind the other."""
    return np.concatenate([np.column_stack([SQUARE, np.full(4, one)]) for one in depths])


@given(st.floats(0.01, 9.99), st.floats(0.01, 9.99))
def test_the_nearest_corner_of_a_square_is_found(x: float, y: float) -> None:
    found = vertex_under(at_depth(2.0), FACES, x, y)
    away = np.hypot(*(SQUARE - (x, y)).T)
    # Of the triangle that is hit, in which the nearest corner of the square may be missing.
    triangle = FACES[0] if y < x else FACES[1]
    assert found in triangle
    assert away[found] == pytest.approx(away[triangle].min())


@given(st.floats(-20, 30), st.floats(-20, 30))
def test_nothing_is_found_beside_the_surface(x: float, y: float) -> None:
    if not (0 <= x <= 10 and 0 <= y <= 10):
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
    slanted = np.column_stack([SQUARE, [1.0, 3.0, 3.0, 1.0]])
    pixels = np.concatenate([slanted, at_depth(2.0)])
    faces = np.concatenate([FACES, FACES + 4])
    # In the picture the inverse of the depth is linear: 1/2 is at three quarters of the way.
    assert vertex_under(pixels, faces, 7.0, 1.0) == 1
    assert vertex_under(pixels, faces, 8.0, 1.0) == 5


def test_triangles_without_area_are_no_surface() -> None:
    pixels = np.column_stack([np.full((3, 2), 5.0), np.full(3, 2.0)])
    assert vertex_under(pixels, np.array([(0, 1, 2)], np.int32), 5.0, 5.0) is None
