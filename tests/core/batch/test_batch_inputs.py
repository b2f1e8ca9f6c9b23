"""What a batch works on: found, looked at once, and streamed where it is large."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from moving_spheres import save_spheres, swinging_sphere

from sd2core.batch import inputs
from sd2core.batch.folder import BatchFolder
from sd2core.batch.inputs import find_origins, inspect, known_inspection
from sd2core.batch.plan import Recordings
from sd2core.batch.pool import _check_worker
from sd2core.batch.run import remove_old_leftovers
from sd2core.errors import Sd2Error
from sd2core.files import digests as contents
from sd2core.files.keys import all_code_digest
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.io.unpacking import npz_vertices, unpack_npz
from sd2core.recording.recording import Recording


def _origins(folder: Path, **told: object) -> dict[str, str]:
    files = (str(folder / "**" / "*.npz"), str(folder / "*" / "*.sd2"))
    recordings = Recordings(files=files, **told)  # type: ignore[arg-type]
    return {one.name: one.subject for one in find_origins(recordings, folder / "out")}


def test_what_lies_in_a_recording_belongs_to_it(tmp_path: Path) -> None:
    for person in ("anna", "ben"):
        save_spheres(tmp_path / person, 2, frames=4)
    Recording.create(tmp_path / "anna" / "take", mesh=tmp_path / "anna" / "m0.npz", copy=True)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "made.npz").touch()
    assert (tmp_path / "anna" / "take.sd2" / "m0.npz").exists()
    names = ["anna/m0.npz", "anna/m1.npz", "anna/take.sd2", "ben/m0.npz", "ben/m1.npz"]
    assert list(_origins(tmp_path)) == names
    assert [*_origins(tmp_path).values()][2:4] == ["anna/take", "ben/m0"]
    by_folder = _origins(tmp_path, subjects="folder")
    assert [*by_folder.values()] == ["anna"] * 3 + ["ben"] * 2
    named = _origins(tmp_path, subject_of={"ben/m1.npz": "eve", "m1.npz": "dora"})
    assert [named["anna/m1.npz"], named["ben/m1.npz"]] == ["dora", "eve"]


def test_recordings_are_of_whom_they_name(tmp_path: Path) -> None:
    """Else a person of several would be in the training and in the test."""
    (mesh,) = save_spheres(tmp_path / "meshes", 1, frames=4)
    for name, subject in (("a1", "anna"), ("a2", "anna"), ("b", "")):
        one = Recording.create(tmp_path / f"{name}.sd2", mesh=mesh)
        one.subject = subject
        one.save()
    damaged = tmp_path / "c.sd2"
    damaged.mkdir()
    (damaged / "recording.json").write_text("{")
    found = find_origins(Recordings(files=(str(tmp_path / "*.sd2"),)), tmp_path / "out")
    assert [one.subject for one in found] == ["anna", "anna", "b", "c"]


def test_files_inside_of_a_recording_alone_are_refused(tmp_path: Path) -> None:
    (mesh,) = save_spheres(tmp_path / "meshes", 1, frames=4)
    Recording.create(tmp_path / "anna.sd2", mesh=mesh, copy=True)
    inside = Recordings(files=(str(tmp_path / "*.sd2" / "*.npz"),))
    with pytest.raises(Sd2Error, match=r"\*\.npz: all that matches lies inside of recordings"):
        find_origins(inside, tmp_path / "out")


def test_contents_are_hashed_again_only_where_a_file_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (mesh,) = save_spheres(tmp_path / "meshes", 1, frames=4)
    taken: list[Path] = []

    def counted(path: Path) -> str:
        taken.append(path)
        return taken_digest(path)

    taken_digest = contents.file_digest
    monkeypatch.setattr(contents, "file_digest", counted)
    folder = BatchFolder(tmp_path / "made")
    (origin,) = find_origins(Recordings(files=(str(mesh),)), folder.path)
    assert known_inspection(folder, origin) is None
    first = inspect(folder, origin)
    assert known_inspection(folder, origin) == first
    assert taken == [mesh]
    os.utime(mesh, ns=(0, 0))
    assert known_inspection(folder, origin) is None
    assert inspect(folder, origin) == first
    assert taken == [mesh, mesh]


def test_a_large_npz_is_unpacked_and_is_the_same_mesh(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (mesh,) = save_spheres(tmp_path / "meshes", 1, frames=400)
    folder = BatchFolder(tmp_path / "made")
    (origin,) = find_origins(Recordings(files=(str(mesh),)), folder.path)
    small = inspect(folder, origin).mesh
    monkeypatch.setattr(inputs, "LARGEST_IN_MEMORY_BYTES", 100_000)
    shell = inputs.glance(origin).mesh
    assert shell is not None
    assert (shell.frames, shell.vertices) == (400, 288)
    found = inspect(folder, origin).mesh
    assert found is not None
    assert small is not None
    assert found.identity == small.identity
    assert found.target_m == small.target_m
    assert Path(found.path).suffix == ".zarr"
    there, expected = load_mesh(found.path), load_mesh(mesh)
    np.testing.assert_array_equal(there.read(0, 400), expected.read(0, 400))
    np.testing.assert_array_equal(there.times_s, expected.times_s)
    assert there.faces is not None
    np.testing.assert_array_equal(there.faces, expected.faces)


def test_an_npz_that_is_cut_short_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "mesh.npz"
    save_mesh(swinging_sphere(30), path)
    assert npz_vertices(path) == (30, 288)
    path.write_bytes(path.read_bytes()[:5000])
    for read in (npz_vertices, lambda path: unpack_npz(path, tmp_path / "out.zarr")):
        with pytest.raises(Sd2Error, match=r"mesh\.npz"):
            read(path)
    assert not (tmp_path / "out.zarr").exists()


def test_large_meshes_of_other_kinds_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(inputs, "LARGEST_IN_MEMORY_BYTES", 10)
    (tmp_path / "mesh.obj").write_text("v 0 0 1\nv 1 0 1\nv 0 1 1\nf 1 2 3\n")
    with pytest.raises(Sd2Error, match="in memory as a whole"):
        inputs.open_mesh(tmp_path / "mesh.obj", None, {})


def test_what_killed_writes_left_is_removed_when_it_is_old(tmp_path: Path) -> None:
    shelf = tmp_path / "synthetic" / "ab"
    (shelf / ".mesh.zarr.x.tmp").mkdir(parents=True)
    kept = [shelf / "ab12.npz", shelf / ".sd2-new.tmp", tmp_path / ".sd2-mine.tmp"]
    for path in (*kept, shelf / ".sd2-old.tmp"):
        path.touch()
    for old in (shelf / ".sd2-old.tmp", shelf / ".mesh.zarr.x.tmp", shelf / "ab12.npz"):
        os.utime(old, (0, 0))
    remove_old_leftovers(tmp_path)
    assert sorted(one for one in tmp_path.rglob("*") if one.is_file()) == sorted(kept)
    assert not (shelf / ".mesh.zarr.x.tmp").exists()


def test_workers_need_the_same_program_and_the_same_files(tmp_path: Path) -> None:
    good = {"code": all_code_digest(), "sees": True, "host": "one"}
    _check_worker("tcp://one:1", good, tmp_path)
    for about, words in (
        (good | {"code": "other"}, "another version"),
        (good | {"sees": False}, "does not see"),
        (ModuleNotFoundError("No module named 'sd2core'"), "cannot use"),
    ):
        with pytest.raises(Sd2Error, match=words):
            _check_worker("tcp://one:1", about, tmp_path)
