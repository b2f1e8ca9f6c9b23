"""Other people in the real window: added, typed, named, dragged by the mouse, undone, kept."""

from __future__ import annotations

import shutil
import threading

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QFileDialog, QLineEdit, QToolButton, QWidget
from window_models import models_of

from sd2app.maps.feature import LimbMenu
from sd2app.maps.partial_map import FINAL
from sd2app.scene.navigation import Target
from sd2app.scene.view import SceneView
from sd2app.sensor.scene_pages import BodiesPage
from sd2app.widgets.inputs import NumberBox
from sd2core.doppler import Synthesizer
from sd2core.io import bodies as bodies_of_files
from sd2core.mesh.bodies import Body
from sd2core.recording.recording import Recording, open_recording

LEFT = Qt.MouseButton.LeftButton


def page_of(window) -> BodiesPage:
    window.bring_up("Sensor", "Bodies")
    return window.findChild(BodiesPage)


def press(window, text: str) -> None:
    buttons = page_of(window).findChildren(QToolButton)
    QTest.mouseClick(next(one for one in buttons if one.text() == text), LEFT)


def add_copy(window, qtbot) -> None:
    count = len(bodies(window))
    press(window, "Add a copy")
    qtbot.waitUntil(lambda: len(bodies(window)) > count, timeout=10_000)


def type_into(window, tip: str, text: str) -> None:
    page = page_of(window)
    boxes = [*page.findChildren(NumberBox), *page.findChildren(QLineEdit)]
    box = next(box for box in boxes if tip in box.accessibleName())
    box.setFocus()
    box.selectAll()
    QTest.keyClicks(box, text)
    QTest.keyClick(box, Qt.Key.Key_Return)


def bodies(window) -> tuple[Body, ...]:
    return models_of(window).document.recording.bodies


def shown(window, qtbot) -> np.ndarray:
    """Values of the map once it is final."""
    models = models_of(window)
    qtbot.waitUntil(lambda: models.synthesis.complete, timeout=20_000)
    return models.session.maps.synthetic.values.copy()


def test_a_second_body_is_added_moved_named_and_undone(window, qtbot):
    models = models_of(window)
    document = models.document
    alone = shown(window, qtbot)
    add_copy(window, qtbot)
    (copy,) = bodies(window)
    assert copy.moved_m == (0.8, 0, 0)
    assert document.undo_stack.undoText().startswith("Add ")
    type_into(window, "x: to the right", "1.5")
    type_into(window, "z: forward", "0.4")
    type_into(window, "Turn", "90")
    type_into(window, "Name", "anna")
    (moved,) = bodies(window)
    assert (moved.moved_m, moved.turn_deg, moved.person) == ((1.5, 0, 0.4), 90, "anna")
    assert document.mesh.persons == ("person 1", "anna")
    both = shown(window, qtbot)
    assert not np.array_equal(both, alone)
    maker = models.synthesis.made_by()[0]()
    made = Synthesizer(document.mesh, maker.options).map(models.sensor.sensor)
    np.testing.assert_array_equal(made.values, both)
    view = window.findChild(SceneView)
    assert len(view.scene.movables.people) == 1
    for _ in range(5):
        window.action("undo").trigger()
    assert bodies(window) == ()
    assert document.mesh.others == ()
    np.testing.assert_array_equal(shown(window, qtbot), alone)
    assert view.scene.movables.people == ()
    window.action("redo").trigger()
    press(window, "Remove")
    assert bodies(window) == ()


def test_one_person_of_two_is_shown_alone(window, qtbot):
    models = models_of(window)
    alone = shown(window, qtbot)
    add_copy(window, qtbot)
    type_into(window, "x: to the right", "3")
    both = shown(window, qtbot)
    menu = window.findChild(LimbMenu) or LimbMenu(models.limbs, window)
    menu.aboutToShow.emit()
    offered = {action.text().replace("&", ""): action for action in menu.actions()}
    assert list(offered)[:3] == ["Everybody", "person 1", "person 2"]
    offered["person 1"].trigger()
    qtbot.waitUntil(lambda: models.synthesis.complete and models.synthesis.split, timeout=20_000)
    first = models.session.maps.synthetic.values
    np.testing.assert_allclose(first, alone, atol=1e-6 * alone.max())
    models.limbs.show("person 2")
    second = models.session.maps.synthetic.values
    np.testing.assert_allclose(first + second, both, atol=1e-6 * both.max())


def hover(widget, place: QPoint) -> None:
    for near in (place + QPoint(1, 1), place):  # a pointer that is there already does not move
        QTest.mouseMove(widget, near)


def pointed_at(window, qtbot) -> tuple[QWidget, QPoint, np.ndarray]:
    """Widget and pixel where the pointer is on the only other body, and the middle of that."""
    view = window.findChild(SceneView)
    scene = view.scene
    qtbot.waitUntil(lambda: scene.pose.size_px == (view.width(), view.height()), timeout=5_000)
    qtbot.wait(300)  # until the view shows both
    middle = scene.movables.points_m.mean(axis=0)
    x, y, _ = scene.pose.project(middle)[0]
    start = QPoint(round(x), round(y))
    widget = view.childAt(start)
    hover(widget, start)
    assert view.navigator.target == Target("movable", 0)
    return widget, start, middle


def test_the_map_follows_a_body_while_it_is_dragged_and_settles(window, qtbot):
    models = models_of(window)
    synthesis, stack = models.synthesis, models.document.undo_stack
    add_copy(window, qtbot)
    before = shown(window, qtbot)
    widget, start, _ = pointed_at(window, qtbot)
    count, ranks = stack.count(), []
    synthesis.painted.connect(lambda part: ranks.append(part.quality))
    QTest.mousePress(widget, LEFT, Qt.KeyboardModifier.NoModifier, start)
    for part in (0.5, 1.0):
        QTest.mouseMove(widget, start + QPoint(50, -20) * part)
    assert synthesis.moving
    qtbot.waitUntil(lambda: bool(ranks), timeout=10_000)
    assert ranks[0] < FINAL
    settled = shown(window, qtbot)  # a hand that holds still
    assert models.sensor.dragging
    assert stack.count() == count
    assert not np.array_equal(settled, before)
    maker = synthesis.made_by()[0]()
    made = Synthesizer(models.document.mesh, maker.options).map(models.sensor.sensor)
    np.testing.assert_array_equal(made.values, settled)
    QTest.mouseRelease(widget, LEFT, Qt.KeyboardModifier.NoModifier, start + QPoint(50, -20))
    np.testing.assert_array_equal(shown(window, qtbot), settled)
    assert stack.count() == count + 1
    window.action("undo").trigger()
    np.testing.assert_array_equal(shown(window, qtbot), before)


def test_it_is_dragged_on_the_floor_and_kept(window, qtbot, tmp_path):
    models = models_of(window)
    add_copy(window, qtbot)
    stack = models.document.undo_stack
    widget, start, middle = pointed_at(window, qtbot)
    (before,) = bodies(window)
    count = stack.count()
    QTest.mousePress(widget, LEFT, Qt.KeyboardModifier.NoModifier, start)
    for part in (0.5, 1.0):
        QTest.mouseMove(widget, start + QPoint(40, 15) * part)
    QTest.mouseRelease(widget, LEFT, Qt.KeyboardModifier.NoModifier, start + QPoint(40, 15))
    (after,) = bodies(window)
    assert after.moved_m[1] == before.moved_m[1]
    by = np.subtract(after.moved_m, before.moved_m)
    assert np.linalg.norm(by) > 0.05
    assert stack.count() == count + 1
    np.testing.assert_allclose(
        models.document.mesh.others[0].frame(0).mean(axis=0) - middle, by, atol=2e-3
    )
    models.document.save_as(tmp_path / "duo.sd2")
    assert open_recording(tmp_path / "duo.sd2").bodies == (after,)


def test_a_click_on_a_body_shows_it_alone_and_moves_nothing(window, qtbot):
    models = models_of(window)
    add_copy(window, qtbot)
    widget, start, _ = pointed_at(window, qtbot)
    view, count = window.findChild(SceneView), models.document.undo_stack.count()
    qtbot.waitUntil(lambda: models.limbs.vertex_parts is not None, timeout=10_000)
    before, plain = bodies(window), view.grab().toImage().pixelColor(start)
    QTest.mousePress(widget, LEFT, Qt.KeyboardModifier.NoModifier, start)
    QTest.mouseMove(widget, start + QPoint(2, 1))  # a hand is not that still
    QTest.mouseRelease(widget, LEFT, Qt.KeyboardModifier.NoModifier, start + QPoint(2, 1))
    assert models.limbs.parts == ("person 2",)
    assert (bodies(window), models.document.undo_stack.count()) == (before, count)
    chosen = view.grab().toImage().pixelColor(start)
    assert chosen != plain
    x, y, _ = view.scene.pose.project(view.scene.body.points.mean(axis=0))[0]
    first = QPoint(round(x), round(y))
    QTest.mouseClick(widget, LEFT, Qt.KeyboardModifier.ControlModifier, first)
    assert models.limbs.parts == ("person 1", "person 2")
    hover(widget, start)
    assert view.overlay.reading == "person 2"
    QTest.mouseClick(widget, LEFT, Qt.KeyboardModifier.NoModifier, QPoint(5, 300))
    assert models.limbs.parts == ()
    hover(widget, start)  # which lights it up, as before
    assert view.grab().toImage().pixelColor(start) == plain


def test_a_copy_has_its_faces_from_the_same_file(window, qtbot, tmp_path):
    document = models_of(window).document
    mesh = document.mesh
    np.savez(tmp_path / "points.npz", vertices=mesh.read(0, 9), times_s=mesh.times_s[:9])
    np.save(tmp_path / "faces.npy", mesh.faces)
    made = Recording.create(
        tmp_path / "apart.sd2", mesh=tmp_path / "points.npz", faces=tmp_path / "faces.npy"
    )
    with qtbot.waitSignal(document.opened, timeout=10_000):
        window.open_paths([made.folder])
    add_copy(window, qtbot)
    (copy,) = bodies(window)
    assert copy.faces == str(tmp_path / "faces.npy")
    np.testing.assert_array_equal(document.mesh.others[0].faces, mesh.faces)


def test_files_are_read_in_the_background_and_what_is_no_body_is_not_taken(
    window, qtbot, tmp_path, monkeypatch: pytest.MonkeyPatch
):
    models, gate, readers = models_of(window), threading.Event(), set()
    path = tmp_path / "points.npz"
    np.savez(path, vertices=np.zeros((5, 4, 3)), times_s=np.arange(5) / 30)
    load, now = bodies_of_files.load_mesh, threading.get_ident

    def wait(*args, **options):
        readers.add(now())
        assert gate.wait(10)
        return load(*args, **options)

    monkeypatch.setattr(bodies_of_files, "load_mesh", wait)
    shutil.copy(models.document.recording.mesh, tmp_path / "anna.npz")
    for name in ("points.npz", "anna.npz"):
        answer = (str(tmp_path / name), "")
        monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_, answer=answer, **__: answer)
        press(window, "Add file…")
    assert "Reading anna.npz" in [job.title for job in models.jobs.jobs]
    assert bodies(window) == ()
    gate.set()
    qtbot.waitUntil(lambda: bool(bodies(window)), timeout=10_000)
    assert [one.file_name for one in bodies(window)] == ["anna.npz"]
    assert "points.npz has no faces" in window.messages.text
    assert now() not in readers
    assert models.document.undo_stack.count() == 1
