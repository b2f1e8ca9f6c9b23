"""Bodies whose files are away are named and the others shown; those to be read are awaited."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest

from sd2app.session.content import load_content
from sd2app.session.document import DocumentModel
from sd2app.session.sensor import SensorModel
from sd2app.session.tasks import TaskList
from sd2app.session.undo import Edits
from sd2core.io import bodies as bodies_of_files
from sd2core.io.mesh import save_mesh
from sd2core.mesh.bodies import Body
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import silent
from sd2core.recording.recording import Recording, open_recording
from sd2core.timebase import Timebase


def trio(tmp_path: Path) -> Recording:
    corners = np.array([[0, 0, 2], [0.3, 0, 2], [0, 0.3, 2], [0, 0, 2.3]])
    path = corners + 0.1 * np.arange(6)[:, None, None]
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    mesh = MeshSequence(path, faces, Timebase.regular(6, 30.0))
    for name in ("walk", "anna", "bert"):
        save_mesh(mesh, tmp_path / f"{name}.npz")
    bodies = tuple(Body(str(tmp_path / f"{name}.npz"), person=name) for name in ("anna", "bert"))
    return Recording.create(tmp_path / "trio", mesh=tmp_path / "walk.npz", bodies=bodies)


def test_the_others_are_shown(tmp_path: Path) -> None:
    made = trio(tmp_path)
    (tmp_path / "anna.npz").unlink()
    content = load_content(open_recording(made.folder), silent)
    assert content.mesh is not None
    assert content.mesh.persons == ("person 1", "bert")
    assert ["mesh of body 2" in str(problem) for problem in content.problems] == [True]
    assert len(content.recording.bodies) == 2  # and none is lost when it is saved


def test_who_comes_back_is_read_in_the_background(
    qtbot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs = TaskList()
    document = DocumentModel(jobs)
    with qtbot.waitSignal(document.opened):
        document.open([trio(tmp_path).folder])
    edits = Edits(document, SensorModel())
    anna, bert = document.recording.bodies
    edits.remove_from_scene(0, anna)
    bodies_of_files._FILES.clear()  # other files were read since
    gate, readers, load, now = threading.Event(), [], bodies_of_files.load_mesh, threading.get_ident

    def wait(*args, **options):
        readers.append(now())
        assert gate.wait(10)
        return load(*args, **options)

    monkeypatch.setattr(bodies_of_files, "load_mesh", wait)
    document.undo_stack.undo()
    edits.change_in_scene(1, bert)  # nothing is read twice, whatever is edited meanwhile
    document.assign({"title": "Trio"})
    assert document.recording.bodies == (anna, bert)
    assert document.mesh.persons == ("person 1", "bert")
    assert [job.title for job in jobs.jobs] == ["Reading anna.npz"]
    gate.set()
    qtbot.waitUntil(lambda: document.mesh.persons == ("person 1", "anna", "bert"), timeout=10_000)
    assert len(readers) == 1
    assert now() not in readers
    document.close()
