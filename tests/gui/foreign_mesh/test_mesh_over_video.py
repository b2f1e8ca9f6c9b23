"""A mesh of another program seen over the video before it is taken, by real mouse and keys."""

from __future__ import annotations

import json
import pickle
import threading
from pathlib import Path

import numpy as np
import pytest
from answering import once_asked, press_when_ready
from dropping import drop
from finding import button_of, words_in
from grey_video import FRAMES, RATE, write_video
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QFileDialog,
    QLabel,
    QMenu,
    QSlider,
    QToolButton,
    QWidget,
)
from window_models import models_of

from sd2app.commands.feature import CommandWindow
from sd2app.foreign_mesh.feature import MeshDialog
from sd2app.foreign_mesh.model import MeshPreview, is_foreign
from sd2app.palette import palette_for
from sd2app.widgets.inputs import NumberBox
from sd2core.files.recording_json import CameraEntry, MeshReading
from sd2core.recording.recording import Recording
from tests.core.io.body_models import model_arrays, write_model

LEFT = Qt.MouseButton.LeftButton
SHORT = 20
"""Frames of the second person."""


def ball(x_m: float, frames: int) -> np.ndarray:
    """Points on a ball of 0.3 m, 2 m before the camera and to its side; y up, z backward."""
    directions = np.random.default_rng(0).normal(size=(400, 3))
    points = 0.3 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    swing = 0.05 * np.sin(2 * np.pi * np.arange(frames) / RATE)
    still = (points + np.array([x_m, 0, 2.0]))[None] + swing[:, None, None] * [0, 0, 1]
    return (still * [1, -1, -1]).astype(np.float32)


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    """A video, and what an estimator made of it: two people, y up, in all frames and in some."""
    write_video(tmp_path / "walk.mp4")
    people = {
        3: {"verts": ball(0.0, FRAMES), "frame_ids": np.arange(FRAMES)},
        8: {"verts": ball(0.4, SHORT), "frame_ids": np.arange(SHORT)},
    }
    (tmp_path / "wham.pkl").write_bytes(pickle.dumps(people))
    return tmp_path / "walk.mp4", tmp_path / "wham.pkl"


@pytest.fixture
def dialog(qtbot, qapp, compiled_kernels, files):
    parent = QWidget()
    qtbot.addWidget(parent)
    video, mesh = files
    preview = MeshPreview(Recording(Path(), video=video, mesh=mesh), parent)
    dialog = MeshDialog(preview, palette_for(dark=False), parent)
    dialog.show()
    qtbot.waitExposed(dialog)
    settle(qtbot, preview)
    yield dialog
    dialog.close()
    preview.close()


def settle(qtbot, preview: MeshPreview) -> None:
    ready = lambda: not preview.busy and preview.picture is not None  # noqa: E731
    qtbot.waitUntil(ready, timeout=20_000)


def named(dialog: QWidget, kind: type, name: str):
    return next(one for one in dialog.findChildren(kind) if one.accessibleName() == name)


def choose(qtbot, dialog: MeshDialog, name: str, down: int) -> None:
    """Go down in a list by keys."""
    box = named(dialog, QComboBox, name)
    box.setFocus()
    for _ in range(down):
        QTest.keyClick(box, Qt.Key.Key_Down)
    settle(qtbot, dialog.preview)


def tick(qtbot, dialog: MeshDialog, box: NumberBox) -> None:
    (known,) = (
        one for one in dialog.findChildren(QCheckBox) if abs(one.y() - box.y()) < one.height()
    )
    qtbot.mouseClick(known, LEFT, pos=QPoint(8, known.height() // 2))
    settle(qtbot, dialog.preview)


def width_px(dialog: MeshDialog) -> int:
    """Width of what is drawn over the grey picture."""
    image = dialog.picture.grab().toImage().convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
    pixels = rows[:, : 3 * image.width()].reshape(image.height(), image.width(), 3).astype(int)
    columns = np.flatnonzero((np.ptp(pixels, axis=2) > 40).any(axis=0))
    return 0 if columns.size == 0 else int(np.ptp(columns))


def test_people_are_listed_and_chosen_and_frames_stepped_through(qtbot, dialog) -> None:
    preview, people = dialog.preview, named(dialog, QComboBox, "Person")
    assert [people.itemText(place) for place in range(people.count())] == [
        "the one seen longest", "3: 60 frames", "8: 20 frames",
    ]  # fmt: skip
    choose(qtbot, dialog, "Person", 2)
    assert preview.read_as.person == "8"
    # It has nobody in the middle of the video: it is seen in the middle of where it has somebody.
    assert (preview.frame, preview.someone) == (SHORT // 2, True)
    slider = dialog.findChild(QSlider)
    slider.setFocus()
    for _ in range(SHORT // 2):
        QTest.keyClick(slider, Qt.Key.Key_Right)
    settle(qtbot, preview)
    assert (preview.frame, preview.someone) == (SHORT, False)
    assert "The mesh has nobody in this frame." in words_in(dialog, "warning") or preview.offers
    # Where the user looks it stays.
    choose(qtbot, dialog, "How the mesh is turned", 1)
    assert preview.frame == SHORT


def test_return_takes_the_mesh_and_cancels_nothing_while_it_is_read(
    qtbot, qapp, files, monkeypatch
) -> None:
    read, may_read = Recording.load_mesh, threading.Event()
    monkeypatch.setattr(Recording, "load_mesh", lambda *given: may_read.wait() and read(*given))
    video, mesh = files
    parent = QWidget()
    qtbot.addWidget(parent)
    preview = MeshPreview(Recording(Path(), video=video, mesh=mesh), parent)
    dialog = MeshDialog(preview, palette_for(dark=False), parent)
    dialog.open()
    qtbot.waitUntil(dialog.isActiveWindow)
    QTest.keyClick(dialog.focusWidget(), Qt.Key.Key_Return)
    assert dialog.isVisible()
    may_read.set()
    settle(qtbot, preview)
    QTest.keyClick(dialog.focusWidget(), Qt.Key.Key_Return)
    assert dialog.result() == MeshDialog.DialogCode.Accepted
    preview.close()


def test_what_a_button_puts_right_is_told_once_and_by_no_option(qtbot, dialog) -> None:
    said = "\n".join(label.text() for label in dialog.findChildren(QLabel) if label.isVisible())
    assert said.count("at or behind the camera") == 1
    assert "--turn" not in said


def test_what_is_turned_and_its_focal_length_are_seen_at_once(qtbot, dialog) -> None:
    preview = dialog.preview
    assert width_px(dialog) == 0  # behind the camera
    cure = next(one for one in dialog.findChildren(QToolButton) if "front" in one.text())
    qtbot.mouseClick(cure, LEFT)
    settle(qtbot, preview)
    assert preview.read_as.turn == "x180"
    assert not cure.isVisible()
    width, focal_px = width_px(dialog), preview.camera.focal_px
    box = next(one for one in dialog.findChildren(NumberBox) if one.suffix() == " px")
    tick(qtbot, dialog, box)
    assert preview.read_as.focal_px == round(focal_px)
    box.setFocus()
    box.selectAll()
    QTest.keyClicks(box, "260")
    QTest.keyClick(box, Qt.Key.Key_Return)
    settle(qtbot, preview)
    assert preview.camera.focal_px == 260.0
    assert width_px(dialog) / width == pytest.approx(260 / focal_px, rel=0.1)


def test_what_cannot_be_read_so_cannot_be_taken(qtbot, dialog) -> None:
    preview, take = dialog.preview, button_of(dialog, "Take")
    assert take.isEnabled()
    preview.set_faces(preview.recording.video)
    settle(qtbot, preview)
    assert not take.isEnabled()
    assert any("walk.mp4" in one for one in words_in(dialog, "warning"))


def test_parameters_become_a_body_by_the_model_that_is_chosen(
    qtbot, compiled_kernels, files, monkeypatch, tmp_path
) -> None:
    poses, places = np.zeros((FRAMES, 72)), np.tile([0.0, 0.0, 4.0], (FRAMES, 1))
    np.savez(tmp_path / "posed.npz", poses=poses, trans=places)
    parent = QWidget()
    qtbot.addWidget(parent)
    video, mesh = files[0], tmp_path / "posed.npz"
    preview = MeshPreview(Recording(Path(), video=video, mesh=mesh), parent)
    dialog = MeshDialog(preview, palette_for(dark=False), parent)
    dialog.show()
    settle(qtbot, preview)
    assert preview.taken is None
    assert any("body" in one for one in words_in(dialog, "warning"))
    model = write_model(tmp_path / "model.npz")
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (str(model), ""))
    button = next(one for one in dialog.findChildren(QToolButton) if "SMPL" in one.toolTip())
    qtbot.mouseClick(button, LEFT)
    settle(qtbot, preview)
    assert preview.taken.fields["mesh_reading"].body_model == str(model)
    rest_m = model_arrays()["v_template"]
    np.testing.assert_allclose(preview.taken.mesh.frame(0), rest_m + places[0], atol=1e-5)
    dialog.close()
    preview.close()


def test_taken_in_the_window_it_is_made_smooth_and_undone(labelled, qtbot, files, monkeypatch):
    window, c = labelled, models_of(labelled)
    _, mesh = files
    before = c.document.mesh
    monkeypatch.setattr("sd2app.shell.files.ask_to_open", lambda *_, **__: [mesh])

    press_when_ready(MeshDialog, "Cancel")
    window.action("add").trigger()
    assert c.document.mesh is before

    def take(dialog: MeshDialog) -> None:
        settle(qtbot, dialog.preview)
        choose(qtbot, dialog, "How the mesh is turned", 1)
        qtbot.mouseClick(button_of(dialog, "Take"), LEFT)

    once_asked(MeshDialog, take)
    window.action("add").trigger()
    assert c.document.recording.mesh == mesh
    assert c.document.recording.mesh_reading.turn == "x180"
    assert c.document.undo_stack.undoText() == "Take mesh"
    taken = c.document.mesh
    # The form of `sd2 refine` is filled in; it is started by a click and followed.
    window.action("refine_mesh").trigger()
    commands = window.features.commands
    record = commands.forms.record
    assert (record.mesh, record.turn, record.video) == (mesh, "x180", c.document.recording.video)
    runs = window.findChild(CommandWindow)
    qtbot.mouseClick(button_of(runs, "Start"), LEFT)
    qtbot.waitUntil(lambda: c.document.mesh not in (taken, before), timeout=120_000)
    assert c.document.undo_stack.undoText() == "Make mesh smooth"
    assert c.document.recording.mesh == record.out
    assert c.document.mesh.uncertainty is not None
    assert not window.action("refine_mesh").isEnabled()
    again = button_of(runs, "Take the mesh")
    assert not again.isVisible()
    c.document.undo_stack.undo()
    assert again.isVisible()
    qtbot.mouseClick(again, LEFT)
    qtbot.waitUntil(lambda: c.document.recording.mesh == record.out, timeout=20_000)
    runs.close()
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow)
    qtbot.keyClick(window, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert c.document.mesh is taken
    qtbot.keyClick(window, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    qtbot.waitUntil(lambda: c.document.recording.mesh != mesh, timeout=20_000)
    qtbot.waitUntil(lambda: c.document.mesh.vertex_count == before.vertex_count, timeout=20_000)
    assert not c.document.modified


@pytest.mark.slow
def test_files_that_were_open_lately_are_read_as_then_and_nobody_is_asked(
    empty_window, qtbot, files
):
    window, c = empty_window, models_of(empty_window)

    def take(dialog: MeshDialog) -> None:
        settle(qtbot, dialog.preview)
        choose(qtbot, dialog, "How the mesh is turned", 1)
        qtbot.mouseClick(button_of(dialog, "Take"), LEFT)

    once_asked(MeshDialog, take)
    with qtbot.waitSignal(c.document.opened, timeout=30_000):
        drop(window, *files)
    assert c.document.recording.mesh_reading.turn == "x180"
    # Another cure, chosen in the window, is remembered as well.
    c.edits.read_mesh("Read smaller", {"mesh_reading": MeshReading(turn="x180", scale=0.9)})
    qtbot.waitUntil(lambda: c.document.recording.mesh_reading.scale == 0.9, timeout=20_000)
    c.document.undo_stack.setClean()
    menus = {one.title().replace("&", ""): one for one in window.findChildren(QMenu)}
    recent = menus["Open recent"]
    recent.aboutToShow.emit()
    with qtbot.waitSignal(c.document.opened, timeout=30_000):
        recent.actions()[0].trigger()  # a dialog would wait for ever
    reading = c.document.recording.mesh_reading
    assert (reading.turn, reading.scale) == ("x180", 0.9)
    qtbot.waitUntil(lambda: window.settled, timeout=30_000)


@pytest.mark.slow
def test_the_camera_of_the_video_is_still_known_with_another_mesh(
    labelled, qtbot, tmp_path, monkeypatch
):
    window, c = labelled, models_of(labelled)
    known = CameraEntry(focal_px=900.0, source="user")
    c.document.recording.camera = known
    theirs = tmp_path / "theirs.npz"
    np.savez(theirs, vertices=ball(0.0, FRAMES) * [1, -1, -1])
    monkeypatch.setattr("sd2app.shell.files.ask_to_open", lambda *_, **__: [theirs])

    def take(dialog: MeshDialog) -> None:
        settle(qtbot, dialog.preview)
        assert dialog.preview.camera.focal_px == 900.0
        QTest.keyClick(dialog.focusWidget(), Qt.Key.Key_Return)  # does not cancel

    once_asked(MeshDialog, take)
    window.action("add").trigger()
    assert c.document.recording.mesh == tmp_path / "theirs.npz"
    assert c.document.recording.camera == known


def test_what_our_own_fit_made_is_not_foreign(tmp_path) -> None:
    fit = json.dumps({"camera": {"focal_px": 600.0, "width": 640, "height": 480}})
    np.savez(tmp_path / "ours.npz", vertices=ball(0.0, 2), fit=fit)
    np.savez(tmp_path / "theirs.npz", vertices=ball(0.0, 2))
    assert not is_foreign(tmp_path / "ours.npz")
    assert is_foreign(tmp_path / "theirs.npz")
