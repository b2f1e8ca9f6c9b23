"""Walls in the real window: added and typed by keys, undone, kept, drawn; the map follows."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QToolButton
from window_models import models_of

from sd2app.scene.view import SceneView
from sd2app.sensor.scene_pages import WallsSection
from sd2app.widgets.inputs import Choice, NumberBox
from sd2core.doppler import Synthesizer
from sd2core.mesh.walls import Wall
from sd2core.recording.recording import open_recording

LEFT = Qt.MouseButton.LeftButton


def section_of(window) -> WallsSection:
    window.bring_up("Sensor", "Things")
    return window.findChild(WallsSection)


def press(window, text: str) -> None:
    buttons = section_of(window).findChildren(QToolButton)
    QTest.mouseClick(next(one for one in buttons if one.text() == text), LEFT)


def add(window, direction: str) -> None:
    choice = section_of(window).findChild(Choice)
    choice.setFocus()
    wanted = choice.findText(direction)
    step = Qt.Key.Key_Down if wanted > choice.currentIndex() else Qt.Key.Key_Up
    for _ in range(abs(wanted - choice.currentIndex())):
        QTest.keyClick(choice, step)
    press(window, "Add wall")


def type_into(window, tip: str, text: str) -> None:
    boxes = section_of(window).findChildren(NumberBox)
    box = next(box for box in boxes if tip in box.accessibleName())
    box.setFocus()
    box.selectAll()
    QTest.keyClicks(box, text)
    QTest.keyClick(box, Qt.Key.Key_Return)


def walls(window) -> tuple[Wall, ...]:
    return models_of(window).document.recording.walls


def shown(window, qtbot) -> np.ndarray:
    """Values of the map once it is final."""
    models = models_of(window)
    qtbot.waitUntil(lambda: models.synthesis.complete, timeout=20_000)
    return models.session.maps.synthetic.map.values.copy()


def test_a_wall_is_added_typed_and_undone_and_the_map_follows(window, qtbot):
    document = models_of(window).document
    free, mesh = shown(window, qtbot), document.mesh
    add(window, "left")
    (wall,) = walls(window)
    assert (wall.name, wall.loss_db) == ("wall left", 8.2)
    # Half a metre beyond the ball.
    reach_m = float((mesh.frame(0) @ wall.outward).max())
    assert abs(wall.distance_m - max(reach_m, 0.0) - 0.5) < 0.01
    assert document.undo_stack.undoText() == "Add wall left"
    type_into(window, "Distance", "1.2")
    type_into(window, "reflection takes", "0")
    type_into(window, "to the right", "-60")
    near = Wall(1.2, -60.0, 0.0, 0.0)
    assert walls(window) == (near,)
    assert document.mesh.surroundings.walls == (near,)
    ghosts = shown(window, qtbot)
    assert ghosts.sum() > 1.05 * free.sum()
    made = Synthesizer(document.mesh, models_of(window).synthesis.made_by()[0]().options)
    np.testing.assert_array_equal(made.map(models_of(window).sensor.sensor).values, ghosts)
    scene = window.findChild(SceneView).scene
    assert len(scene.walls.shapes) == 2
    for shape in scene.walls.shapes:  # drawn on the wall
        np.testing.assert_allclose(near.before_m(shape.points), 0.0, atol=1e-5)
    for _ in range(4):
        window.action("undo").trigger()
    assert walls(window) == ()
    assert document.mesh.surroundings is None
    assert not scene.walls.shapes
    np.testing.assert_array_equal(shown(window, qtbot), free)
    window.action("redo").trigger()
    press(window, "Remove wall")
    assert walls(window) == ()


def test_a_floor_is_where_the_feet_are(window):
    add(window, "floor")
    (floor,) = walls(window)
    feet_m = float(models_of(window).document.mesh.frame(0)[:, 1].max())
    assert floor.name == "floor"
    assert abs(floor.distance_m - max(feet_m, 0.5)) < 0.006


def test_walls_are_kept_in_the_recording(labelled, qtbot):
    document = models_of(labelled).document
    add(labelled, "ahead")
    add(labelled, "ceiling")
    labelled.action("save").trigger()
    qtbot.waitUntil(lambda: not document.modified, timeout=10_000)
    assert open_recording(document.recording.folder).walls == walls(labelled)
    assert [one.name for one in walls(labelled)] == ["wall ahead", "ceiling"]
