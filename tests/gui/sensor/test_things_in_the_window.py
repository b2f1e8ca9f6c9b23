"""Things in the real window: added and typed by keys, dragged by the mouse, undone, kept."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QFileDialog, QToolButton
from window_models import models_of

from sd2app.scene.navigation import Target
from sd2app.scene.view import SceneView
from sd2app.sensor.scene_pages import ThingsPage
from sd2app.widgets.inputs import Choice, NumberBox
from sd2core.doppler import Synthesizer
from sd2core.mesh.things import Thing
from sd2core.recording.recording import open_recording

LEFT = Qt.MouseButton.LeftButton


def page_of(window) -> ThingsPage:
    window.bring_up("Sensor", "Things")
    return window.findChild(ThingsPage)


def add(window, shape: str) -> None:
    shelf = page_of(window).findChild(Choice)
    shelf.setFocus()
    wanted = shelf.findText(shape)
    step = Qt.Key.Key_Down if wanted > shelf.currentIndex() else Qt.Key.Key_Up
    for _ in range(abs(wanted - shelf.currentIndex())):
        QTest.keyClick(shelf, step)
    press(window, "Add")


def press(window, text: str) -> None:
    buttons = page_of(window).findChildren(QToolButton)
    QTest.mouseClick(next(one for one in buttons if one.text() == text), LEFT)


def box_of(window, tip: str) -> NumberBox:
    boxes = page_of(window).findChildren(NumberBox)
    return next(box for box in boxes if tip in box.accessibleName())


def type_into(window, tip: str, text: str) -> None:
    box = box_of(window, tip)
    box.setFocus()
    box.selectAll()
    QTest.keyClicks(box, text)
    QTest.keyClick(box, Qt.Key.Key_Return)


def things(window) -> tuple[Thing, ...]:
    return models_of(window).document.recording.things


def shown(window, qtbot) -> np.ndarray:
    """Values of the map once it is final."""
    models = models_of(window)
    qtbot.waitUntil(lambda: models.synthesis.complete, timeout=20_000)
    return models.session.maps.synthetic.map.values.copy()


def test_a_wall_is_added_typed_and_undone_and_the_map_follows(window, qtbot):
    document = models_of(window).document
    free, mesh = shown(window, qtbot), document.mesh
    assert free.any()
    add(window, "screen")
    (screen,) = things(window)
    assert screen == Thing("screen", (0.0, 0.3, 1.0))  # midway, on the ball's floor
    assert document.undo_stack.undoText() == "Add screen"
    assert box_of(window, "height").value() == 1.8
    type_into(window, "width", "4")
    type_into(window, "height", "250cm")
    type_into(window, "y: down", "1.2")
    type_into(window, "Turn", "10")
    wide = Thing("screen", (0.0, 1.2, 1.0), 10.0, (4.0, 2.5, 0.03))
    assert things(window) == (wide,)
    assert document.mesh.surroundings.things == (wide,)
    assert not shown(window, qtbot).any()
    type_into(window, "x: to the right", "2")
    half = shown(window, qtbot)
    assert 0 < half.sum() < free.sum()
    made = Synthesizer(document.mesh, models_of(window).synthesis.made_by()[0]().options)
    np.testing.assert_array_equal(made.map(models_of(window).sensor.sensor).values, half)
    for _ in range(6):
        window.action("undo").trigger()
    assert things(window) == ()
    assert document.mesh.surroundings is None
    assert document.mesh.vertices is mesh.vertices
    np.testing.assert_array_equal(shown(window, qtbot), free)
    assert window.findChild(SceneView).scene.movables.things == ()
    window.action("redo").trigger()
    press(window, "Remove")
    assert things(window) == ()
    assert document.undo_stack.undoText() == "Remove screen"


def test_it_is_dragged_on_its_level_and_with_shift_upwards(window, qtbot):
    models = models_of(window)
    models.edits.add_to_scene(Thing("box", (0.6, 0.3, 1.2), 20.0, (0.3, 0.3, 0.3)))
    view = window.findChild(SceneView)
    scene, stack = view.scene, models.document.undo_stack
    qtbot.waitUntil(lambda: scene.pose.size_px == (view.width(), view.height()), timeout=5_000)
    middle = scene.movables.points_m.mean(axis=0)
    x, y, _ = scene.pose.project(middle)[0]
    start = QPoint(round(x), round(y))
    widget, count = view.childAt(start), stack.count()
    QTest.mouseMove(widget, start)
    assert view.navigator.target == Target("movable", 0)
    assert widget.cursor().shape() == Qt.CursorShape.OpenHandCursor
    pose, before = scene.pose, things(window)[0]
    level, moved = (
        scene.movables.under(pose, start.x(), start.y())[2],
        QPoint(40, 15),
    )
    QTest.mousePress(widget, LEFT, Qt.KeyboardModifier.NoModifier, start)
    for part in (0.5, 1.0):
        QTest.mouseMove(widget, start + moved * part)
    assert scene.pose == pose
    (after,) = things(window)  # while it is held
    qtbot.keyClick(window, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert things(window) == (after,)  # the history waits
    assert stack.count() == count
    shown = scene.movables.things
    QTest.mouseRelease(widget, LEFT, Qt.KeyboardModifier.NoModifier, start + moved)
    assert things(window) == (after,)
    by_m = np.subtract(after.position_m, before.position_m)
    np.testing.assert_allclose(scene.movables.points_m, shown[0].points + by_m, atol=1e-6)
    assert after.position_m[1] == before.position_m[1]
    by = np.subtract(after.position_m, before.position_m)
    assert np.linalg.norm(by) > 0.05
    # What was taken hold of is under the pointer still.
    np.testing.assert_allclose(
        pose.project(level + by)[0, :2], [start.x() + 40, start.y() + 15], atol=1.0
    )
    assert stack.count() == count + 1
    assert stack.undoText() == "Move box"
    here = start + moved
    QTest.mousePress(widget, LEFT, Qt.KeyboardModifier.ShiftModifier, here)
    for step in (10, 30):
        move(widget, here - QPoint(0, step), Qt.KeyboardModifier.ShiftModifier)
    QTest.mouseRelease(widget, LEFT, Qt.KeyboardModifier.ShiftModifier, here - QPoint(0, 30))
    (raised,) = things(window)
    assert raised.position_m[1] < after.position_m[1] - 0.02
    assert raised.position_m[::2] == pytest.approx(after.position_m[::2], abs=2e-3)
    window.action("undo").trigger()
    window.action("undo").trigger()
    assert things(window) == (before,)
    np.testing.assert_allclose(scene.movables.points_m.mean(axis=0), middle)


def pixel_of(pose, point_m) -> QPoint:
    return QPoint(*np.rint(pose.project(point_m)[0, :2]).astype(int).tolist())


def test_the_map_follows_a_thing_while_it_is_dragged_and_settles(window, qtbot, monkeypatch):
    models = models_of(window)
    free, synthesis = shown(window, qtbot), models.synthesis
    models.edits.add_to_scene(Thing("screen", (1.5, 0.5, 1.0), 0.0, (1.2, 1.2, 0.03)))
    np.testing.assert_array_equal(shown(window, qtbot), free)  # it stands aside
    view = window.findChild(SceneView)
    scene = view.scene
    qtbot.waitUntil(lambda: scene.pose.size_px == (view.width(), view.height()), timeout=5_000)
    view.grab()
    pose = scene.pose
    start = pixel_of(pose, scene.movables.points_m.mean(axis=0))
    held_m = scene.movables.under(pose, start.x(), start.y())[2]
    there = pixel_of(pose, held_m - [1.5, 0.0, 0.0])
    written = []
    monkeypatch.setattr(
        type(view.overlay), "_paint_beside", lambda _, painter, text, at: written.append(text)
    )
    widget = view.childAt(start)
    QTest.mousePress(widget, LEFT, Qt.KeyboardModifier.NoModifier, start)
    for part in (0.3, 0.7, 1.0):
        QTest.mouseMove(widget, start + (there - start) * part)
    (moved,) = things(window)
    assert abs(moved.position_m[0]) < 0.1
    assert synthesis.moving
    values = models.session.maps.synthetic
    qtbot.waitUntil(lambda: values.map.values.sum() < 0.5 * free.sum(), timeout=10_000)
    view.grab()
    assert written[-1] == "x {:+.2f}   y {:+.2f}   z {:+.2f} m".format(*moved.position_m)
    QTest.mouseRelease(widget, LEFT, Qt.KeyboardModifier.NoModifier, there)
    final = shown(window, qtbot)
    made = Synthesizer(models.document.mesh, synthesis.made_by()[0]().options)
    np.testing.assert_array_equal(made.map(models.sensor.sensor).values, final)
    window.action("undo").trigger()
    np.testing.assert_array_equal(shown(window, qtbot), free)


def move(widget, place: QPoint, keys: Qt.KeyboardModifier) -> None:
    """Move the pointer with a button and keys held, which QTest's move cannot."""
    from PySide6.QtCore import QEvent, QPointF
    from PySide6.QtGui import QGuiApplication, QMouseEvent

    at = QPointF(place)
    event = QMouseEvent(
        QEvent.Type.MouseMove, at, widget.mapToGlobal(at), Qt.MouseButton.NoButton, LEFT, keys
    )
    QGuiApplication.sendEvent(widget, event)


def test_a_mesh_file_stands_there_and_what_is_none_is_refused(window, monkeypatch, tmp_path):
    good, bad = tmp_path / "wedge.obj", tmp_path / "bad.obj"
    good.write_text("v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 0 3\nf 1 2 3\nf 1 2 4\n")
    bad.write_text("v 0 0 0\n")
    for path, count in ((bad, 0), (good, 1)):
        answer = (str(path), "")
        monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_, answer=answer, **__: answer)
        add(window, "mesh file…")
        assert len(things(window)) == count
    assert things(window)[0].name == "wedge.obj"
    type_into(window, "Turn", "30")
    assert [round(box_of(window, tip).value(), 3) for tip in ("width", "height", "depth")] == [
        2,
        1,
        3,
    ]


def test_it_is_kept_in_the_recording(labelled, qtbot):
    document = models_of(labelled).document
    add(labelled, "table")
    add(labelled, "doorway")
    labelled.action("save").trigger()
    qtbot.waitUntil(lambda: not document.modified, timeout=10_000)
    kept = open_recording(document.recording.folder).things
    assert kept == things(labelled)
    assert [one.shape for one in kept] == ["table", "doorway"]
