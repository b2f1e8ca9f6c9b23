"""Shapes, sizes and turns of things, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from sd2core.errors import Sd2Error
from sd2core.io.things import with_things
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.things import MAX_THINGS, SHELF, Thing
from sd2core.scattering.visibility import encloses
from sd2core.timebase import Timebase

MESH = MeshSequence(np.zeros((2, 3, 3)), np.array([[0, 1, 2]]), Timebase([0.0, 0.1]))


def volume(vertices: Any, faces: Any) -> float:
    """Volume of a closed surface that is turned outwards."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    return float((a * np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize("shape", SHELF)
def test_a_closed_surface_that_stands_where_it_is_put(shape: str) -> None:
    size = (0.8, 1.1, 0.3)
    vertices, faces = Thing(shape, (1.0, 2.0, 3.0), size_m=size).placed()
    assert encloses(faces)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    np.testing.assert_allclose(low, [0.6, 0.9, 2.85])
    np.testing.assert_allclose(high, [1.4, 2.0, 3.15])
    filled = volume(vertices, faces) / np.prod(size)
    assert filled == pytest.approx({"table": 0.0652, "doorway": 0.4112}.get(shape, 1.0), abs=1e-9)


@given(turn=some.floats(-360, 360), shape=some.sampled_from(sorted(SHELF)))
def test_turning_about_the_vertical(turn: float, shape: str) -> None:
    """What was ahead, at +z, turns to the right, to +x; the height and the foot's middle stay."""
    still, _ = Thing(shape, (0.5, 1.0, 2.0)).placed()
    turned, _ = Thing(shape, (0.5, 1.0, 2.0), turn).placed()
    flat = (still - [0.5, 1.0, 2.0])[:, [0, 2]] @ [1, 1j]
    expected = flat * np.exp(-1j * np.radians(turn))
    np.testing.assert_allclose((turned - [0.5, 1.0, 2.0])[:, [0, 2]] @ [1, 1j], expected, atol=1e-9)
    np.testing.assert_allclose(turned[:, 1], still[:, 1])


@pytest.mark.parametrize("suffix", ["obj", "ply", "glb", "stl"])
def test_a_mesh_file_stands_upright(tmp_path: Path, suffix: str) -> None:
    """A wedge of 2 × 1 × 4 m whose edge, up in the file, is up in the scene, where y is down."""
    import trimesh

    corners = [[0, 0, 0], [2, 0, 0], [2, 0, 4], [0, 0, 4], [1, 1, 0], [1, 1, 4]]
    faces = [[0, 2, 1], [0, 3, 2], [0, 1, 4], [3, 5, 2], [0, 4, 5], [0, 5, 3], [1, 2, 5], [1, 5, 4]]
    path = tmp_path / f"wedge.{suffix}"
    trimesh.Trimesh(np.add(corners, [7.0, 5.0, 3.0]), np.fliplr(faces)).export(path)
    wedge = with_things(MESH, [Thing(str(path), (0.0, 1.0, 2.0))]).surroundings
    assert wedge is not None
    np.testing.assert_allclose(wedge.vertices_m.min(axis=0), [-1, 0, 0], atol=1e-6)
    np.testing.assert_allclose(wedge.vertices_m.max(axis=0), [1, 1, 4], atol=1e-6)
    highest = wedge.vertices_m[wedge.vertices_m[:, 1] < 0.5]
    np.testing.assert_allclose(highest[:, 0], 0, atol=1e-6)
    assert volume(wedge.vertices_m, wedge.faces) == pytest.approx(4.0, rel=1e-5)
    sized = with_things(MESH, [Thing(str(path), (0, 1, 2), size_m=(1, 0.5, 1))]).surroundings
    assert sized is not None
    np.testing.assert_allclose(np.ptp(sized.vertices_m, axis=0), [1, 0.5, 1], atol=1e-6)


def test_a_file_without_thickness_keeps_none(tmp_path: Path) -> None:
    path = tmp_path / "flat.obj"
    path.write_text("v 0 0 0\nv 2 0 0\nv 0 3 0\nf 1 2 3\n")
    flat = with_things(MESH, [Thing(str(path), (0, 0, 1), size_m=(1, 1, 1))]).surroundings
    assert flat is not None
    np.testing.assert_allclose(np.ptp(flat.vertices_m, axis=0), [1, 1, 0])


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"shape": "sofa"}, "'sofa'"),
        ({"position_m": (0, np.nan, 1)}, "nan"),
        ({"position_m": (0, 1001, 1)}, "1001"),
        ({"position_m": (0, 1)}, "three numbers"),
        ({"turn_deg": 361}, "361"),
        ({"turn_deg": np.nan}, "nan"),
        ({"size_m": (1, 0, 1)}, "size of the box"),
        ({"size_m": (1, 101, 1)}, "101"),
    ],
)
def test_what_cannot_be_is_refused(changes: Any, said: str) -> None:
    with pytest.raises(Sd2Error, match=said):
        Thing(**({"shape": "box", "position_m": (0.0, 0.0, 1.0)} | changes))


def test_files_that_are_no_surface_are_refused(tmp_path: Path) -> None:
    points, nowhere = tmp_path / "points.obj", tmp_path / "nowhere.obj"
    points.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n")
    nowhere.write_text("v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    for path, said in ((points, "0 triangles"), (nowhere, "without a place")):
        with pytest.raises(Sd2Error, match=said):
            with_things(MESH, [Thing(str(path), (0, 0, 1))])
    with pytest.raises(Sd2Error, match="is not there"):
        with_things(MESH, [Thing(str(tmp_path / "gone.obj"), (0, 0, 1))])
    with pytest.raises(Sd2Error, match="101 things"):
        with_things(MESH, [Thing("box", (0, 0, 1))] * (MAX_THINGS + 1))
