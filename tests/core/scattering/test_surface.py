"""Normals, facing test, areas and the range law."""

from __future__ import annotations

import numpy as np
from oracles.surfaces import vertex_area_vectors, vertex_areas, vertex_normals
from scattering_scenes import columns, plate, sphere, together

from sd2core.scattering.amplitude import (
    NEAREST_RANGE_M,
    projected_areas,
    range_weight,
    vertex_area_vectors_kernel,
    vertex_areas_kernel,
)
from sd2core.scattering.visibility import (
    encloses,
    facing_mask,
    vertex_normals_kernel,
)


def test_normals_of_a_sphere_point_outwards() -> None:
    vertices, faces = sphere(2.0)
    normals = vertex_normals(columns(vertices), faces)[0].T / 127
    cosine = (normals * vertices / 2.0).sum(axis=1) / np.linalg.norm(normals, axis=1)
    assert np.degrees(np.arccos(np.minimum(cosine, 1))).max() < 1.0


def test_compiled_normals_and_areas_are_the_plain_ones() -> None:
    vertices, faces = together(sphere(0.5), plate(1.0))
    points = np.concatenate([columns(vertices), columns(vertices * [1.0, 0.7, 1.3])])
    normals = np.empty(points.shape, np.int8)
    vertex_normals_kernel(points, faces, normals)
    np.testing.assert_array_equal(normals, vertex_normals(points, faces))
    areas = np.empty((2, points.shape[2]), np.float32)
    vertex_areas_kernel(points, faces, areas)
    np.testing.assert_allclose(areas, vertex_areas(points, faces), rtol=1e-5)


def test_facing_divides_a_sphere_at_its_horizon() -> None:
    vertices, faces = sphere()
    points = columns(vertices)
    facing = facing_mask(points, vertex_normals(points, faces), np.array([0.0, 0.0, -4.0]))[0]
    height = -vertices[:, 2] - 0.25
    assert facing[height > 0.03].all()
    assert not facing[height < -0.03].any()


def test_reversed_faces_face_away() -> None:
    vertices, faces = plate(depth_m=2.0)
    points, sensor = columns(vertices), np.zeros(3)
    assert facing_mask(points, vertex_normals(points, faces), sensor).all()
    reversed_faces = faces[:, ::-1].copy()
    assert not facing_mask(points, vertex_normals(points, reversed_faces), sensor).any()


def test_what_has_no_surface_faces_everyone() -> None:
    points = columns(np.array([[0.0, 0, 1], [1, 0, 1], [2, 0, 1], [5, 5, 5]]))
    faces = np.array([[0, 1, 2]], np.int32)  # three points on a line
    normals = vertex_normals(points, faces)
    assert not normals.any()
    assert facing_mask(points, normals, np.zeros(3)).all()


def test_areas_add_up_to_the_surface() -> None:
    vertices, faces = plate(1.5)
    areas = vertex_areas(columns(vertices), faces)
    np.testing.assert_allclose(areas.sum(), 1.5**2, rtol=1e-5)
    assert areas.min() > 0


def test_compiled_area_vectors_are_the_plain_ones() -> None:
    vertices, faces = together(sphere(0.5), plate(1.0))
    points = np.concatenate([columns(vertices), columns(vertices * [1.0, 0.7, 1.3])])
    vectors = np.empty(points.shape, np.float32)
    vertex_area_vectors_kernel(points, faces, vectors)
    # Both sum in double precision; what is compared has been rounded to single.
    plain = vertex_area_vectors(points, faces)
    np.testing.assert_allclose(vectors, plain, rtol=1e-6, atol=1e-6 * np.abs(plain).max())


def test_area_vectors_of_a_closed_surface_cancel() -> None:
    vertices, faces = sphere(0.7)
    vectors = vertex_area_vectors(columns(vertices), faces)[0].astype(float)
    surface = np.linalg.norm(vectors, axis=0).sum()
    assert np.abs(vectors.sum(axis=1)).max() <= 1e-6 * surface
    assert ((vectors * vertices.T).sum(axis=0) > 0).all()


def test_a_tilted_plate_turns_its_cosine_to_the_sensor() -> None:
    vertices, faces = plate(1.5)
    far = np.array([0.0, 0.0, -1e6])
    for angle in np.radians([0.0, 30.0, 60.0, 89.0, 120.0, 180.0]):
        cos, sin = np.cos(angle), np.sin(angle)
        turned = vertices @ np.array([[1, 0, 0], [0, cos, sin], [0, -sin, cos]])
        points = columns(turned)
        vectors = vertex_area_vectors(points, faces)[0]
        seen = projected_areas(points[0], vectors, far).sum()
        # Single precision of coordinates of about a metre.
        np.testing.assert_allclose(seen, 1.5**2 * max(cos, 0.0), atol=1e-5)


def test_a_far_sphere_shows_its_disc() -> None:
    vertices, faces = sphere(0.4, divisions=5)
    points = columns(vertices)
    vectors = vertex_area_vectors(points, faces)[0]
    for direction in ([0.0, 0.0, -1.0], [0.36, 0.48, 0.8]):
        seen = projected_areas(points[0], vectors, 1e5 * np.array(direction)).sum()
        # The icosphere of 10,242 vertices lies inside the sphere by 3e-4 of its area, and
        # along the horizon half-turned fans count 0 or their part.
        np.testing.assert_allclose(seen, np.pi * 0.4**2, rtol=2e-3)
    areas = vertex_areas(points, faces).sum()
    np.testing.assert_allclose(areas, 4 * np.pi * 0.4**2, rtol=1e-3)


def test_on_the_sensor_nothing_is_turned_to_it() -> None:
    vertices, faces = plate()
    points = columns(vertices)
    vectors = vertex_area_vectors(points, faces)[0]
    seen = projected_areas(points[0], vectors, points[0, :, 40].astype(float))
    assert np.isfinite(seen).all()
    assert seen[40] == 0


def test_range_law() -> None:
    ranges = np.array([2.2, 4.4, 1.1, 1e6])
    np.testing.assert_allclose(
        range_weight(ranges, 4.0, 2.2), [1, 1 / 16, 16, (2.2e-6) ** 4], rtol=1e-6
    )
    np.testing.assert_array_equal(range_weight(ranges, 0.0, 2.2), 1)
    nearest = (2.2 / NEAREST_RANGE_M) ** 4
    np.testing.assert_allclose(range_weight(np.array([0.0, 0.05]), 4.0, 2.2), nearest, rtol=1e-6)


def test_what_encloses_a_body() -> None:
    ball = sphere(1.0, 2)[1]
    assert encloses(ball)
    assert encloses(ball[:, ::-1])  # alike oriented, though inwards
    assert encloses(together(sphere(0.5), sphere(1.0))[1])
    assert encloses(np.concatenate([ball, [[3, 3, 4]]]).astype(np.int32))  # no area, no matter
    assert not encloses(plate(1.0)[1])
    assert not encloses(ball[1:])
    assert not encloses(np.concatenate([ball, ball[:1]]))
    turned = ball.copy()
    turned[5] = turned[5, ::-1]
    assert not encloses(turned)
