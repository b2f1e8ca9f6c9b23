from __future__ import annotations

import numpy as np
import pytest

from sd2core.body.model import Body
from sd2core.numerics.raster import interpolate, rasterise
from tools.build_sample.clothing import SHIRT, TROUSERS
from tools.build_sample.render import Renderer, lit_share, stamp

PLACE = np.array([0.05, 1.1, 2.2])


@pytest.fixture(scope="module")
def renderer() -> Renderer:
    return Renderer(Body.load("medium"))


@pytest.fixture(scope="module")
def picture(renderer: Renderer) -> np.ndarray:
    return renderer.frame(renderer.body.vertices_m + PLACE)


def drawn(points: np.ndarray, nearness: np.ndarray, faces: np.ndarray) -> tuple:
    buffer = np.zeros((20, 30), np.float32)
    owner = np.full((20, 30), -1, np.int32)
    faces = np.asarray(faces, np.int32)
    rasterise(
        np.asarray(points, np.float32), np.asarray(nearness, np.float32), faces, buffer, owner
    )
    return buffer, owner


def test_a_triangle_covers_the_pixels_whose_centres_it_holds() -> None:
    points = [[2.0, 3.0], [2.0, 15.0], [20.0, 3.0]]  # facing the viewer
    _, owner = drawn(points, [1.0, 1.0, 1.0], [[0, 1, 2]])
    rows, columns = np.mgrid[:20, :30] + 0.5
    inside = (columns >= 2) & (rows >= 3) & ((columns - 2) / 18 + (rows - 3) / 12 <= 1)
    np.testing.assert_array_equal(owner == 0, inside)


def test_a_triangle_seen_from_behind_is_not_drawn() -> None:
    _, owner = drawn([[2, 3], [2, 15], [20, 3]], [1, 1, 1], [[0, 2, 1]])
    assert (owner == -1).all()


@pytest.mark.parametrize("order", [[0, 1], [1, 0]])
def test_the_nearer_triangle_wins_in_any_order(order: list[int]) -> None:
    points = [[2, 3], [2, 15], [20, 3]] * 2
    faces = np.array([[0, 1, 2], [3, 4, 5]])[order]
    buffer, owner = drawn(points, [1, 1, 1, 2, 2, 2], faces)
    assert (faces[owner[owner >= 0], 0] == 3).all()
    np.testing.assert_allclose(buffer[owner >= 0], 2.0, rtol=1e-6)


def test_neighbouring_triangles_leave_no_gap() -> None:
    points = [[1.3, 1.7], [2.1, 18.2], [27.9, 17.1], [26.4, 2.2]]
    _, owner = drawn(points, [1, 1, 1, 1], [[0, 1, 2], [0, 2, 3]])
    covered = owner >= 0
    for row in covered:
        columns = np.flatnonzero(row)
        assert len(columns) == 0 or len(columns) == columns[-1] - columns[0] + 1


def test_attributes_are_right_in_perspective() -> None:
    """World coordinates interpolated at a pixel project onto that pixel."""
    world = np.array([[-0.3, -0.2, 1.0], [-0.5, 0.6, 2.0], [0.9, 0.1, 3.0]])
    scale, centre = 20.0, np.array([15.0, 10.0])
    points = (scale * world[:, :2] / world[:, 2:] + centre).astype(np.float32)
    nearness = (1 / world[:, 2]).astype(np.float32)
    faces = np.array([[0, 1, 2]], np.int32)
    buffer, owner = drawn(points, nearness, faces)
    rows, columns = np.nonzero(owner >= 0)
    assert len(rows) > 10
    values = np.empty((len(rows), 3), np.float32)
    attributes = world.astype(np.float32)
    interpolate(points, nearness, faces, rows, columns, owner, attributes, values)
    seen = scale * values[:, :2] / values[:, 2:] + centre
    np.testing.assert_allclose(seen, np.stack([columns, rows], axis=1) + 0.5, atol=1e-4)
    np.testing.assert_allclose(1 / values[:, 2], buffer[rows, columns], rtol=1e-5)


def test_light_is_kept_out_by_what_is_nearer_to_it() -> None:
    buffer = np.full((10, 10), -1e9, np.float32)
    buffer[:, 5:] = 1.0
    points = np.array([[2.5, 5.5], [7.5, 5.5], [7.5, 5.5], [99.0, 5.0]], np.float32)
    nearness = np.array([0.0, 0.0, 1.0, 0.0], np.float32)
    share = lit_share(points, nearness, buffer, np.zeros((1, 2), np.float32))
    assert share.tolist() == [1.0, 0.0, 1.0, 1.0]


def test_the_mesh_projects_onto_the_person(renderer: Renderer, picture: np.ndarray) -> None:
    """The shirt is where the projected skeleton says, and ends at its hem."""
    camera, skeleton = renderer.camera, renderer.body.skeleton
    shirt = picture[..., 2].astype(int) - picture[..., 0] > 60
    chest = skeleton.heads_m[skeleton.index["spine01"]] + PLACE
    column, row = camera.project(chest[None])[0].astype(int)
    assert shirt[row, column]
    hem = camera.project(np.array([[0.0, -0.93, -0.1]]) + PLACE)[0, 1]
    assert np.flatnonzero(shirt.any(axis=1))[-1] == pytest.approx(hem, abs=3)


def test_the_outline_is_that_of_the_mesh(renderer: Renderer) -> None:
    """Every row's leftmost and rightmost person pixel is where the mesh ends."""
    vertices = renderer.body.vertices_m + PLACE
    shadow = renderer.light_buffer(vertices)
    _, coverage = renderer.person(vertices, shadow)
    pixels = renderer.camera.project(vertices)
    start, end = (pixels[renderer.body.faces[:, k]] for k in ([0, 1, 2], [1, 2, 0]))
    for row in range(60, 400, 10):
        y = row + 0.5
        crossing = (start[..., 1] < y) != (end[..., 1] < y)
        p, q = start[crossing], end[crossing]
        x = p[:, 0] + (y - p[:, 1]) / (q[:, 1] - p[:, 1]) * (q[:, 0] - p[:, 0])
        columns = np.flatnonzero(coverage[row] > 0.5)
        assert columns[0] == pytest.approx(x.min(), abs=1.0)
        assert columns[-1] + 1 == pytest.approx(x.max(), abs=1.0)


def test_people_wear_different_colours(picture: np.ndarray) -> None:
    def share(colour: tuple[float, float, float]) -> float:
        wanted = np.array(colour) / np.linalg.norm(colour)
        seen = picture / np.maximum(np.linalg.norm(picture, axis=2, keepdims=True), 1e-9)
        return float((seen @ wanted > 0.98).mean())

    assert share(SHIRT) > 0.03
    assert share(TROUSERS) > 0.02


def test_the_same_vertices_give_the_same_picture(renderer: Renderer, picture: np.ndarray) -> None:
    again = renderer.frame(renderer.body.vertices_m + PLACE)
    np.testing.assert_array_equal(again, picture)


def test_the_picture_says_simulated(renderer: Renderer, picture: np.ndarray) -> None:
    """The caption's corner is brighter than the floor around it, and only there."""
    plain = np.full((480, 640, 3), 0.3, np.float32)
    marked = stamp(plain, "Simulated")
    rows, columns = np.nonzero(np.abs(marked - plain).max(axis=2) > 0.1)
    assert rows.min() > 440
    assert columns.min() > 540
    assert len(rows) > 200
    bright = picture[rows.min() : rows.max(), columns.min() : columns.max()].max(axis=(0, 1))
    assert (bright > 200).all()
