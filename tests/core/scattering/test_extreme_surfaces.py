"""Surfaces of any size, seen from anywhere, whole or damaged: what is visible, how large.

Positions are taken as the kernels get them, in single precision; the references work on
the same numbers in double precision or by closed forms.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles.depth_visibility import depth_visibility
from oracles.exact_visibility import exact_visibility
from oracles.surfaces import vertex_areas, vertex_normals
from scattering_scenes import Mesh, certain, columns, plate, sphere, together

from sd2core.scattering.amplitude import (
    NEAREST_RANGE_M,
    range_weight,
    vertex_areas_kernel,
)
from sd2core.scattering.depth import depth_visibility_kernel
from sd2core.scattering.exact import CONTACT, exact_visibility_kernel
from sd2core.scattering.visibility import (
    encloses,
    facing_kernel,
    facing_mask,
    vertex_normals_kernel,
)

SINGLE, DOUBLE = 2.0**-24, 2.0**-53

Look = Callable[..., NDArray[np.bool_]]


def exact(
    points: NDArray[np.float32], faces: NDArray[np.int32], sensor: NDArray[np.float64]
) -> NDArray[np.bool_]:
    visible = np.full((1, points.shape[2]), 7, np.uint8)
    exact_visibility_kernel(points, faces, sensor, np.ones_like(visible), 0, 1, visible)
    return visible[0] == 1


def exact_plainly(
    points: NDArray[np.float32], faces: NDArray[np.int32], sensor: NDArray[np.float64]
) -> NDArray[np.bool_]:
    return exact_visibility(points[0], faces, sensor, np.ones(points.shape[2], bool))


def depth(
    points: NDArray[np.float32],
    faces: NDArray[np.int32],
    sensor: NDArray[np.float64],
    resolution: int = 64,
) -> NDArray[np.bool_]:
    visible = np.full((1, points.shape[2]), 7, np.uint8)
    needed, closed = np.ones_like(visible), encloses(faces)
    depth_visibility_kernel(points, faces, closed, sensor, resolution, needed, 0, 1, visible)
    return visible[0] == 1


def depth_plainly(
    points: NDArray[np.float32],
    faces: NDArray[np.int32],
    sensor: NDArray[np.float64],
    resolution: int = 64,
) -> NDArray[np.bool_]:
    needed = np.ones(points.shape[2], bool)
    return depth_visibility(points[0], faces, encloses(faces), sensor, resolution, needed)


def facing(
    points: NDArray[np.float32], faces: NDArray[np.int32], sensor: NDArray[np.float64]
) -> NDArray[np.bool_]:
    normals = np.empty(points.shape, np.int8)
    vertex_normals_kernel(points, faces, normals)
    visible = np.full(points.shape[2], 7, np.uint8)
    facing_kernel(*points[0], *normals[0], *sensor.astype(np.float32), visible)
    return visible == 1


def facing_plainly(
    points: NDArray[np.float32], faces: NDArray[np.int32], sensor: NDArray[np.float64]
) -> NDArray[np.bool_]:
    normals = vertex_normals(points, faces)
    return facing_mask(points, normals, sensor)[0] == 1


LOOKS: dict[str, Look] = {
    "exact": exact,
    "exact plainly": exact_plainly,
    "depth": depth,
    "depth plainly": depth_plainly,
    "facing": facing,
    "facing plainly": facing_plainly,
}


def with_faces(mesh: Mesh, faces: list[list[int]], *points: tuple[float, float, float]) -> Mesh:
    """A mesh with some more points and faces; numbers below 0 count from the end."""
    vertices = np.concatenate([mesh[0], np.array(points).reshape(-1, 3)])
    return vertices, np.concatenate([mesh[1], np.array(faces) % len(vertices)]).astype(np.int32)


def split(mesh: Mesh) -> Mesh:
    """Every face with three vertices of its own."""
    vertices, faces = mesh
    return vertices[faces.ravel()], np.arange(faces.size, dtype=np.int32).reshape(-1, 3)


BALL = sphere(1.0, 2, 0.4)
SURFACES: dict[str, Mesh] = {
    "closed": together(sphere(1.0, 1, 0.4), sphere(0.4, 1, 0.9)),
    "open": together(plate(1.0, 10, 0.0), plate(0.7, 7, 0.3)),
    "duplicate vertices": split(sphere(1.0, 1, 0.4)),
    "zero area": with_faces(BALL, [[0, 0, 1], [2, 2, 2], [3, -1, -2]], (0.0, 0.0, 2.0), (0, 0, 2)),
    "slivers": with_faces(
        BALL, [[-3, -2, -1]], (-1.5, 0.1, -1.4), (1.5, 0.1, -1.4), (0.1, 0.1 + 1e-7, -1.4)
    ),
    "not a manifold": with_faces(
        BALL, [[0, 1, -1], [0, 1, -2], [0, 1, -3]], (1.4, 0.1, 0.2), (0.3, 1.5, 0.1), (-1.3, 0, 0.4)
    ),
}
DIRECTION = np.array([0.48, 0.6, -0.64])
SIZES_M = (1e-3, 1.0, 1e3)
DISTANCES_M = (1e-3, 0.03, 2.2, 300.0, 1e6)

ANY_SURFACE = pytest.mark.parametrize("name", SURFACES)
ANY_SIZE = pytest.mark.parametrize("size_m", SIZES_M)


def places(size_m: float, points: NDArray[np.float32]) -> dict[str, NDArray[np.float64]]:
    """Sensors near and far, behind, on a vertex, and inside."""
    found = {f"{d:g} m": (1.5 * size_m + d) * DIRECTION for d in DISTANCES_M}
    found |= {f"behind {d:g} m": -(1.5 * size_m + d) * DIRECTION for d in (1e-3, 1e6)}
    found["on"] = points[0, :, 5].astype(np.float64)
    found["inside"] = size_m * np.array([0.05, 0.48, -0.03])
    found["in the middle"] = np.zeros(3)
    return found


@pytest.mark.one_in(5)
@ANY_SIZE
@ANY_SURFACE
def test_exact_visibility_is_right_wherever_it_is_certain(name: str, size_m: float) -> None:
    vertices, faces = SURFACES[name]
    points = columns(vertices * size_m)
    some = np.arange(0, points.shape[2], 3)
    extent_m = float(np.linalg.norm(np.ptp(points[0], axis=1)))
    certainties = 0
    for place, sensor in places(size_m, points).items():
        # Twice the contact that the rule leaves out at both ends, and a hundred
        # roundings of the direction: nearer than that either answer is right.
        hidden, visible = certain(
            points[0].T,
            faces,
            sensor,
            some,
            barycentric=1e-7,
            distance_m=2 * CONTACT * extent_m,
        )
        certainties += int(hidden.sum() + visible.sum())
        for form in ("exact", "exact plainly"):
            seen = LOOKS[form](points, faces, sensor)
            assert not seen[some][hidden].any(), (place, form)
            assert seen[some][visible].all(), (place, form)
    # On a vertex, or among duplicates that touch one another, every answer is a tie.
    assert certainties > len(some)


@pytest.mark.one_in(5)
@pytest.mark.parametrize("form", LOOKS)
@ANY_SURFACE
def test_a_scene_a_thousand_times_as_large_looks_the_same(name: str, form: str) -> None:
    # Powers of two change no digit: the answers are the same to the last one.
    vertices, faces = SURFACES[name]
    points = columns(vertices)
    for place, sensor in list(places(1.0, points).items())[::2]:
        usual = LOOKS[form](points, faces, sensor)
        for factor in (2.0**-10, 2.0**10):
            scaled = LOOKS[form](points * np.float32(factor), faces, sensor * factor)
            np.testing.assert_array_equal(scaled, usual, err_msg=place)


@pytest.mark.one_in(7)
@pytest.mark.parametrize("form", ["exact", "depth", "facing"])
@ANY_SIZE
@ANY_SURFACE
def test_compiled_and_plain_agree(name: str, size_m: float, form: str) -> None:
    vertices, faces = SURFACES[name]
    points = columns(vertices * size_m)
    for place, sensor in places(size_m, points).items():
        compiled = LOOKS[form](points, faces, sensor)
        plain = LOOKS[f"{form} plainly"](points, faces, sensor)
        # A product that is rounded once more decides ties: on an edge, or seen edge-on.
        assert (compiled != plain).sum() <= 2, place


@pytest.mark.one_in(7)
@pytest.mark.parametrize("size_m", SIZES_M)
@pytest.mark.parametrize("distance_m", DISTANCES_M)
@pytest.mark.parametrize("form", ["depth", "depth plainly", "facing", "facing plainly"])
def test_a_ball_shows_the_cap_within_its_horizon(
    form: str, distance_m: float, size_m: float
) -> None:
    vertices, faces = sphere(1.0, 3, 0.4)
    points = columns(vertices * size_m)
    sensor = (size_m + distance_m) * DIRECTION
    finely = {"resolution": 256} if form.startswith("depth") else {}
    seen = LOOKS[form](points, faces, sensor, **finely)
    exactly = LOOKS["exact"](points, faces, sensor)
    cosine = vertices @ DIRECTION
    horizon = size_m / (size_m + distance_m)
    # An edge of this ball spans up to 0.185 rad, and the buffer's bias lets through what is
    # 3 pixels of 1/127 radius deep, sin(angle)^2 < 0.024.
    clear = np.abs(np.arccos(cosine.clip(-1, 1)) - np.arccos(horizon)) > 0.19
    np.testing.assert_array_equal(seen[clear], (cosine > horizon)[clear])
    np.testing.assert_array_equal(exactly[clear], (cosine > horizon)[clear])


@ANY_SIZE
@ANY_SURFACE
def test_areas(name: str, size_m: float) -> None:
    vertices, faces = SURFACES[name]
    points = columns(vertices * size_m)
    corner = points[0].astype(np.longdouble)[:, faces]
    one, two = corner[:, :, 1] - corner[:, :, 0], corner[:, :, 2] - corner[:, :, 0]
    third = np.sqrt((np.cross(one, two, axis=0) ** 2).sum(axis=0)) / 6
    truth = np.zeros(points.shape[2], np.longdouble)
    np.add.at(truth, faces.ravel(), np.repeat(third, 3))
    compiled = np.empty((1, points.shape[2]), np.float32)
    vertex_areas_kernel(points, faces, compiled)
    most = np.bincount(faces.ravel()).max()
    # Every triangle's third and every sum is rounded to single precision. The cross product
    # of two edges is good to 4 double roundings of the product of their lengths.
    lengths = np.linalg.norm(one.astype(float), axis=0) * np.linalg.norm(two.astype(float), axis=0)
    tolerance = (most + 2) * SINGLE * truth.astype(float) + 4 * DOUBLE * lengths.max()
    for found in (compiled, vertex_areas(points, faces)):
        assert (np.abs(found[0] - truth.astype(float)) <= tolerance).all()


def test_areas_of_a_tower_of_slivers() -> None:
    # A strip of 1,000 triangles, 1 m long and 2 micrometres wide, at an odd angle.
    side = np.linspace(0.0, 1e-3, 501)
    ends = np.stack([np.repeat(side, 2), np.tile([0.0, 1.0], 501), np.zeros(1002)], axis=1)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    number = np.arange(0, 1000, 2)
    faces = np.concatenate(
        [
            np.stack([number, number + 1, number + 2], 1),
            np.stack([number + 2, number + 1, number + 3], 1),
        ]
    ).astype(np.int32)
    points = columns(ends @ turn.T)
    corner = points[0].astype(np.float64)[:, faces]
    cross = np.cross(corner[:, :, 1] - corner[:, :, 0], corner[:, :, 2] - corner[:, :, 0], axis=0)
    truth = 0.5 * np.linalg.norm(cross, axis=0).sum()
    compiled = np.empty((1, points.shape[2]), np.float32)
    vertex_areas_kernel(points, faces, compiled)
    # As above; the reference's own double products are wrong by 1e-16 of 1 m x 1 m each.
    assert abs(compiled.sum(dtype=np.float64) - truth) <= 8 * SINGLE * truth


@given(
    range_m=st.floats(0.0, 1e6),
    exponent=st.floats(0.0, 4.0) | st.sampled_from([2.0, 3.0, 4.0]),
    reference_m=st.floats(1e-3, 1e3),
)
@settings(max_examples=200, derandomize=True)
def test_range_law(range_m: float, exponent: float, reference_m: float) -> None:
    truth = (np.longdouble(reference_m) / max(np.longdouble(range_m), NEAREST_RANGE_M)) ** exponent
    found = range_weight(np.array([range_m]), exponent, reference_m)[0]
    # Rounded to single at the end; the power multiplies a double's own rounding.
    assert found == pytest.approx(float(truth), rel=SINGLE + 1e-14, abs=1e-45)
