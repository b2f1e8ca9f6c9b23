"""Fewer vertices, the same ones in every frame, each for as many as merged into it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.mesh.decimation import decimate
from sd2core.mesh.sequence import MeshSequence
from sd2core.timebase import Timebase

KEPT = (0.5, 0.25, 0.1)


def ball(divisions: int = 4) -> tuple[NDArray[Any], NDArray[np.int32]]:
    import trimesh

    made = trimesh.creation.icosphere(subdivisions=divisions, radius=0.5)
    return np.asarray(made.vertices), np.asarray(made.faces, np.int32)


def moving(
    vertices: NDArray[Any], faces: NDArray[Any] | None, frames: int = 5, source: str = "ball.npz"
) -> MeshSequence:
    """Stretched more and more along x, so that vertices move differently."""
    stretch = 1 + 0.1 * np.arange(frames)[:, None] * np.array([1.0, 0.0, 0.0])
    positions = vertices[None] * stretch[:, None] + np.array([0.0, 0.0, 2.0])
    return MeshSequence(positions, faces, Timebase(np.arange(frames) / 30), source)


def directed_edges(faces: NDArray[Any]) -> set[tuple[int, int]]:
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).tolist()
    assert len({tuple(edge) for edge in edges}) == len(edges)
    return {(a, b) for a, b in edges}


def columns_of(small: MeshSequence, mesh: MeshSequence) -> NDArray[np.intp]:
    """Which of the mesh's vertices were kept; all frames are asserted to agree."""
    number = {tuple(place): v for v, place in enumerate(mesh.frame(0).tolist())}
    columns = np.array([number[tuple(place)] for place in small.frame(0).tolist()])
    for frame in range(mesh.frame_count):
        np.testing.assert_array_equal(small.frame(frame), mesh.frame(frame)[columns])
    return columns


@pytest.mark.parametrize("kept", KEPT)
def test_a_closed_surface_stays_closed_and_keeps_its_own_vertices(kept: float) -> None:
    mesh = moving(*ball())
    small = decimate(mesh, kept)
    # For a closed surface of genus 0, F = 2V − 4.
    assert small.vertex_count == pytest.approx(kept * mesh.vertex_count, rel=0.02)
    columns = columns_of(small, mesh)
    assert len(set(columns.tolist())) == small.vertex_count
    assert small.faces is not None
    assert np.unique(small.faces).size == small.vertex_count
    edges = directed_edges(small.faces)
    assert all((b, a) in edges for a, b in edges)
    assert small.vertex_count - len(edges) // 2 + len(small.faces) == 2
    a, b, c = small.frame(0)[small.faces].transpose(1, 0, 2) - [0.0, 0.0, 2.0]
    volume = np.einsum("fi,fi->", a, np.cross(b, c)) / 6  # positive: still facing outwards
    # Corners stay on the sphere, so the volume lies inside: (1 − 2·e²) with edges e²≈4π/0.1V.
    assert 0.95 < volume / (4 / 3 * np.pi * 0.5**3) < 1.0


@pytest.mark.parametrize("kept", KEPT)
def test_every_vertex_is_stood_for_once(kept: float) -> None:
    mesh = moving(*ball())
    small = decimate(mesh, kept)
    assert small.vertex_counts is not None
    assert small.vertex_counts.min() >= 1
    assert small.represented_count == mesh.vertex_count == mesh.represented_count
    again = decimate(small, 0.5)
    assert again.represented_count == mesh.vertex_count
    assert again.vertex_count < 0.6 * small.vertex_count


def test_it_says_what_it_is() -> None:
    small = decimate(moving(*ball()), 0.25)
    words = f"decimated to {small.vertex_count} of 2562 vertices"
    assert small.source == f"ball.npz, {words}"
    assert small.notes == (words,)


def test_all_of_it_is_the_mesh_itself() -> None:
    mesh = moving(*ball(1))
    assert decimate(mesh, 1.0) is mesh


def test_the_size_makes_no_difference() -> None:
    vertices, faces = ball(3)
    vertices = vertices * [1.0, 0.7, 1.3] + 0.02 * np.sin(7 * vertices[:, ::-1])
    made = [
        # Powers of two lose no digits.
        decimate(MeshSequence(scale * vertices[None], faces, Timebase([0.0])), 0.2)
        for scale in (2.0**-10, 1.0, 2.0**10)
    ]
    for small, scale in zip(made, (2.0**-10, 1.0, 2.0**10), strict=True):
        np.testing.assert_array_equal(small.frame(0) / scale, made[1].frame(0))
        np.testing.assert_array_equal(small.faces, made[1].faces)


def test_chunks_on_disk_are_read_a_stretch_at_a_time(tmp_path: Path) -> None:
    import zarr

    mesh = moving(*ball(3), frames=40)
    positions = np.asarray(mesh.vertices, np.float32)
    asked: list[Any] = []

    class Stored:
        shape, dtype = positions.shape, positions.dtype

        def __init__(self) -> None:
            self.array = zarr.create_array(
                tmp_path / "mesh.zarr", shape=self.shape, chunks=(8, 642, 3), dtype="f4"
            )
            self.array[:] = positions

        def __getitem__(self, key: Any) -> Any:
            asked.append(key)
            return self.array[key]

    stored = decimate(MeshSequence(Stored(), mesh.faces, mesh.timebase, "zarr"), 0.25)
    memory = decimate(MeshSequence(positions, mesh.faces, mesh.timebase, "memory"), 0.25)
    np.testing.assert_array_equal(stored.read(11, 29), memory.read(11, 29))
    assert asked == [slice(20, 21), slice(11, 29)]  # the middle frame to simplify, and these
    columns = columns_of(memory, MeshSequence(positions, mesh.faces, mesh.timebase))
    picked = positions[:, columns]
    for key in (3, np.int64(3), slice(2, 9), (slice(1, 4), slice(5, 7)), (2, 5), (3, 5, 1)):
        np.testing.assert_array_equal(stored.vertices[key], picked[key])
    np.testing.assert_array_equal(np.asarray(stored.vertices), picked)


def area_of(mesh: MeshSequence) -> float:
    a, b, c = mesh.frame(0)[mesh.faces].transpose(1, 0, 2)
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


@pytest.mark.parametrize("name", ["small.npz", "small.zarr"])
def test_it_is_saved_with_its_counts(tmp_path: Path, name: str) -> None:
    small = decimate(moving(*ball(3)), 0.25)
    save_mesh(small, tmp_path / name)
    loaded = load_mesh(tmp_path / name)
    assert loaded.represented_count == 642
    np.testing.assert_array_equal(loaded.vertex_counts, small.vertex_counts)
    np.testing.assert_array_equal(loaded.faces, small.faces)
    np.testing.assert_array_equal(np.asarray(loaded.vertices[:]), np.asarray(small.vertices))


def simplified(vertices: Any, faces: Any, kept: float = 0.5) -> MeshSequence:
    small = decimate(moving(np.asarray(vertices, float), np.asarray(faces)), kept)
    assert small.represented_count == len(vertices)
    columns_of(small, moving(np.asarray(vertices, float), np.asarray(faces)))
    return small


def test_an_open_sheet() -> None:
    line = np.linspace(0, 1, 21)
    x, y = np.meshgrid(line, line)
    vertices = np.stack([x.ravel(), y.ravel(), 0.1 * np.sin(5 * x.ravel())], axis=1)
    corner = (np.arange(20)[:, None] * 21 + np.arange(20)).ravel()
    faces = np.concatenate(
        [
            np.stack([corner, corner + 21, corner + 1], 1),
            np.stack([corner + 1, corner + 21, corner + 22], 1),
        ]
    )
    small = simplified(vertices, faces, 0.25)
    assert small.vertex_count < 0.35 * len(vertices)
    # Its border is pulled in by less than one of the 20 cells on each side.
    assert 0.9**2 < area_of(small) / area_of(moving(vertices, faces)) < 1.02


def test_loose_vertices_stay_as_they_are() -> None:
    vertices, faces = ball(3)
    loose = np.array([[0.0, 0.0, 0.0], [5.0, 5.0, 5.0]])
    small = simplified(np.concatenate([loose[:1], vertices, loose[1:]]), np.add(faces, 1))
    assert small.vertex_counts is not None
    np.testing.assert_array_equal(small.frame(0)[[0, -1]] - [0, 0, 2], loose)
    assert small.vertex_counts[[0, -1]].tolist() == [1, 1]


def test_a_soup_of_triangles_is_one_surface() -> None:
    vertices, faces = ball(3)
    soup = vertices[faces].reshape(-1, 3)
    own = MeshSequence(soup[None], np.arange(len(soup)).reshape(-1, 3), Timebase([0.0]))
    small = decimate(own, 0.25)
    assert small.represented_count == len(soup)
    assert small.faces is not None
    edges = directed_edges(small.faces)
    assert all((b, a) in edges for a, b in edges)


def test_small_pieces_that_vanish_are_still_counted() -> None:
    vertices, faces = ball(4)
    bead = 0.01 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) + [0.6, 0.0, 0.0]
    sides = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]) + len(vertices)
    simplified(np.concatenate([vertices, bead]), np.concatenate([faces, sides]), 0.05)


@pytest.mark.parametrize(
    ("vertices", "faces"),
    [
        (np.eye(3), [[0, 1, 2]]),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2], [1, 3, 2]]),
        (np.zeros((5, 3)), [[0, 1, 2], [2, 3, 4], [0, 2, 4], [1, 2, 3], [0, 1, 4]]),
        (np.eye(3), [[0, 0, 1], [2, 2, 2]]),
        # Three sheets on one edge.
        (
            [[0, 0, 0], [0, 1, 0], [1, 0, 0], [-1, 0, 0], [0, 0, 1]],
            [[0, 1, 2], [0, 1, 3], [0, 1, 4]],
        ),
        (np.repeat(np.eye(3), 2, axis=0), [[0, 2, 4], [1, 3, 5]] * 3),
    ],
)
def test_what_is_too_small_is_left_alone_with_a_note(vertices: Any, faces: Any) -> None:
    mesh = moving(np.asarray(vertices, float), np.asarray(faces))
    small = decimate(mesh, 0.5)
    assert small.vertices is mesh.vertices
    assert small.vertex_counts is None
    assert small.notes == ("not decimated: fewer than four faces would be left",)


def test_a_surface_that_meets_itself() -> None:
    # Two balls that share a vertex, and one whose faces are all there twice.
    vertices, faces = ball(3)
    other = faces + len(vertices) - 1
    other[other == len(vertices) - 1] = 0
    shifted = vertices[1:] + 2 * vertices[0]
    simplified(np.concatenate([vertices, shifted]), np.concatenate([faces, other]), 0.25)
    simplified(vertices, np.concatenate([faces, faces]), 0.25)


@pytest.mark.parametrize("kept", [0.0, -0.5, 1.5, float("nan")])
def test_a_share_that_is_none(kept: float) -> None:
    with pytest.raises(Sd2Error, match="a share above 0 and up to 1"):
        decimate(moving(*ball(1)), kept)


def test_a_point_cloud_and_a_broken_frame() -> None:
    vertices, faces = ball(2)
    with pytest.raises(Sd2Error, match=r"ball\.npz has no faces"):
        decimate(moving(vertices, None), 0.5)
    broken = vertices.copy()
    broken[7, 1] = np.inf
    with pytest.raises(Sd2Error, match=r"ball\.npz: vertex 7 of frame 2 is"):
        decimate(moving(broken, faces), 0.5)


@pytest.mark.parametrize("counts", [np.ones(3, int), np.zeros(12, int)])
def test_counts_that_do_not_fit_are_refused(counts: NDArray[np.int64]) -> None:
    vertices, faces = ball(0)
    with pytest.raises(Sd2Error, match="vertex_counts"):
        MeshSequence(vertices[None], faces, Timebase([0.0]), vertex_counts=counts)
