"""What must not be read as something else: materials, missing chunks, forbidden files."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from sd2core.errors import Sd2Error
from sd2core.io import stored_vertices
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.io.mesh_files import read_surface
from sd2core.mesh.sequence import MeshSequence
from sd2core.timebase import Timebase
from tests.damaged_files import change, cut, lose

OBJ = """mtllib person.mtl
o person
v 0 0 2
v 1 0 2
v 0 1 2
v 1 1 2
v 5 5 5
vt 0 0
vt 1 0
vt 0 1
g upper
usemtl skin
f 1/1 2/2 3/3
g lower
usemtl cloth
f 2/2 4/3 3/1
"""


def long_mesh(frames: int = 3000) -> MeshSequence:
    rng = np.random.default_rng(3)
    vertices = rng.normal(size=(frames, 120, 3)).astype(np.float32) * 0.3
    vertices[:, :, 2] += 3.0
    faces = rng.permuted(np.tile(np.arange(120), (50, 1)), axis=1)[:, :3].astype(np.int32)
    return MeshSequence(vertices, faces, Timebase.regular(frames, 30.0))


def test_materials_and_textures_leave_the_vertices_alone(tmp_path):
    path = tmp_path / "person.obj"
    path.write_text(OBJ)
    vertices, faces = read_surface(path)
    assert vertices.tolist() == [[0, 0, 2], [1, 0, 2], [0, 1, 2], [1, 1, 2], [5, 5, 5]]
    assert faces is not None
    assert sorted(map(sorted, faces.tolist())) == [[0, 1, 2], [1, 2, 3]]


def test_relative_numbers_polygons_and_continued_lines_are_read(tmp_path):
    path = tmp_path / "quad.obj"
    path.write_text("v 0 0 2\nv 1 0 2\nv 1 1 2\nv 0 1 2\nf -4//1 -3//1 \\\n-2//1 -1//1\n")
    vertices, faces = read_surface(path)
    assert len(vertices) == 4
    assert faces is not None
    assert set(faces.ravel().tolist()) == {0, 1, 2, 3}
    assert len(faces) == 2


def chunks_of(path: Path) -> list[Path]:
    return sorted(entry for entry in (path / "vertices" / "c").rglob("*") if entry.is_file())


@pytest.mark.parametrize("damage", [lose, cut, change])
@pytest.mark.parametrize(("number", "pose"), [(0, 1456), (1, 1455)])
def test_frames_of_a_damaged_chunk_are_left_out(
    tmp_path: Path, damage: Callable[[Path], None], number: int, pose: int
) -> None:
    path = tmp_path / "mesh.zarr"
    mesh = long_mesh()
    save_mesh(mesh, path)
    damage(path / "vertices" / "c" / str(number) / "0" / "0")
    first, last = (0, 1455) if number == 0 else (1456, 2911)
    found = load_mesh(path)
    assert any(f"frames {first} to {last} of vertices (vertices/c/{number}" in one
               for one in found.notes)  # fmt: skip
    absent = np.zeros(3000, bool)
    absent[first : last + 1] = True
    assert found.present is not None
    assert np.array_equal(found.present, ~absent)
    vertices = found.read(0, 3000)
    assert np.array_equal(vertices[~absent], mesh.vertices[~absent])
    assert (vertices[absent] == mesh.vertices[pose]).all()
    assert np.array_equal(found.frame(first + 7), mesh.vertices[pose])


def test_a_mesh_of_which_no_chunk_is_whole_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "mesh.zarr"
    save_mesh(long_mesh(), path)
    for chunk in chunks_of(path):
        change(chunk)
    with pytest.raises(Sd2Error, match=r"mesh\.zarr cannot be read: frames 0 to 1455 of vertices"):
        load_mesh(path)


def test_damage_that_comes_after_opening_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stored_vertices, "_KEPT_BYTES", 0)  # None but the chunk read last.
    path = tmp_path / "mesh.zarr"
    save_mesh(long_mesh(), path)
    mesh = load_mesh(path)
    change(chunks_of(path)[1])
    with pytest.raises(Sd2Error, match=r"mesh\.zarr cannot be read: frames 1456 to 2911"):
        mesh.read(1400, 1500)
    assert len(mesh.read(2912, 3000)) == 88


def test_damaged_faces_are_named(tmp_path: Path) -> None:
    path = tmp_path / "mesh.zarr"
    save_mesh(long_mesh(), path)
    change(path / "faces" / "c" / "0" / "0")
    with pytest.raises(Sd2Error, match=r"mesh\.zarr cannot be read: rows 0 to 49 of faces"):
        load_mesh(path)


def test_no_faces_at_all_make_a_point_cloud(tmp_path):
    path = tmp_path / "cloud.npz"
    mesh = long_mesh(4)
    np.savez(path, vertices=mesh.vertices, faces=np.zeros((0, 3), int), times_s=mesh.times_s)
    assert load_mesh(path).faces is None


@pytest.mark.skipif(sys.platform == "win32" or os.geteuid() == 0, reason="root may read all files")
def test_a_forbidden_file_is_not_called_damaged(tmp_path):
    path = tmp_path / "mesh.npz"
    save_mesh(long_mesh(4), path)
    path.chmod(0)
    with pytest.raises(Sd2Error, match="may not be read"):
        load_mesh(path)


def test_a_forbidden_file_is_not_called_damaged_for_anyone(tmp_path, monkeypatch):
    path = tmp_path / "mesh.npz"
    save_mesh(long_mesh(4), path)

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(Sd2Error, match=r"mesh\.npz may not be read \(Permission denied\)"):
        load_mesh(path)
