from __future__ import annotations

import numpy as np
import pytest
import trimesh

from sd2core.body.model import Body
from tools.build_body.decimate import decimate


@pytest.mark.slow
def test_the_bundled_surface_comes_out_again() -> None:
    fine, coarse = Body.load("high"), Body.load("medium")
    rows, faces = decimate(fine.vertices_m, fine.faces, len(coarse.vertices_m))
    np.testing.assert_array_equal(fine.vertices_m[rows], coarse.vertices_m)
    np.testing.assert_array_equal(faces, coarse.faces)


def test_a_sphere_stays_closed_and_round() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3)
    rows, faces = decimate(ball.vertices, ball.faces.astype(np.int32), 200)
    coarse = trimesh.Trimesh(ball.vertices[rows], faces, process=False)
    assert len(rows) == 200
    assert coarse.is_watertight
    assert coarse.is_winding_consistent
    assert coarse.euler_number == 2
    assert 0.93 * ball.volume < coarse.volume < ball.volume


def test_a_torus_keeps_its_hole() -> None:
    ring = trimesh.creation.torus(1.0, 0.3, major_sections=32, minor_sections=16)
    rows, faces = decimate(ring.vertices, ring.faces.astype(np.int32), 120)
    coarse = trimesh.Trimesh(ring.vertices[rows], faces, process=False)
    assert coarse.is_watertight
    assert coarse.euler_number == 0


def test_flat_sides_cost_nothing() -> None:
    box = trimesh.creation.box().subdivide().subdivide().subdivide()
    rows, faces = decimate(box.vertices, box.faces.astype(np.int32), 60)
    coarse = trimesh.Trimesh(box.vertices[rows], faces, process=False)
    assert abs(coarse.volume - 1.0) < 1e-9


def test_a_tetrahedron_cannot_lose_a_vertex() -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], dtype=np.int32)
    rows, kept = decimate(points, faces, 3)
    np.testing.assert_array_equal(rows, np.arange(4))
    np.testing.assert_array_equal(kept, faces)
