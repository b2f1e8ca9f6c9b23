"""The depth buffer against exact visibility, its NumPy form, and by thought."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.depth_visibility import depth_visibility
from scattering_scenes import Mesh, columns, plate, sphere, together

from sd2core.scattering.depth import depth_visibility_kernel
from sd2core.scattering.exact import exact_visibility_kernel
from sd2core.scattering.visibility import encloses

Look = Callable[..., NDArray[np.bool_]]


def exact(vertices: NDArray[np.floating], faces: NDArray[np.int32], sensor: tuple[float, ...]):  # type: ignore[no-untyped-def]
    points = columns(vertices)
    visible = np.empty((1, points.shape[2]), np.uint8)
    exact_visibility_kernel(
        points, faces, np.array(sensor, float), np.ones_like(visible), 0, 1, visible
    )
    return visible[0] > 0


def look(
    vertices: NDArray[np.floating],
    faces: NDArray[np.int32],
    sensor: tuple[float, ...],
    resolution: int = 256,
) -> NDArray[np.bool_]:
    points = columns(vertices)
    visible = np.empty((1, points.shape[2]), np.uint8)
    depth_visibility_kernel(
        points, faces, encloses(faces), np.array(sensor, float), resolution,
        np.ones_like(visible), 0, 1, visible,
    )  # fmt: skip
    return visible[0] > 0


def look_plainly(
    vertices: NDArray[np.floating],
    faces: NDArray[np.int32],
    sensor: tuple[float, ...],
    resolution: int = 256,
) -> NDArray[np.bool_]:
    points = columns(vertices)[0]
    needed = np.ones(points.shape[1], bool)
    return depth_visibility(
        points, faces, encloses(faces), np.array(sensor, float), resolution, needed
    )


FORMS = pytest.mark.parametrize("form", [look, look_plainly])
BALL = sphere(1.0, 4, 0.4)
NESTED = together(sphere(1.0, 4, 0.3), sphere(0.5, 3, 0.9), sphere(0.25, 2, 1.7))
OUTSIDE = [
    (0.3, -0.2, -2.2),
    (1.5, 0.7, 2.0),
    (-3.0, 4.0, 1.0),
    (3.1, 5.2, -300.0),
    (6e5, 0.0, -8e5),
]
BODY_PLACES = [(0.0, 0.0, 0.0), (1.5, 0.0, 2.0), (0.0, -3.0, 1.4), (0.0, 0.0, 300.0)]


@pytest.fixture(scope="module")
def walker(shared_data: Path) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    with np.load(shared_data / "mesh" / "walk.npz") as data:
        return data["vertices"][[5, 40]], np.ascontiguousarray(data["faces"])


@pytest.mark.one_in(5)
@FORMS
@pytest.mark.parametrize("sensor", OUTSIDE)
@pytest.mark.parametrize("resolution", [128, 256])
@pytest.mark.parametrize("mesh", [BALL, NESTED], ids=["sphere", "nested spheres"])
def test_a_convex_body_is_exact(
    form: Look, mesh: Mesh, resolution: int, sensor: tuple[float, ...]
) -> None:
    """No vertex of a convex front lies deeper than all pixels around it.

    What is inside lies deeper by 30 pixels and more.
    """
    vertices, faces = mesh
    np.testing.assert_array_equal(
        form(vertices, faces, sensor, resolution), exact(vertices, faces, sensor)
    )


@FORMS
@pytest.mark.parametrize("resolution", [128, 256])
def test_behind_another_body_it_errs_within_a_pixel_of_the_outline(
    form: Look, resolution: int
) -> None:
    """Elsewhere the four pixels around a vertex show the nearer body or none of it."""
    near = sphere(0.5, 3, 0.4)[0] + [0.3, 0.1, -3.0], sphere(0.5, 3, 0.4)[1]
    vertices, faces = together(near, BALL)
    sensor = np.array([0.0123, 0.0345, -10.0])
    differing = form(vertices, faces, tuple(sensor), resolution) != exact(
        vertices, faces, tuple(sensor)
    )
    ray = vertices - sensor
    axis = np.array([0.3, 0.1, -3.0]) - sensor
    length, distance = np.linalg.norm(ray, axis=1), np.linalg.norm(axis)
    angle = np.arccos(ray @ axis / (length * distance))
    # Seen from ten radii, the far ball is the larger: 2.02 m at 10 m fill the picture. The
    # facets of the near one stay within 1 % of its radius, a tenth of a pixel at 256.
    pixel = 2.02 / 10 / (resolution - 2)
    outline = np.arcsin(0.5 / distance)
    assert not differing[np.abs(angle - outline) > 1.6 * pixel].any()
    assert not differing[: len(near[0])].any()


@FORMS
def test_a_plate_in_front_hides_what_is_further_behind_than_the_bias(form: Look) -> None:
    front, behind = plate(1.0, 12, 2.0), plate(0.5, 9, 2.01)
    vertices, faces = together(front, behind)
    for distance in (0.0, 1.0, -300.0, -1e6):
        seen = form(vertices, faces, (0.0123, 0.0345, distance))
        assert seen[: len(front[0])].all()
        assert not seen[len(front[0]) :].any()


@FORMS
def test_bias_follows_the_size_of_the_body(form: Look) -> None:
    vertices, faces = together(plate(1.0, 12, 2.0), plate(0.5, 9, 2.01))
    sensor = np.array([0.0123, 0.0345, 0.0])
    once = form(vertices, faces, tuple(sensor))
    for scale in (2.0**-10, 2.0**10):
        np.testing.assert_array_equal(form(vertices * scale, faces, tuple(sensor * scale)), once)


@pytest.mark.parametrize("sensor", BODY_PLACES)
def test_walker_finer_is_better(
    walker: tuple[NDArray[np.float32], NDArray[np.int32]], sensor: tuple[float, ...]
) -> None:
    """Limbs of some ten pixels' width err in a rim of half a pixel: 5 %, and twice that at 128."""
    for vertices in walker[0]:
        truth = exact(vertices, walker[1], sensor)
        coarse = (look(vertices, walker[1], sensor, 128) != truth).mean()
        fine = (look(vertices, walker[1], sensor, 256) != truth).mean()
        assert fine < coarse
        assert fine < 0.05
        assert coarse < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("resolution", [128, 256])
@pytest.mark.parametrize("sensor", [*BODY_PLACES, (0.3, 0.4, 1.4)])
def test_plain_form_gives_the_same(
    walker: tuple[NDArray[np.float32], NDArray[np.int32]],
    sensor: tuple[float, ...],
    resolution: int,
) -> None:
    vertices, faces = walker[0][0], walker[1]
    ours = look(vertices, faces, sensor, resolution)
    plain = look_plainly(vertices, faces, sensor, resolution)
    # Both are double precision: only the last digit of a tie may differ.
    assert (ours != plain).sum() <= 1


@pytest.mark.slow
@FORMS
@pytest.mark.parametrize("sensor", [(0.1, 0.2, -0.1), (0.0, 0.0, 0.0), (0.75, 0.1, 0.1)])
def test_around_the_sensor_it_is_exact(form: Look, sensor: tuple[float, ...]) -> None:
    np.testing.assert_array_equal(form(*NESTED, sensor), exact(*NESTED, sensor))


@FORMS
def test_close_by_where_one_plane_does_not_serve_it_is_exact(form: Look) -> None:
    sensor = (0.011, 0.013, -1.1)
    vertices, faces = together(BALL, plate(5.0, 11, -1.0))
    np.testing.assert_array_equal(form(vertices, faces, sensor), exact(vertices, faces, sensor))


@FORMS
def test_sensor_on_a_vertex_sees_that_vertex(form: Look) -> None:
    vertices, faces = BALL
    on = int(vertices[:, 2].argmin())
    assert form(vertices, faces, tuple(vertices[on].astype(np.float32).tolist()))[on]


@FORMS
def test_zero_area_faces_hide_nothing_and_loose_vertices_are_seen(form: Look) -> None:
    vertices, faces = plate(0.5, 5, 2.0)
    line = np.array([[-1.0, 0.01, 1.0], [0.0, 0.01, 1.0], [1.0, 0.01, 1.0], [0.6, 0.6, 3.0]])
    extra = np.array([[0, 1, 2], [0, 0, 1], [2, 2, 2]], np.int32)
    vertices, faces = together((vertices, faces), (line, extra))
    assert form(vertices, faces, (0.0, 0.0, 0.0)).all()


@FORMS
def test_bodies_without_extent_are_visible(form: Look) -> None:
    faces = np.array([[0, 1, 2], [1, 2, 3]], np.int32)
    place = np.full((4, 3), 1.5)
    row = place + np.arange(4)[:, None] * [0.0, 0.0, 1.0]  # one behind another, no surface
    for sensor in ((0.0, 0.0, 0.0), (1.5, 1.5, 1.5), (1.5, 1.5, -4.0)):
        assert form(place, faces, sensor).all()
    assert form(row, faces, (1.5, 1.5, -4.0)).all()


@FORMS
def test_a_surface_that_faces_away_is_hidden(form: Look) -> None:
    vertices, faces = plate(1.0, 6, 2.0)
    assert form(vertices, faces, (0.1, 0.05, 0.0)).all()
    assert not form(vertices, faces, (0.1, 0.05, 4.0)).any()


def test_only_needed_vertices_are_written() -> None:
    points = columns(BALL[0])
    needed = np.zeros((1, points.shape[2]), np.uint8)
    needed[0, ::3] = 1
    visible = np.full_like(needed, 9)
    sensor = (0.2, 0.1, -3.0)
    depth_visibility_kernel(points, BALL[1], True, np.array(sensor), 256, needed, 0, 1, visible)
    assert (visible[0][needed[0] == 0] == 9).all()
    np.testing.assert_array_equal(visible[0, ::3] > 0, look(*BALL, sensor)[::3])
