"""The people of a mesh file are listed as they can be asked for."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

from sd2core.io.mesh import load_mesh
from sd2core.io.mesh_models import persons_in

BODY = np.random.default_rng(0).uniform((-0.3, -0.9, 2.5), (0.3, 0.9, 2.9), (300, 3))


def people(path: Path) -> Path:
    """One person of five frames, one of three, as trackers write them."""
    content = {
        name: {"verts": np.stack([BODY + shift_m] * frames), "frame_ids": np.arange(frames)}
        for name, frames, shift_m in ((2, 5, 0.0), (11, 3, 0.5))
    }
    path.write_bytes(pickle.dumps(content))
    return path


def surfaces(folder: Path) -> Path:
    """The same as a file for each person and frame."""
    folder.mkdir()
    for person, frames, shift_m in ((2, 5, 0.0), (11, 3, 0.5)):
        lines = "".join("v {} {} {}\n".format(*point) for point in BODY + shift_m)
        for frame in range(frames):
            (folder / f"{frame:06d}_{person}.obj").write_text(lines)
    return folder


@pytest.mark.parametrize("make", [people, surfaces])
def test_everyone_who_is_listed_can_be_read_with_that_many_frames(make, tmp_path: Path) -> None:
    path = make(tmp_path / "walk")
    if path.is_file():
        path = path.rename(tmp_path / "walk.pkl")
    listed = persons_in(path)
    assert listed == {"2": 5, "11": 3}
    for name, frames in listed.items():
        mesh = load_mesh(path, person=name)
        assert int(mesh.presence.present.sum()) == frames
        assert any(f"Person {name} is read" in note for note in mesh.notes)


def test_a_file_of_nobody_in_particular_lists_nobody(tmp_path: Path) -> None:
    np.savez(tmp_path / "one.npz", vertices=BODY[None])
    (tmp_path / "broken.pkl").write_bytes(b"not a pickle")
    for name in ("one.npz", "broken.pkl", "missing.pkl"):
        assert persons_in(tmp_path / name) == {}
