from __future__ import annotations

import gc
import re
import weakref
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
import zarr
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.resources import resource_path
from sd2core.io import mesh_arrays, mesh_checks, stored_vertices
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.mesh.decimation import decimate
from sd2core.mesh.presence import runs
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import Cancelled
from sd2core.timebase import Timebase
from tools.build_sample.sample import write_compact_mesh

SUFFIXES = [".npz", ".zarr", ".zarr.zip"]


def body(frames: int = 6, distance_m: float = 2.0) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """A closed surface as tall as a person that walks towards the camera."""
    shape = trimesh.creation.icosphere(subdivisions=1, radius=0.85)
    steps = np.linspace(distance_m, distance_m - 0.5, frames)
    moved = shape.vertices[None] + steps[:, None, None] * np.array([0, 0, 1.0])
    return moved.astype(np.float32), shape.faces.astype(np.int32)


def write(path: Path, **arrays: Any) -> Path:
    np.savez(path, **arrays)
    return path


def times(frames: int) -> NDArray[np.float64]:
    return np.arange(frames) / 30


def one_note(mesh: MeshSequence, text: str) -> None:
    assert len(mesh.notes) == 1
    assert re.search(text, mesh.notes[0])


# -- round trips ---------------------------------------------------------------


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_frames_without_a_person_come_back(tmp_path: Path, suffix: str) -> None:
    vertices, faces = body()
    present = np.array([True, False, False, True, True, False])
    mesh = MeshSequence(vertices, faces, Timebase(times(6)), present=present)
    save_mesh(mesh, tmp_path / f"m{suffix}")
    read = load_mesh(tmp_path / f"m{suffix}")
    np.testing.assert_array_equal(read.present, present)
    # As any other mesh where there is somebody in every frame.
    save_mesh(MeshSequence(vertices, faces, Timebase(times(6))), tmp_path / f"whole{suffix}")
    assert load_mesh(tmp_path / f"whole{suffix}").present is None


def test_a_scene_of_two_is_no_mesh_to_write(tmp_path: Path) -> None:
    vertices, faces = body()
    one = MeshSequence(vertices, faces, Timebase(times(6)))
    with pytest.raises(Sd2Error, match=r"scene of 2 bodies, and m\.zarr holds one"):
        save_mesh(replace(one, others=(one,)), tmp_path / "m.zarr")
    assert not list(tmp_path.iterdir())


def test_the_compact_form_keeps_everything(tmp_path: Path) -> None:
    vertices, faces = body()
    present = np.array([True, False, False, True, True, False])
    mesh = decimate(MeshSequence(vertices, faces, Timebase(times(6)), present=present), 0.5)
    write_compact_mesh(mesh, tmp_path / "m.zarr")
    read = load_mesh(tmp_path / "m.zarr")
    np.testing.assert_array_equal(read.present, present)
    np.testing.assert_array_equal(read.vertex_counts, mesh.vertex_counts)


def test_what_a_file_says_of_empty_frames_may_be_numbers_but_must_fit(tmp_path: Path) -> None:
    vertices, faces = body()
    vertices[1, 3] = np.nan  # where nobody is, vertices say nothing
    given: dict[str, Any] = {"vertices": vertices, "faces": faces, "times_s": times(6)}
    path = write(tmp_path / "m.npz", **given, present=np.array([1, 0, 1, 1, 1, 1]))
    mesh = load_mesh(path)
    assert runs(~mesh.presence.present) == ((1, 2),)
    assert mesh.notes == ()
    np.testing.assert_array_equal(mesh.frame(1), vertices[0])
    write(path, **given, present=np.ones(5, bool))
    with pytest.raises(Sd2Error, match=r"m\.npz: present is of type bool and shape \(5,\)"):
        load_mesh(path)


def test_before_the_first_known_pose_stands_that_one(tmp_path: Path) -> None:
    vertices, faces = body()
    vertices[:2] = np.nan
    mesh = load_mesh(write(tmp_path / "m.npz", vertices=vertices, faces=faces, times_s=times(6)))
    assert runs(~mesh.presence.present) == ((0, 2),)
    np.testing.assert_array_equal(mesh.read(0, 3), vertices[[2, 2, 2]])


@given(
    frames=st.integers(1, 12),
    vertices=st.integers(1, 30),
    doubles=st.booleans(),
    has_faces=st.booleans(),
    chunk_bytes=st.sampled_from([1, 500, 2**21]),
    seed=st.integers(0, 99),
)
@settings(max_examples=15)
def test_every_format_gives_back_what_was_saved(
    tmp_path_factory: pytest.TempPathFactory,
    frames: int,
    vertices: int,
    doubles: bool,
    has_faces: bool,
    chunk_bytes: int,
    seed: int,
) -> None:
    generator = np.random.default_rng(seed)
    moving = generator.normal((0, 0, 3), 0.5, (frames, vertices, 3))
    faces = generator.integers(0, vertices, (4, 3)) if has_faces else None
    mesh = MeshSequence(
        moving if doubles else moving.astype(np.float32),
        faces,
        Timebase(np.cumsum(generator.uniform(0.01, 0.1, frames))),
    )
    folder = tmp_path_factory.mktemp("round")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mesh_arrays, "_CHUNK_BYTES", chunk_bytes)
        save_mesh(mesh, folder / "m.npz")
        save_mesh(load_mesh(folder / "m.npz", scale=1), folder / "m.zarr")
        save_mesh(load_mesh(folder / "m.zarr", scale=1), folder / "m.zarr.zip")
    for suffix in SUFFIXES:
        found = load_mesh(folder / f"m{suffix}", scale=1)
        assert found.read(0, frames).dtype == mesh.vertices.dtype
        np.testing.assert_array_equal(found.read(0, frames), mesh.vertices[:])
        np.testing.assert_array_equal(found.times_s, mesh.times_s)
        if faces is None:
            assert found.faces is None
        else:
            np.testing.assert_array_equal(found.faces, faces)
    assert sorted(p.name for p in folder.iterdir()) == ["m.npz", "m.zarr", "m.zarr.zip"]


def test_npz_is_readable_by_numpy_and_the_same_every_time(tmp_path: Path) -> None:
    vertices, faces = body()
    mesh = MeshSequence(vertices, faces, Timebase(times(6)))
    save_mesh(mesh, tmp_path / "a.npz")
    save_mesh(mesh, tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    with np.load(tmp_path / "a.npz") as archive:
        assert sorted(archive.files) == ["faces", "times_s", "vertices"]
        np.testing.assert_array_equal(archive["vertices"], vertices)
        assert archive["faces"].dtype == np.int32


def test_zarr_is_chunked_along_time_with_all_vertices(tmp_path: Path) -> None:
    vertices = np.zeros((3000, 1229, 3), np.float32)
    save_mesh(MeshSequence(vertices, None, Timebase(times(3000))), tmp_path / "m.zarr")
    array = zarr.open_group(str(tmp_path / "m.zarr"), mode="r")["vertices"]
    assert array.chunks[1:] == (1229, 3)
    assert 1e6 < np.prod(array.chunks) * 4 < 4e6


@pytest.mark.parametrize("suffix", [".zarr", ".zarr.zip"])
def test_a_zarr_mesh_stays_on_disk(
    tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mesh_arrays, "_CHUNK_BYTES", 42 * 12 * 10)  # ten frames a chunk
    vertices, faces = body(400)
    path = tmp_path / f"m{suffix}"
    save_mesh(MeshSequence(vertices, faces, Timebase(times(400))), path)
    monkeypatch.setattr(mesh_checks, "_JUDGED_ON_DISK_BYTES", 0)  # one chunk is judged
    read: list[int] = []
    original = mesh_arrays.StoredVertices.__getitem__

    def counted(self: Any, key: Any) -> Any:
        part = original(self, key)
        read.append(part.size)
        return part

    monkeypatch.setattr(mesh_arrays.StoredVertices, "__getitem__", counted)
    mesh = load_mesh(path)
    assert sum(read) < 0.05 * vertices.size
    np.testing.assert_array_equal(mesh.read(5, 25), vertices[5:25])
    assert mesh.vertices.frames_per_chunk == 10


def test_chunks_are_read_once_while_there_is_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mesh_arrays, "_CHUNK_BYTES", 42 * 12 * 10)  # ten frames a chunk
    monkeypatch.setattr(stored_vertices, "_KEPT_BYTES", 3 * 42 * 12 * 10)
    vertices, faces = body(60)
    save_mesh(MeshSequence(vertices, faces, Timebase(times(60))), tmp_path / "m.zarr")
    mesh = load_mesh(tmp_path / "m.zarr")
    read: list[int] = []
    original = stored_vertices.StoredVertices._read

    def counted(self: Any, key: slice) -> Any:
        read.append(key.start)
        return original(self, key)

    monkeypatch.setattr(stored_vertices.StoredVertices, "_read", counted)
    mesh.read(0, 30)
    read.clear()
    for start in (20, 5, 10, 15, 0):
        np.testing.assert_array_equal(mesh.read(start, start + 5), vertices[start : start + 5])
    assert read == []
    mesh.read(30, 40)  # in place of the oldest
    mesh.read(10, 30)
    assert read == [30]
    np.testing.assert_array_equal(mesh.read(0, 10), vertices[:10])
    assert read == [30, 0]


def test_chunks_go_with_the_last_who_has_the_mesh() -> None:
    """Else a batch holds those of recordings that it is done with, until the collector runs."""
    vertices = load_mesh(resource_path("swipes.sd2") / "mesh.zarr").vertices
    vertices[0:10]
    there = weakref.ref(vertices)
    gc.disable()
    try:
        del vertices
        assert there() is None
    finally:
        gc.enable()


def test_zarr_2_groups_are_read(tmp_path: Path) -> None:
    vertices, faces = body()
    group = zarr.open_group(str(tmp_path / "old.zarr"), mode="w", zarr_format=2)
    for name, array in (("vertices", vertices), ("faces", faces), ("times_s", times(6))):
        group.create_array(name, data=array)
    mesh = load_mesh(tmp_path / "old.zarr")
    np.testing.assert_array_equal(mesh.read(0, 6), vertices)
    np.testing.assert_array_equal(mesh.faces, faces)
    assert mesh.notes == ()


@pytest.mark.parametrize("limit", [0, 2**26])
def test_stored_vertices_are_indexed_like_an_array(
    tmp_path: Path, limit: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mesh_arrays, "_CHUNK_BYTES", 42 * 12 * 7)
    vertices, faces = body(40)
    save_mesh(MeshSequence(vertices, faces, Timebase(times(40))), tmp_path / "m.zarr")
    monkeypatch.setattr(stored_vertices, "_LARGEST_CHUNK_BYTES", limit)
    mesh = load_mesh(tmp_path / "m.zarr")
    assert ("chunks of 7 frames" in "".join(mesh.notes)) == (limit == 0)
    keys = [0, -1, 13, np.int64(14), slice(3, 30), slice(6, 7), slice(7, 14), slice(35, 99),
            slice(None), slice(2, 30, 5), slice(9, 9), (slice(1, 3), 4)]  # fmt: skip
    for key in keys:
        np.testing.assert_array_equal(mesh.vertices[key], vertices[key])
    with pytest.raises(IndexError):
        mesh.vertices[40]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_saving_replaces_the_old_file_only_when_it_succeeds(tmp_path: Path, suffix: str) -> None:
    vertices, faces = body()
    path = tmp_path / f"m{suffix}"
    good = MeshSequence(vertices, faces, Timebase(times(6)))
    save_mesh(good, path)
    broken = vertices.copy()
    broken[4, 7] = np.nan

    def stop(done: int, total: int) -> None:
        raise Cancelled

    with pytest.raises(Sd2Error, match=r"vertex 7 of frame 4 is at \(nan"):
        save_mesh(MeshSequence(broken, faces, Timebase(times(6))), path)
    with pytest.raises(Cancelled):
        save_mesh(good, path, progress=stop)
    np.testing.assert_array_equal(load_mesh(path).read(0, 6), vertices)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    save_mesh(MeshSequence(vertices[:2], faces, Timebase(times(2))), path)
    assert load_mesh(path).frame_count == 2


def test_saving_under_an_unknown_name_is_refused(tmp_path: Path) -> None:
    vertices, faces = body()
    mesh = MeshSequence(vertices, faces, Timebase(times(6)))
    with pytest.raises(Sd2Error, match=r"saved as m\.obj.*\.npz, \.zarr or \.zarr\.zip"):
        save_mesh(mesh, tmp_path / "m.obj")
    with pytest.raises(Sd2Error, match="does not exist"):
        save_mesh(mesh, tmp_path / "nowhere" / "m.npz")


# -- names, times, scale ---------------------------------------------------------


def test_a_good_file_has_no_notes(tmp_path: Path) -> None:
    vertices, faces = body()
    mesh = load_mesh(write(tmp_path / "m.npz", vertices=vertices, faces=faces, times_s=times(6)))
    assert mesh.notes == ()
    assert mesh.source == str(tmp_path / "m.npz")
    assert mesh.vertices.dtype == np.float32
    np.testing.assert_array_equal(mesh.faces, faces)


def test_aliases_and_the_rate_in_the_file_are_used(tmp_path: Path) -> None:
    vertices, faces = body()
    mesh = load_mesh(write(tmp_path / "m.npz", verts=vertices, triangles=faces, fps=25.0))
    np.testing.assert_allclose(mesh.times_s, np.arange(6) / 25)
    assert mesh.notes == ()


def test_missing_times_are_assumed_with_a_note(tmp_path: Path) -> None:
    vertices, faces = body()
    path = write(tmp_path / "m.npz", vertices=vertices, faces=faces)
    mesh = load_mesh(path)
    one_note(mesh, "no times: 30 frames/s are assumed.*--fps")
    np.testing.assert_allclose(mesh.times_s, np.arange(6) / 30)
    told = load_mesh(path, frames_per_s=60)
    assert told.notes == ()
    np.testing.assert_allclose(told.times_s, np.arange(6) / 60)


def test_a_told_rate_replaces_the_files_times(tmp_path: Path) -> None:
    vertices, faces = body()
    path = write(tmp_path / "m.npz", vertices=vertices, faces=faces, times_s=times(6))
    mesh = load_mesh(path, frames_per_s=15)
    one_note(mesh, "replaced by 15 frames/s")
    np.testing.assert_allclose(mesh.times_s, np.arange(6) / 15)


@pytest.mark.parametrize("rate", [0, -1, np.nan, np.inf])
def test_impossible_rates_and_scales_are_refused(tmp_path: Path, rate: float) -> None:
    path = write(tmp_path / "m.npz", vertices=body()[0])
    with pytest.raises(Sd2Error, match="frame rate is"):
        load_mesh(path, frames_per_s=rate)
    with pytest.raises(Sd2Error, match="scale is"):
        load_mesh(path, scale=rate)


def test_times_that_do_not_fit_are_named(tmp_path: Path) -> None:
    vertices, faces = body()
    path = write(tmp_path / "m.npz", vertices=vertices, faces=faces, times_s=times(5))
    with pytest.raises(Sd2Error, match=r"m\.npz: 6 frames but times of shape \(5,\).*--fps"):
        load_mesh(path)
    falling = times(6)
    falling[3] = 0
    path = write(tmp_path / "m.npz", vertices=vertices, faces=faces, times_s=falling)
    with pytest.raises(Sd2Error, match=r"m\.npz: Frame 3 is at 0\.0.*increase"):
        load_mesh(path)


def test_one_frame_and_one_point_are_enough(tmp_path: Path) -> None:
    mesh = load_mesh(write(tmp_path / "m.npz", vertices=[[0.0, 0.0, 2.0]], times_s=[0.0]))
    assert (mesh.frame_count, mesh.vertex_count) == (1, 1)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_scale_and_distance(tmp_path: Path, suffix: str) -> None:
    vertices, faces = body(distance_m=0.1)
    path = tmp_path / f"m{suffix}"
    save_mesh(MeshSequence(vertices * 1000, faces, Timebase(times(6))), path)
    with pytest.raises(Sd2Error, match=r"measures 1,\d{3} m.*probably millimetres.*--scale 0\.001"):
        load_mesh(path)
    mesh = load_mesh(path, scale=0.001, distance_m=3.0)
    np.testing.assert_allclose(mesh.read(0, 6), vertices + np.array([0, 0, 3.0]), atol=1e-5)
    assert mesh.vertices.dtype == mesh.read(0, 1).dtype == np.float32
    assert mesh.notes == ()


def test_units_are_guessed_from_the_size(tmp_path: Path) -> None:
    vertices, faces = body()
    for factor, text in (
        (100, r"measures 1\d\d m.*probably centimetres.*--scale 0\.01"),
        (1e5, r"measures 1\d\d,\d{3} m.*--scale with the factor"),
    ):
        path = write(tmp_path / "m.npz", vertices=vertices * factor, faces=faces, fps=30)
        with pytest.raises(Sd2Error, match=text):
            load_mesh(path)
        assert not any("measures" in note for note in load_mesh(path, scale=1).notes)
    path = write(tmp_path / "m.npz", vertices=vertices / 1000, faces=faces, fps=30)
    one_note(load_mesh(path), "measures 1.7 mm.*--scale")


# -- what is wrong ---------------------------------------------------------------


@pytest.mark.parametrize(
    ("arrays", "text"),
    [
        ({"points": np.zeros((2, 3, 3))}, r"m\.npz holds points.*'vertices' \(or 'verts'\)"),
        ({"vertices": np.zeros((2, 3))[..., None]}, r"m\.npz: .* shape \(2, 3, 1\)"),
        ({"vertices": np.zeros((0, 3, 3))}, r"m\.npz: .* shape \(0, 3, 3\)"),
        ({"vertices": np.array([["a", "b", "c"]])}, r"m\.npz: .* of type <U1"),
        ({"vertices": np.array([None])}, r"m\.npz cannot be read as \.npz.*plain numbers"),
    ],
)
def test_arrays_that_are_no_mesh_are_named(
    tmp_path: Path, arrays: dict[str, Any], text: str
) -> None:
    with pytest.raises(Sd2Error, match=text):
        load_mesh(write(tmp_path / "m.npz", **arrays))


def test_damaged_and_unknown_files_are_named(tmp_path: Path) -> None:
    vertices, faces = body()
    good = write(tmp_path / "good.npz", vertices=vertices, faces=faces).read_bytes()
    for name, content, text in (
        ("cut.npz", good[:-200], r"cut\.npz cannot be read as \.npz"),
        ("empty.npz", b"", r"empty\.npz cannot be read"),
        ("text.npz", b"hello", r"text\.npz cannot be read"),
        ("m.zarr.zip", b"hello", r"m\.zarr\.zip cannot be read as a Zarr group"),
        ("m.txt", b"hello", r"m\.txt is not a mesh of a kind that is known.*\.npz, \.zarr"),
        ("m.pt", b"hello", r"m\.pt cannot be read.*torch\.save"),
        ("m.obj", b"", r"m\.obj"),
        ("m.glb", b"glTFnonsense", r"m\.glb cannot be read as a mesh"),
    ):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(Sd2Error, match=text):
            load_mesh(tmp_path / name)
    with pytest.raises(Sd2Error, match=r"gone\.npz does not exist"):
        load_mesh(tmp_path / "gone.npz")
    (tmp_path / "folder.zarr").mkdir()
    with pytest.raises(Sd2Error, match=r"folder\.zarr cannot be read as a Zarr group"):
        load_mesh(tmp_path / "folder.zarr")
    (tmp_path / "nothing").mkdir()
    with pytest.raises(Sd2Error, match="nothing matches no mesh file"):
        load_mesh(tmp_path / "nothing")


def test_a_damaged_byte_inside_an_npz_is_noticed(tmp_path: Path) -> None:
    vertices, faces = body()
    path = tmp_path / "m.npz"
    save_mesh(MeshSequence(vertices, faces, Timebase(times(6))), path)
    content = bytearray(path.read_bytes())
    with zipfile.ZipFile(path) as archive:
        place = archive.getinfo("vertices.npy").header_offset + 300
    content[place] ^= 0xFF
    path.write_bytes(content)
    with pytest.raises(Sd2Error, match=r"m\.npz cannot be read as \.npz"):
        load_mesh(path)


def test_frames_without_a_body_are_frames_without_a_person(tmp_path: Path) -> None:
    vertices, faces = body()
    vertices[[2, 3]] = np.nan
    path = write(tmp_path / "m.npz", vertices=vertices, faces=faces, times_s=times(6))
    mesh = load_mesh(path)
    one_note(mesh, "2 frames hold no body.*first is frame 2")
    np.testing.assert_allclose(mesh.times_s, times(6))
    assert mesh.present is not None
    assert mesh.present.tolist() == [True, True, False, False, True, True]
    np.testing.assert_array_equal(mesh.read(0, 6), vertices[[0, 1, 1, 1, 4, 5]])


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_single_bad_vertices_are_named(tmp_path: Path, value: float) -> None:
    vertices, faces = body()
    vertices[3, [5, 9], 1] = value
    vertices[4, 2] = value
    path = write(tmp_path / "m.npz", vertices=vertices, faces=faces, times_s=times(6))
    with pytest.raises(
        Sd2Error, match=r"m\.npz: vertex 5 of frame 3 .*\(2 vertices of that frame .* 2 frames"
    ):
        load_mesh(path)
    path = write(tmp_path / "m.npz", vertices=vertices * np.nan, faces=faces, times_s=times(6))
    with pytest.raises(Sd2Error, match="no frame holds a finite vertex"):
        load_mesh(path)


def test_bad_vertices_on_disk_are_named_when_they_are_read(tmp_path: Path) -> None:
    vertices, faces = body(40)
    path = tmp_path / "m.zarr"
    save_mesh(MeshSequence(vertices, faces, Timebase(times(40))), path)
    zarr.open_group(str(path), mode="r+")["vertices"][15, 3, 1] = np.nan
    mesh = load_mesh(path)
    np.testing.assert_array_equal(mesh.read(0, 15), vertices[:15])
    with pytest.raises(Sd2Error, match=r"m\.zarr: vertex 3 of frame 15 is at \(.*nan"):
        mesh.read(10, 20)


def test_large_finite_numbers_are_not_mistaken_for_bad_ones(tmp_path: Path) -> None:
    vertices = np.full((2, 300, 3), 3e38, np.float32)
    save_mesh(MeshSequence(vertices, None, Timebase(times(2))), tmp_path / "m.zarr")
    np.testing.assert_array_equal(load_mesh(tmp_path / "m.zarr").read(0, 2), vertices)


def test_faces_that_look_inwards_are_turned_over(tmp_path: Path) -> None:
    vertices, faces = body()
    path = write(tmp_path / "m.npz", vertices=vertices, faces=faces[:, [0, 2, 1]], times_s=times(6))
    mesh = load_mesh(path)
    one_note(mesh, "looked inwards.*turned over")
    assert mesh.faces is not None
    assert trimesh.Trimesh(mesh.frame(0), mesh.faces, process=False).volume > 0


def test_faces_of_mixed_winding_are_noted(tmp_path: Path) -> None:
    vertices, faces = body()
    faces[::4] = faces[::4, ::-1]
    path = write(tmp_path / "m.npz", vertices=vertices, faces=faces, times_s=times(6))
    mesh = load_mesh(path)
    one_note(mesh, "not wound alike")
    np.testing.assert_array_equal(mesh.faces, faces)


def test_an_open_surface_is_left_as_it_is(tmp_path: Path) -> None:
    vertices, faces = body()
    half = faces[: len(faces) // 2, ::-1]
    path = write(tmp_path / "m.npz", vertices=vertices, faces=half, times_s=times(6))
    mesh = load_mesh(path)
    assert mesh.notes == ()
    np.testing.assert_array_equal(mesh.faces, half)


def test_faces_without_area_are_counted(tmp_path: Path) -> None:
    vertices, faces = body()
    more = np.concatenate([faces, [[0, 0, 1], [5, 5, 5]]])
    path = write(tmp_path / "m.npz", vertices=vertices, faces=more, times_s=times(6))
    mesh = load_mesh(path)
    one_note(mesh, "2 of 82 faces have no area")
    np.testing.assert_array_equal(mesh.faces, more)


@pytest.mark.parametrize(
    ("faces", "text"),
    [
        ([[0, 1, 42]], r"face names vertex 42, the mesh has 42 vertices.*0 to 41.*--faces"),
        ([[0, -1, 2]], "face names vertex -1"),
        ([[0, 1, 2, 3]], r"faces have shape \(1, 4\)"),
        ([[0.5, 1, 2]], "not whole"),
    ],
)
def test_faces_that_do_not_belong_are_refused(tmp_path: Path, faces: Any, text: str) -> None:
    path = write(tmp_path / "m.npz", vertices=body()[0], faces=faces, times_s=times(6))
    with pytest.raises(Sd2Error, match=r"m\.npz: .*" + text):
        load_mesh(path)


def test_faces_numbered_from_one_are_understood(tmp_path: Path) -> None:
    vertices, faces = body()
    path = write(tmp_path / "m.npz", vertices=vertices, faces=faces + 1, times_s=times(6))
    mesh = load_mesh(path)
    one_note(mesh, "from 1")
    np.testing.assert_array_equal(mesh.faces, faces)


def test_a_mesh_behind_the_camera_is_noted(tmp_path: Path) -> None:
    vertices, faces = body(distance_m=-2)
    path = write(tmp_path / "m.npz", vertices=vertices, faces=faces, times_s=times(6))
    one_note(load_mesh(path), r"mean depth of -2\.\d\d m.*y down, z forward")


# -- faces given apart -----------------------------------------------------------


def test_a_mesh_without_faces_is_a_point_cloud(tmp_path: Path) -> None:
    mesh = load_mesh(write(tmp_path / "m.npz", vertices=body()[0], times_s=times(6)))
    assert mesh.faces is None
    one_note(mesh, "no faces: it is a point cloud.*visibility 'none' only.*--faces")


def test_smpl_vertices_without_faces_are_explained(tmp_path: Path) -> None:
    pose = np.random.default_rng(0).normal((0, 0, 3), 0.3, (6890, 3))
    vertices = np.stack([pose, pose])
    mesh = load_mesh(write(tmp_path / "m.npz", vertices=vertices, times_s=times(2)))
    one_note(mesh, "6,890 vertices are SMPL's.*licensed")


@pytest.mark.parametrize("name", ["f.npy", "f.npz", "named.npz", "f.obj", "f.ply"])
def test_faces_can_be_given_apart(tmp_path: Path, name: str) -> None:
    vertices, faces = body()
    path = tmp_path / name
    if name == "f.npy":
        np.save(path, faces)
    elif name == "f.npz":
        np.savez(path, f=faces, v_template=vertices[0])
    elif name == "named.npz":
        np.savez(path, faces)
    else:
        trimesh.Trimesh(vertices[0], faces, process=False).export(path)
    cloud = write(tmp_path / "m.npz", vertices=vertices, times_s=times(6))
    mesh = load_mesh(cloud, faces=path)
    np.testing.assert_array_equal(mesh.faces, faces)
    assert mesh.notes == ()


def test_unusable_faces_files_are_named(tmp_path: Path) -> None:
    cloud = write(tmp_path / "m.npz", vertices=body()[0], times_s=times(6))
    (tmp_path / "bad.npy").write_bytes(b"hello")
    write(tmp_path / "other.npz", a=np.zeros(3), b=np.zeros(3))
    (tmp_path / "points.obj").write_text("v 0 0 1\nv 1 0 1\n")
    for name, text in (
        ("gone.npy", r"gone\.npy does not exist"),
        ("bad.npy", r"bad\.npy \(5 bytes\) cannot be read"),
        ("other.npz", r"other\.npz holds a, b.*'faces'"),
        ("points.obj", r"points\.obj holds no faces"),
        ("m.txt", "does not exist"),
    ):
        with pytest.raises(Sd2Error, match=text):
            load_mesh(cloud, faces=tmp_path / name)


# -- real data -------------------------------------------------------------------


def test_the_fitted_walk_is_read_without_a_remark(shared_data: Path) -> None:
    mesh = load_mesh(shared_data / "mesh" / "walk.npz")
    assert (mesh.frame_count, mesh.vertex_count) == (89, 13718)
    assert mesh.faces is not None
    assert len(mesh.faces) == 27420
    assert mesh.notes == ()
    assert mesh.timebase.frames_per_s == pytest.approx(30)
