"""Shapes around the mesh, and what makes the mesh cheap to draw."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sd2app.scene.shapes import (
    PYRAMID_POINTS,
    coarse_faces,
    cone,
    grid_rectangle,
    ground,
    is_closed_outward,
    pyramids,
)
from sd2core.placements.placements import Place
from sd2core.scattering.beam import half_power_rim, sensor_axes
from sd2core.sensor import Beam, VirtualSensor, direction_from_angles

TETRAHEDRON = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
OUTWARD = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])


@pytest.mark.parametrize("angle_deg", [20.0, 90.0, 150.0])
def test_the_rim_of_the_cone_is_half_the_width_of_the_beam_off_axis(angle_deg: float) -> None:
    points, triangles, wire = cone(half_power_rim(Beam(angle_deg, angle_deg), 4))
    rim = points[1:]
    off_axis = np.degrees(np.arctan2(np.hypot(rim[:, 0], rim[:, 1]), rim[:, 2]))
    np.testing.assert_allclose(off_axis, angle_deg / 2, atol=0.06)
    assert triangles.max() == wire.max() == len(points) - 1


@pytest.mark.parametrize("angles", [(0, 0), (40, 0), (0, 30), (-120, -50), (10, 90)])
def test_glyphs_turn_to_the_boresight_and_keep_the_horizon(angles: tuple[float, float]) -> None:
    turn = sensor_axes(VirtualSensor(azimuth_deg=angles[0], elevation_deg=angles[1])).T
    np.testing.assert_allclose(turn @ [0, 0, 1], direction_from_angles(*angles), atol=1e-12)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1.0)
    assert turn[1, 0] == pytest.approx(0.0, abs=1e-12)


def test_the_grid_covers_what_stands_on_it_and_names_its_metres() -> None:
    rectangle = grid_rectangle(np.array([-0.3, -2.2]), np.array([0.4, 1.7]))
    x0, z0, x1, z1, step = rectangle
    assert x0 <= -0.3
    assert x1 >= 0.4
    assert z0 <= -2.2
    assert z1 >= 1.7
    grid = ground(1.2, *rectangle)
    np.testing.assert_allclose(grid.points[:, 1], 1.2)
    for segments in (grid.minor, grid.major):
        assert segments.max() < len(grid.points)
    assert "−2 m" in [label.text for label in grid.labels]
    assert step == 0.5


def test_a_grid_never_grows_without_bounds() -> None:
    x0, _, x1, _, step = grid_rectangle(np.array([-500.0, 0.0]), np.array([500.0, 0.0]))
    assert (x1 - x0) / step < 60


def test_closed_surfaces_are_told_from_open_and_reversed_ones() -> None:
    assert is_closed_outward(TETRAHEDRON, OUTWARD)
    assert is_closed_outward(TETRAHEDRON + 1e4, OUTWARD)
    assert not is_closed_outward(TETRAHEDRON, OUTWARD[:, ::-1])
    assert not is_closed_outward(TETRAHEDRON, OUTWARD[:3])
    assert not is_closed_outward(TETRAHEDRON, np.vstack([OUTWARD[:3], OUTWARD[3, ::-1]]))


def test_a_coarse_surface_has_few_faces_and_the_same_outline() -> None:
    side = 80
    u, v = np.meshgrid(np.linspace(0, 1, side), np.linspace(0, 1, side))
    vertices = np.stack([u.ravel(), v.ravel(), 0.1 * np.sin(9 * u).ravel()], axis=1)
    index = np.arange(side * side).reshape(side, side)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    coarse = coarse_faces(vertices, faces, 0.05)
    assert 0 < len(coarse) < len(faces) / 4
    corners = vertices[coarse.ravel()]
    np.testing.assert_allclose(corners.min(axis=0), vertices.min(axis=0), atol=0.05)
    np.testing.assert_allclose(corners.max(axis=0), vertices.max(axis=0), atol=0.05)
    cross = np.cross(
        vertices[coarse[:, 1]] - vertices[coarse[:, 0]],
        vertices[coarse[:, 2]] - vertices[coarse[:, 0]],
    )
    assert 0.9 < 0.5 * abs(cross[:, 2]).sum() < 1.1  # covers the unit square once
    assert math.isclose(len(coarse_faces(vertices, faces[:100])), 100)


def test_pyramids_point_where_their_sensors_look() -> None:
    sensors = [
        Place(2.0, azimuth, elevation).sensor((0.3, 0.1, 2.0))
        for azimuth, elevation in ((0, 0), (40, 20), (-170, -60), (0, 90), (0, -90))
    ]
    positions = np.array([one.position_m for one in sensors])
    directions = np.array([one.boresight for one in sensors])
    points, triangles = pyramids(positions, np.array([sensor_axes(one) for one in sensors]), 0.1)
    each = points.reshape(-1, PYRAMID_POINTS, 3)
    np.testing.assert_allclose(each[:, 0], positions + 0.1 * directions, atol=1e-6)
    np.testing.assert_allclose(each[:, 1:].mean(axis=1), positions, atol=1e-6)
    across = (each[:, 1:] - positions[:, None]) @ directions[:, :, None]
    np.testing.assert_allclose(across, 0.0, atol=1e-6)
    # Closed and seen from outside: the signed volume is that of a pyramid, for each.
    corners = points[triangles].reshape(len(sensors), 6, 3, 3).astype(float)
    corners = corners - positions[:, None, None]
    volume = np.linalg.det(corners).sum(axis=1) / 6
    edge = np.linalg.norm(each[0, 1] - each[0, 2])
    np.testing.assert_allclose(volume, edge**2 * 0.1 / 3, rtol=1e-4)
