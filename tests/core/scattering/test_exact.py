"""Exact visibility against embree, against double precision, and by thought."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles.exact_visibility import exact_visibility as exact_plainly
from scattering_scenes import (
    Mesh,
    certain,
    columns,
    embree_visible,
    plate,
    skims_own_surface,
    sphere,
    together,
)

from sd2core.files.resources import resource_path
from sd2core.scattering.exact import exact_visibility_kernel


def look(
    vertices: NDArray[np.floating], faces: NDArray[np.int32], sensor: tuple[float, ...]
) -> NDArray[np.bool_]:
    points = columns(vertices)
    visible = np.empty((1, points.shape[2]), np.uint8)
    exact_visibility_kernel(
        points, faces, np.array(sensor, float), np.ones_like(visible), 0, 1, visible
    )
    return visible[0] > 0


def look_plainly(
    vertices: NDArray[np.floating], faces: NDArray[np.int32], sensor: tuple[float, ...]
) -> NDArray[np.bool_]:
    points = columns(vertices)[0]
    needed = np.ones(points.shape[1], bool)
    return exact_plainly(points, faces, np.array(sensor, float), needed)


BALL = sphere(1.0, 3, 0.4)
SCENES: dict[str, Mesh] = {
    "sphere": sphere(1.0, 2, 0.4),
    "nested spheres": together(sphere(1.0, 2, 0.3), sphere(0.5, 1, 0.9), sphere(0.25, 1, 1.7)),
    "thin plates": together(plate(1.0, 10, 0.0), plate(0.9, 9, 0.001), plate(0.5, 5, -0.3)),
}
NEAR_AND_FAR = [
    (0.013, 0.027, -1.2),
    (0.3, -0.2, -2.2),
    (1.5, 0.7, 2.0),
    (-3.0, 4.0, 1.0),
    (3.1, 5.2, -300.0),
    (2e4, 1e4, -3e4),
]
INSIDE = [(0.1, 0.2, -0.1), (0.4, 0.0, 0.3), (0.0, 0.0, 0.0005), (0.7, 0.1, -0.2)]


@pytest.fixture(scope="module")
def walker(shared_data: Path) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    with np.load(shared_data / "mesh" / "walk.npz") as data:
        return data["vertices"][[5, 40]], np.ascontiguousarray(data["faces"])


@pytest.mark.one_in(5)
@pytest.mark.parametrize("sensor", NEAR_AND_FAR + INSIDE)
@pytest.mark.parametrize("name", SCENES)
def test_every_certain_vertex_is_right(name: str, sensor: tuple[float, ...]) -> None:
    vertices, faces = SCENES[name]
    single = vertices.astype(np.float32)
    everyone = np.arange(len(vertices))
    hidden, visible = certain(
        single, faces, np.array(sensor), everyone, barycentric=1e-6, distance_m=1e-5
    )
    for seen in (look(vertices, faces, sensor), look_plainly(vertices, faces, sensor)):
        assert not seen[hidden].any()
        assert seen[visible].all()
    # The certain ones are nearly all, or the test would say little.
    assert (hidden | visible).mean() > 0.9


def assert_agrees_with_embree(
    vertices: NDArray[np.float32], faces: NDArray[np.int32], sensor: tuple[float, ...]
) -> None:
    """Disagreements are rare, each is a grazing tie for embree, and ours is the right answer."""
    place = np.array(sensor, float)
    ours = look(vertices, faces, sensor)
    differing = np.flatnonzero(ours != embree_visible(vertices, faces, place))
    assert len(differing) <= 3e-4 * len(vertices)
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    hidden, visible = certain(
        vertices, faces, place, differing, barycentric=1e-3, distance_m=5e-5 * size
    )
    grazing = ~(hidden | visible) | skims_own_surface(vertices, faces, place, differing, 1e-3)
    assert grazing.all(), "embree differs where nothing grazes"
    hidden, visible = certain(
        vertices, faces, place, differing, barycentric=1e-7, distance_m=2e-6 * size
    )
    assert not ours[differing][hidden].any()
    assert ours[differing][visible].all()


BODY_PLACES = [
    (0.0, 0.0, 0.0),
    (1.5, 0.0, 2.0),
    (0.0, -3.0, 1.4),
    (-0.5, 0.5, 0.6),
    (0.3, 0.4, 1.4),
    (0.0, 0.0, 300.0),
]


@pytest.mark.one_in(3)
@pytest.mark.parametrize("sensor", BODY_PLACES)
def test_walker_against_embree(
    walker: tuple[NDArray[np.float32], NDArray[np.int32]], sensor: tuple[float, ...]
) -> None:
    for vertices in walker[0]:
        assert_agrees_with_embree(vertices, walker[1], sensor)


@pytest.mark.parametrize("sensor", NEAR_AND_FAR[:5] + INSIDE)
@pytest.mark.parametrize("name", SCENES)
def test_simple_surfaces_against_embree(name: str, sensor: tuple[float, ...]) -> None:
    vertices, faces = SCENES[name]
    assert_agrees_with_embree(vertices.astype(np.float32), faces, sensor)


@pytest.mark.parametrize("sensor", [(0.0, 0.0, -2.2), (2.0, 1.0, 0.5), (0.1, 0.2, 0.0)])
def test_compact_body_against_embree(sensor: tuple[float, ...]) -> None:
    with np.load(resource_path("body.npz")) as data:
        vertices = np.ascontiguousarray(data["medium_vertices"], np.float32)
        faces = np.ascontiguousarray(data["medium_faces"], np.int32)
    middle = vertices.mean(axis=0)
    assert_agrees_with_embree(vertices, faces, tuple(middle + np.array(sensor)))


@pytest.mark.parametrize("sensor", [BODY_PLACES[0], BODY_PLACES[4]])
def test_plain_form_gives_the_same(
    walker: tuple[NDArray[np.float32], NDArray[np.int32]], sensor: tuple[float, ...]
) -> None:
    vertices, faces = walker[0][0], walker[1]
    asked = np.arange(len(vertices)) % 9 == 0  # a vertex takes the plain form long
    points = columns(vertices)[0]
    plain = exact_plainly(points, faces, np.array(sensor, float), asked)
    differing = np.flatnonzero(asked & (look(vertices, faces, sensor) != plain))
    # Both are double precision; only a ray through an edge to the last digit may differ.
    hidden, visible = certain(
        vertices, faces, np.array(sensor), differing, barycentric=1e-8, distance_m=4e-6
    )
    assert not (hidden | visible).any()
    assert len(differing) <= 1


@pytest.mark.slow
@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), distance=st.sampled_from([0.0, 0.1, 1.0, 10.0, 1e3, 1e6]))
def test_any_heap_of_triangles(seed: int, distance: float) -> None:
    random = np.random.default_rng(seed)
    vertices = random.uniform(-1, 1, (60, 3)).astype(np.float32)
    faces = random.permuted(np.tile(np.arange(60, dtype=np.int32), (25, 1)), axis=1)[:, :3]
    direction = random.normal(size=3)
    sensor = distance * direction / np.linalg.norm(direction)
    hidden, visible = certain(
        vertices, faces, sensor, np.arange(60), barycentric=1e-6, distance_m=1e-5
    )
    for seen in (
        look(vertices, faces, tuple(sensor)),
        look_plainly(vertices, faces, tuple(sensor)),
    ):
        assert not seen[hidden].any()
        assert seen[visible].all()


def test_a_sphere_shows_its_near_cap() -> None:
    vertices, faces = sphere(divisions=4)
    for distance in (1.5, 4.0, 1e6):
        seen = look(vertices, faces, (0.0, 0.0, -distance))
        height = -vertices[:, 2] - 1 / distance  # above the horizon when positive
        assert seen[height > 0.05].all()
        assert not seen[height < -0.05].any()


def test_from_the_centre_a_sphere_is_seen_whole() -> None:
    vertices, faces = BALL
    assert look(vertices, faces, (0.0, 0.0, 0.0)).all()


def test_a_thin_plate_hides_what_is_a_tenth_of_a_millimetre_behind_it() -> None:
    front, behind = plate(1.0, 8, 2.0), plate(0.5, 7, 2.0001)
    vertices, faces = together(front, behind)
    for distance in (0.0, -300.0):
        seen = look(vertices, faces, (0.0123, 0.0345, distance))
        assert seen[: len(front[0])].all()
        assert not seen[len(front[0]) :].any()
    assert look(vertices, faces, (0.0123, 0.0345, 5.0))[len(front[0]) :].all()


def test_orientation_does_not_matter() -> None:
    vertices, faces = SCENES["nested spheres"]
    sensor = (0.3, -0.2, -2.2)
    np.testing.assert_array_equal(
        look(vertices, faces, sensor), look(vertices, faces[:, ::-1].copy(), sensor)
    )


def test_doubled_seam_vertices_do_not_hide_each_other() -> None:
    vertices, faces = plate(1.0, 6, 2.0)
    loose = vertices[faces].reshape(-1, 3)
    triangles = np.arange(len(loose), dtype=np.int32).reshape(-1, 3)
    assert look(loose, triangles, (0.1, 0.05, 0.0)).all()


def test_zero_area_faces_hide_nothing() -> None:
    vertices, faces = plate(0.5, 5, 2.0)
    line = np.array([[-1.0, 0.01, 1.0], [0.0, 0.01, 1.0], [1.0, 0.01, 1.0]])
    extra = np.array([[0, 1, 2], [0, 0, 1], [2, 2, 2]], np.int32)
    vertices, faces = together((vertices, faces), (line, extra))
    for form in (look, look_plainly):
        assert form(vertices, faces, (0.0, 0.0, 0.0)).all()


@pytest.mark.parametrize("form", [look, look_plainly])
def test_sensor_on_a_vertex_sees_that_vertex(form) -> None:  # type: ignore[no-untyped-def]
    vertices, faces = BALL
    on = int(vertices[:, 2].argmin())
    seen = form(vertices, faces, tuple(vertices[on].astype(np.float32).tolist()))
    assert seen[on]
    # From the skin of a ball one looks through its inside at all of it.
    assert seen.mean() > 0.9


def test_a_loose_vertex_far_off_changes_nothing() -> None:
    vertices, faces = together(BALL, plate(1.0, 6, 1.0001))
    lone = np.vstack([vertices, [[3e5, 2e5, 4e5]]])
    for sensor in ((0.3, -0.2, -2.2), (0.0123, 0.0345, 3.0)):
        assert np.array_equal(look(lone, faces, sensor)[:-1], look(vertices, faces, sensor))


def test_all_points_in_one_place_are_visible() -> None:
    vertices, faces = np.full((4, 3), 1.5), np.array([[0, 1, 2], [1, 2, 3]], np.int32)
    for sensor in ((0.0, 0.0, 0.0), (1.5, 1.5, 1.5)):
        assert look(vertices, faces, sensor).all()
        assert look_plainly(vertices, faces, sensor).all()


def test_only_needed_vertices_are_written() -> None:
    points = columns(BALL[0])
    needed = np.zeros((1, points.shape[2]), np.uint8)
    needed[0, ::3] = 1
    visible = np.full_like(needed, 9)
    sensor = np.array([0.2, 0.1, -3.0])
    exact_visibility_kernel(points, BALL[1], sensor, needed, 0, 1, visible)
    assert (visible[0][needed[0] == 0] == 9).all()
    full = look(*BALL, (0.2, 0.1, -3.0))
    np.testing.assert_array_equal(visible[0, ::3] > 0, full[::3])


def test_far_away_the_view_becomes_orthographic() -> None:
    vertices, faces = SCENES["thin plates"]
    direction = np.array([0.123, 0.345, -0.93])
    near_limit = look(vertices, faces, tuple(1e5 * direction))
    np.testing.assert_array_equal(look(vertices, faces, tuple(1e6 * direction)), near_limit)
