"""A recording one of whose bodies is away shows the others, and says who is missing."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sd2app.session.content import load_content
from sd2core.io.mesh import save_mesh
from sd2core.mesh.bodies import Body
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import silent
from sd2core.recording.recording import Recording, open_recording
from sd2core.timebase import Timebase


def test_the_others_are_shown(tmp_path: Path) -> None:
    corners = np.array([[0, 0, 2], [0.3, 0, 2], [0, 0.3, 2], [0, 0, 2.3]])
    path = corners + 0.1 * np.arange(6)[:, None, None]
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    mesh = MeshSequence(path, faces, Timebase.regular(6, 30.0))
    for name in ("walk", "anna", "bert"):
        save_mesh(mesh, tmp_path / f"{name}.npz")
    bodies = tuple(Body(str(tmp_path / f"{name}.npz"), person=name) for name in ("anna", "bert"))
    made = Recording.create(tmp_path / "trio", mesh=tmp_path / "walk.npz", bodies=bodies)
    (tmp_path / "anna.npz").unlink()
    content = load_content(open_recording(made.folder), silent)
    assert content.mesh is not None
    assert content.mesh.persons == ("person 1", "bert")
    assert ["mesh of body 2" in str(problem) for problem in content.problems] == [True]
    assert len(content.recording.bodies) == 2  # and none is lost when it is saved
