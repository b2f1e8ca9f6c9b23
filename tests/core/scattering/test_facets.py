"""Facets that a sensor sees: those of a ball's near side, wherever the ball is."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from facet_visibility import facet_visibility

from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.scattering.facets import visible_facets
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

BALL = trimesh.creation.icosphere(subdivisions=3)
POINTS = np.asarray(BALL.vertices)
FACES = np.asarray(BALL.faces, np.int32)


@pytest.mark.parametrize("offset_m", [(0, 0, 0), (1e6, -3e5, 2e6)])
def test_a_convex_body_shows_what_faces(offset_m: tuple[float, float, float]) -> None:
    vertices = POINTS + np.array([0.0, 0.0, 4.0]) + offset_m
    sensor = np.asarray(offset_m, float)
    expected = ((sensor - vertices[FACES].mean(axis=1)) * BALL.face_normals).sum(axis=1) > 0
    np.testing.assert_array_equal(visible_facets(vertices, FACES, sensor), expected)


def test_what_is_behind_is_hidden() -> None:
    near, far = POINTS + np.array([0, 0, 3]), 0.5 * POINTS + np.array([0, 0, 6])
    both = np.concatenate([near, far])
    faces = np.concatenate([FACES, FACES + len(near)])
    seen = visible_facets(both, faces, (0, 0, 0))
    assert seen[: len(FACES)].any()
    assert not seen[len(FACES) :].any()


def test_every_frame_has_its_own() -> None:
    paths = np.stack([POINTS + np.array([x, 0, 4]) for x in (-2, 0, 2)])
    mesh = MeshSequence(paths, FACES, Timebase.regular(3, 30.0))
    seen = facet_visibility(mesh, VirtualSensor())
    assert seen.shape == (3, len(FACES))
    for frame in range(3):
        np.testing.assert_array_equal(
            seen[frame], visible_facets(mesh.frame(frame), FACES, (0, 0, 0))
        )


def test_a_point_cloud_has_none() -> None:
    cloud = MeshSequence(np.zeros((1, 4, 3)), None, Timebase.regular(1, 30.0))
    with pytest.raises(Sd2Error, match="no faces"):
        facet_visibility(cloud, VirtualSensor())
