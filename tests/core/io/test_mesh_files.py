from __future__ import annotations

import json
import os
import random
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.io.frame_names import natural_key
from sd2core.io.kinds import kind_of
from sd2core.io.mesh import load_mesh
from sd2core.io.mesh_files import read_surface
from sd2core.progress import Cancelled

SHAPE = trimesh.creation.icosphere(subdivisions=1, radius=0.85)


def write_frames(folder: Path, suffix: str, count: int = 12) -> None:
    """Frames named without leading zeros; each stands 1 cm nearer than the last."""
    folder.mkdir(exist_ok=True)
    order = list(range(count))
    random.Random(0).shuffle(order)
    for k in order:
        moved = trimesh.Trimesh(
            SHAPE.vertices + np.array([0, 0, 3 - 0.01 * k]), SHAPE.faces, process=False
        )
        moved.export(folder / f"body_{k}{suffix}")


@given(st.lists(st.integers(0, 10**6), unique=True, min_size=2))
def test_numbers_in_names_sort_by_value(numbers: list[int]) -> None:
    names = [f"a1_frame{n}.obj" for n in numbers]
    assert sorted(names, key=natural_key) == [f"a1_frame{n}.obj" for n in sorted(numbers)]


@given(st.lists(st.text("ab019²_.", max_size=6), min_size=2))
def test_the_order_of_any_names_depends_on_the_names_only(names: list[str]) -> None:
    reverse = names[::-1]
    assert sorted(names, key=natural_key) == sorted(reverse, key=natural_key)


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".glb"])
def test_a_folder_is_read_in_natural_order(tmp_path: Path, suffix: str) -> None:
    write_frames(tmp_path / "frames", suffix)
    mesh = load_mesh(tmp_path / "frames", frames_per_s=25)
    assert mesh.frame_count == 12
    expected = SHAPE.vertices[None] + (3 - 0.01 * np.arange(12))[:, None, None] * [0, 0, 1]
    np.testing.assert_allclose(mesh.read(0, 12), expected, atol=1e-6)
    np.testing.assert_array_equal(mesh.faces, SHAPE.faces)
    np.testing.assert_allclose(mesh.times_s, np.arange(12) / 25)
    assert mesh.notes == ()


def test_a_pattern_chooses_files(tmp_path: Path) -> None:
    write_frames(tmp_path / "frames", ".obj")
    mesh = load_mesh(tmp_path / "frames" / "body_1*.obj", frames_per_s=25)
    np.testing.assert_allclose(mesh.read(0, 3)[:, :, 2].mean(axis=1), [2.99, 2.90, 2.89], atol=1e-6)
    with pytest.raises(Sd2Error, match=r"arm_\*\.obj matches no mesh file"):
        load_mesh(tmp_path / "frames" / "arm_*.obj")


def test_a_folder_whose_name_looks_like_a_pattern_is_a_folder(tmp_path: Path) -> None:
    write_frames(tmp_path / "take [1]", ".obj", count=2)
    assert load_mesh(tmp_path / "take [1]").frame_count == 2


def test_one_file_is_one_frame(tmp_path: Path) -> None:
    write_frames(tmp_path, ".obj", count=1)
    assert load_mesh(tmp_path / "body_0.obj").frame_count == 1


def test_the_order_of_vertices_is_kept_even_where_they_coincide(tmp_path: Path) -> None:
    text = "v 0 0 2\nv 1 0 2\nv 0 1 2\nv 0 0 2\nv 9 0 2\nv 0 0 2\nf 1 2 3\nf 4 3 2\n"
    (tmp_path / "a.obj").write_text(text)
    mesh = load_mesh(tmp_path / "a.obj")
    np.testing.assert_array_equal(mesh.frame(0)[:, 0], [0, 1, 0, 0, 9, 0])
    np.testing.assert_array_equal(mesh.faces, [[0, 1, 2], [3, 2, 1]])


def test_texture_coordinates_do_not_split_vertices(tmp_path: Path) -> None:
    text = (
        "v 0 0 2\nv 1 0 2\nv 0 1 2\nv 1 1 2\nvt 0 0\nvt 1 0\nvt 0 1\nvt 0.5 0.5\n"
        "f 1/1 2/2 3/3\nf 2/4 4/1 3/2\n"
    )
    (tmp_path / "a.obj").write_text(text)
    mesh = load_mesh(tmp_path / "a.obj")
    np.testing.assert_array_equal(mesh.frame(0)[:, :2], [[0, 0], [1, 0], [0, 1], [1, 1]])
    np.testing.assert_array_equal(mesh.faces, [[0, 1, 2], [1, 3, 2]])


def test_a_point_cloud_of_ply_files(tmp_path: Path) -> None:
    for k in range(3):
        points = np.random.default_rng(k).normal((0, 0, 3), 0.3, (20, 3))
        trimesh.PointCloud(points).export(tmp_path / f"cloud{k}.ply")
    mesh = load_mesh(tmp_path, frames_per_s=10)
    assert mesh.faces is None
    assert mesh.vertex_count == 20
    assert "point cloud" in mesh.notes[0]


def test_another_number_of_vertices_is_named_with_its_file(tmp_path: Path) -> None:
    write_frames(tmp_path, ".obj")
    trimesh.creation.box().export(tmp_path / "body_7.obj")
    with pytest.raises(
        Sd2Error, match=r"body_7\.obj has 8 vertices, body_0\.obj has 42.*same vertices.*pattern"
    ):
        load_mesh(tmp_path)


def test_other_faces_are_named_with_their_file(tmp_path: Path) -> None:
    write_frames(tmp_path, ".ply")
    shape = trimesh.Trimesh(SHAPE.vertices, SHAPE.faces[:-1], process=False)
    shape.export(tmp_path / "body_4.ply")
    with pytest.raises(
        Sd2Error, match=r"body_4\.ply has other faces \(79\) than body_0\.ply \(80\)"
    ):
        load_mesh(tmp_path)


def test_a_mixture_of_kinds_is_refused(tmp_path: Path) -> None:
    write_frames(tmp_path, ".ply", 2)
    write_frames(tmp_path, ".obj", 2)
    with pytest.raises(Sd2Error, match=r"several kinds \(\.obj, \.ply\).*/\*\.obj"):
        load_mesh(tmp_path)


def test_a_damaged_file_is_named(tmp_path: Path) -> None:
    write_frames(tmp_path, ".ply", 3)
    path = tmp_path / "body_1.ply"
    path.write_bytes(path.read_bytes()[:150])
    with pytest.raises(Sd2Error, match=r"body_1\.ply cannot be read as a mesh"):
        load_mesh(tmp_path)


def test_reading_files_can_be_cancelled(tmp_path: Path) -> None:
    write_frames(tmp_path, ".obj", 4)
    seen: list[tuple[int, int]] = []

    def stop(done: int, total: int) -> None:
        seen.append((done, total))
        if done == 2:
            raise Cancelled

    with pytest.raises(Cancelled):
        load_mesh(tmp_path, progress=stop)
    assert seen == [(0, 4), (1, 4), (2, 4)]


def glb(path: Path, change: Callable[[dict[str, Any]], None]) -> Path:
    """A surface as GLB whose description was changed."""
    trimesh.creation.icosphere(subdivisions=3).export(path)
    content = path.read_bytes()
    end = 20 + int.from_bytes(content[12:16], "little")
    scene = json.loads(content[20:end])
    change(scene)
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    head = content[:8] + struct.pack("<II", len(content) - end + 20 + len(text), len(text))
    path.write_bytes(head + content[16:20] + text + content[end:])
    return path


def many_placed(scene: dict[str, Any]) -> None:
    one = next(node for node in scene["nodes"] if "mesh" in node)
    scene["nodes"] += [one] * 500


def many_numbers(scene: dict[str, Any]) -> None:
    scene["accessors"].append({"componentType": 5126, "type": "VEC3", "count": 10**6})


@pytest.mark.parametrize("change", [many_placed, many_numbers])
def test_a_scene_larger_than_its_file_can_hold_is_refused(
    tmp_path: Path, change: Callable[[dict[str, Any]], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SD2_READ_LIMIT_GB", "0.001")
    assert len(read_surface(glb(tmp_path / "whole.glb", lambda scene: None))[0]) == 642
    with pytest.raises(Sd2Error, match=r"large\.glb declares .* MB"):
        read_surface(glb(tmp_path / "large.glb", change))


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".glb"])
def test_a_pipe_is_not_opened(tmp_path: Path, suffix: str) -> None:
    os.mkfifo(tmp_path / f"pipe{suffix}")
    with pytest.raises(Sd2Error, match=r"pipe\.\w+ is a named pipe"):
        read_surface(tmp_path / f"pipe{suffix}")


@pytest.mark.parametrize("name", ["walk.bvh", "walk.FBX", "walk.usdz"])
def test_motion_of_skeletons_is_refused_with_the_way_out(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"HIERARCHY")
    assert kind_of(tmp_path / name) == "mesh"
    with pytest.raises(Sd2Error, match=r"motion of a skeleton.*OBJ for each frame") as caught:
        load_mesh(tmp_path / name)
    assert ("no surface" in caught.value.found) == name.endswith("bvh")


def test_an_animation_is_not_read_as_one_still_pose(tmp_path: Path) -> None:
    scene = trimesh.Scene(trimesh.creation.box())
    path = tmp_path / "walk.glb"
    path.write_bytes(scene.export(file_type="glb"))
    assert load_mesh(path).frame_count == 1

    def animated(tree: dict[str, Any]) -> None:
        tree["animations"] = [{"channels": [], "samplers": []}]

    path.write_bytes(trimesh.exchange.gltf.export_glb(scene, tree_postprocessor=animated))
    with pytest.raises(Sd2Error, match=r"walk\.glb holds an animation"):
        load_mesh(path)
