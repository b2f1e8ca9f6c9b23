"""The button with which an unlikely mesh is read another way."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import Qt

from sd2app.session.document import DocumentModel
from sd2app.session.sensor import SensorModel
from sd2app.session.tasks import TaskList
from sd2app.session.undo import Edits
from sd2app.shell.files import MeshOffer

POSE = np.random.default_rng(0).uniform((-0.3, -0.9, 2.5), (0.3, 0.9, 2.9), (60, 3))


def test_a_click_reads_the_mesh_so_and_the_offer_is_gone(qapp, qtbot, tmp_path):
    path = tmp_path / "m.npz"
    np.savez(path, vertices=np.stack([1000 * POSE] * 5), times_s=np.arange(5) / 30)
    document = DocumentModel(TaskList())
    notice = MeshOffer(document, Edits(document, SensorModel()))
    qtbot.addWidget(notice)
    with qtbot.waitSignal(document.failed, timeout=10_000):
        document.open([path])
    assert "probably millimetres" in notice.text
    assert "--" not in notice.text, "there is a button"
    assert notice.buttons["cure"].text() == "Read it as millimetres"
    with qtbot.waitSignal(document.opened, timeout=10_000):
        qtbot.mouseClick(notice.buttons["cure"], Qt.MouseButton.LeftButton)
    assert notice.text == ""
    np.testing.assert_allclose(document.mesh.frame(0), POSE)
    document.close()


def test_a_click_is_one_step_that_undo_takes_back(qapp, qtbot, tmp_path):
    path = tmp_path / "m.npz"
    np.savez(path, vertices=np.stack([POSE * [1, -1, -1]] * 5), times_s=np.arange(5) / 30)
    document = DocumentModel(TaskList())
    notice = MeshOffer(document, Edits(document, SensorModel()))
    qtbot.addWidget(notice)
    with qtbot.waitSignal(document.opened, timeout=10_000):
        document.open([path])
    offered = notice.text
    with qtbot.waitSignal(document.opened, timeout=10_000):
        qtbot.mouseClick(notice.buttons["cure"], Qt.MouseButton.LeftButton)
    assert document.recording.mesh_reading.turn == "x180"
    assert document.undo_stack.undoText() == "Turn it to the front"
    assert notice.text == ""
    document.undo_stack.undo()
    assert document.recording.mesh_reading.turn is None
    assert notice.text == offered
    document.close()
