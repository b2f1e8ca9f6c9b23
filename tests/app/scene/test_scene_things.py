"""Edges of things, what a ray meets of them, and a drag on a level."""

from __future__ import annotations

import numpy as np
import pytest
from vtkmodules.vtkRenderingCore import vtkRenderer

from sd2app.palette import LIGHT
from sd2app.scene.camera import EyePose, drag_level
from sd2app.scene.things import Movables
from sd2core.mesh.things import SHELF, Thing


def edges_of(vertices: np.ndarray, faces: np.ndarray) -> int:
    """Number of edges that are drawn of a thing."""
    things = Movables(vtkRenderer(), LIGHT)
    things.set_things([(vertices, faces)], [Thing("box", (0, 1, 2))])
    _, edge = things.things[0].shapes
    edge.actor.GetMapper().Update()
    return edge.actor.GetMapper().GetInput().GetNumberOfLines()


@pytest.mark.parametrize(("shape", "boxes"), [("box", 1), ("table", 5), ("doorway", 3)])
def test_a_box_has_twelve_edges_and_no_diagonals(shape: str, boxes: int) -> None:
    assert edges_of(*Thing(shape, (0, 1, 2), 30.0).placed()) == 12 * boxes
    assert len(SHELF[shape][1]) == boxes


def test_an_open_surface_ends_in_edges() -> None:
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    assert edges_of(square, np.array([[0, 1, 2], [0, 2, 3]], np.int32)) == 4


def test_a_ray_meets_the_nearest_thing_before_the_eye() -> None:
    things = Movables(vtkRenderer(), LIGHT)
    pose = EyePose((0.0, 0.0, 5.0))  # it looks ahead from the origin
    x, y = np.divide(pose.size_px, 2)
    assert things.under(pose, x, y) is None
    boxes = [Thing("box", (0, 0.25, z)) for z in (5.0, 3.0, -2.0)]
    things.set_things([box.placed() for box in boxes], boxes)
    found = things.under(pose, x, y)
    assert found is not None
    assert found[0] == 1
    np.testing.assert_allclose(found[2], [0, 0, 2.75], atol=1e-9)
    assert things.under(pose, x + 0.5 * pose.pixels_per_tangent, y) is None


def test_a_level_drag_stays_under_the_pointer() -> None:
    pose = EyePose(azimuth_deg=-30, elevation_deg=-20)
    start = np.array([0.2, 1.0, 2.0])
    x, y, _ = pose.project(start)[0]
    np.testing.assert_allclose(drag_level(start, pose, x, y), start)
    moved = drag_level(start, pose, x + 25, y + 10)
    assert moved is not None
    assert moved[1] == pytest.approx(1.0)
    np.testing.assert_allclose(pose.project(moved)[0, :2], [x + 25, y + 10])
    assert drag_level(start, pose, x, -5000.0) is None  # above the horizon
