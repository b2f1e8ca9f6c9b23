"""Placements in the real window, by keys and mouse."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QCheckBox, QFileDialog, QLabel, QMessageBox, QToolButton
from window_models import models_of

from sd2app.scene.navigation import Target
from sd2app.sensor.feature import PlacementsPage
from sd2app.widgets.inputs import Choice, TypedLine
from sd2core.placements.placements import (
    PlacementCloud,
    PlacementGrid,
    read_placements,
    write_placements,
)
from sd2core.recording.recording import open_recording

GRID = PlacementGrid((1.0, 2.0), (-30.0, 0.0, 30.0))


@pytest.fixture
def page(window, qtbot) -> PlacementsPage:
    """The page on the small recording, with the keyboard in the window."""
    window.bring_up("Sensor", "Placements")
    return window.findChild(PlacementsPage)


def line(page: PlacementsPage, name: str) -> TypedLine:
    return next(one for one in page.findChildren(TypedLine) if one.accessibleName() == name)


def button(page: PlacementsPage, text: str) -> QToolButton:
    return next(one for one in page.findChildren(QToolButton) if one.text() == text)


def words(page: PlacementsPage) -> str:
    return "\n".join(one.text() for one in page.findChildren(QLabel) if one.isVisible())


def choose(page: PlacementsPage, kind: str) -> None:
    box = page.findChild(Choice)
    box.setFocus()
    QTest.keyClick(box, kind[0])


def write(field: TypedLine, text: str) -> None:
    QTest.mouseClick(field, Qt.MouseButton.LeftButton)
    field.selectAll()
    QTest.keyClicks(field, text)


def settle(qtbot, window) -> None:
    places = models_of(window).placements
    qtbot.waitUntil(lambda: places.planned.coverage is not None and not places.busy, timeout=10_000)


def test_a_grid_is_typed_counted_as_it_is_typed_and_is_one_step_back(window, page, qtbot):
    stack = models_of(window).document.undo_stack
    assert "A map from every place" in words(page)
    choose(page, "Grid")
    assert models_of(window).document.recording.placements is not None
    settle(qtbot, window)
    assert "20 placements" in words(page)
    count = stack.count()
    field = line(page, "Ranges, m")
    write(field, "1:2:0.5")
    settle(qtbot, window)
    # Nothing has ended the typing yet.
    assert "15 placements" in words(page)
    QTest.keyClicks(field, "x")
    assert "not a number" in words(page)
    QTest.keyClick(field, Qt.Key.Key_Backspace)
    assert "not a number" not in words(page)
    QTest.keyClick(field, Qt.Key.Key_Return)
    assert not field.hasFocus()
    assert stack.count() == count + 1
    assert models_of(window).document.modified
    window.action("undo").trigger()
    assert field.text() == "1:4:1"
    window.action("undo").trigger()
    assert models_of(window).document.recording.placements is None
    assert "A map from every place" in words(page)


def test_escape_takes_back_what_was_typed(window, page, qtbot):
    models_of(window).edits.plan_placements(GRID)
    stack = models_of(window).document.undo_stack
    count = stack.count()
    field = line(page, "Azimuths, °")
    write(field, "0:90:45")
    assert models_of(window).placements.plan.azimuths_deg == (0.0, 45.0, 90.0)
    QTest.keyClick(field, Qt.Key.Key_Escape)
    assert models_of(window).placements.plan == GRID
    assert stack.count() == count


def test_what_is_being_typed_is_asked_about_before_the_window_closes(window, page, monkeypatch):
    stack = models_of(window).document.undo_stack
    models_of(window).edits.plan_placements(GRID)
    stack.setClean()
    write(line(page, "Ranges, m"), "5")
    asked: list[str] = []
    cancel = QMessageBox.StandardButton.Cancel
    monkeypatch.setattr(QMessageBox, "question", lambda *given: (asked.append(given[2]), cancel)[1])
    window.close()
    assert window.isVisible()
    assert len(asked) == 1
    assert stack.undoText() == "Plan placements"
    assert not stack.isClean()


@pytest.mark.slow
def test_typing_that_ends_in_another_recording_is_no_step_there(
    window, page, qtbot, recording_copy
):
    models_of(window).edits.plan_placements(GRID)
    field = line(page, "Ranges, m")
    write(field, "5")
    with qtbot.waitSignal(models_of(window).document.opened, timeout=20_000):
        window.open_paths([recording_copy])
    field.clearFocus()
    assert models_of(window).placements.plan is None
    assert models_of(window).document.undo_stack.count() == 0


def test_limits_and_cost_are_said(window, page, qtbot):
    models_of(window).edits.plan_placements(PlacementGrid((0.2, 2.0, 20.0)))
    settle(qtbot, window)
    said = words(page)
    # The fake library says 0.6 ms per frame; 60 frames.
    assert "3 maps in about 108 ms, 24 kB" in said
    assert "In the body" in said
    assert "Beyond R max 9.6 m" in said


def test_a_click_in_the_scene_puts_the_sensor_there_and_undo_takes_it_back(window, page, qtbot):
    context = models_of(window)
    context.edits.plan_placements(GRID)
    settle(qtbot, window)
    view = window.features.scene.view
    view.grab()
    places = view.scene.markers.positions_m
    pixels = view.scene.pose.project(places)[:, :2]
    target_at = view.navigator.target_at
    number = next(n for n in range(6) if target_at(*pixels[n]) == Target("marker", n))
    before = context.sensor.sensor
    place = QPoint(*(round(value) for value in pixels[number]))
    widget = view.childAt(place)
    QTest.mouseMove(widget, place)
    QTest.mouseClick(widget, Qt.MouseButton.LeftButton, pos=place)
    assert context.sensor.sensor.position_m == context.placements.planned.sensors[number].position_m
    assert f"{number + 1} of 6" in words(page)
    window.action("undo").trigger()
    assert context.sensor.sensor == before


def test_buttons_go_from_place_to_place_and_the_box_hides_them(window, page, qtbot):
    context = models_of(window)
    context.edits.plan_placements(GRID)
    settle(qtbot, window)
    for _ in range(2):
        QTest.mouseClick(button(page, "Next"), Qt.MouseButton.LeftButton)
    assert context.placements.current == 1
    QTest.mouseClick(button(page, "Previous"), Qt.MouseButton.LeftButton)
    assert context.placements.current == 0
    box = page.findChild(QCheckBox)
    QTest.mouseClick(box, Qt.MouseButton.LeftButton, pos=QPoint(8, box.height() // 2))
    assert not context.placements.shown
    assert not len(window.features.scene.view.scene.markers.positions_m)
    window.action("draw_placements").trigger()
    assert box.isChecked()
    assert len(window.features.scene.view.scene.markers.positions_m) == 6


def test_a_plan_is_saved_exported_and_taken_from_a_file(
    window, page, qtbot, recording_copy, tmp_path, monkeypatch
):
    window.open_paths([recording_copy])
    qtbot.waitUntil(lambda: window.settled, timeout=20_000)
    models_of(window).edits.plan_placements(GRID)
    window.action("save").trigger()
    assert open_recording(recording_copy).placements == GRID
    # An ending is put where it was forgotten.
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: (str(tmp_path / "a"), ""))
    QTest.mouseClick(button(page, "Export…"), Qt.MouseButton.LeftButton)
    assert read_placements(tmp_path / "a.json") == GRID
    cloud = PlacementCloud(5, (1.0, 3.0), seed=2)
    write_placements(tmp_path / "b.json", cloud)
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (str(tmp_path / "b.json"), ""))
    QTest.mouseClick(button(page, "Import…"), Qt.MouseButton.LeftButton)
    assert models_of(window).placements.plan == cloud
    assert line(page, "Count").text() == "5"
    (tmp_path / "b.json").write_text("{}")
    QTest.mouseClick(button(page, "Import…"), Qt.MouseButton.LeftButton)
    assert "b.json" in window.messages.text
    assert models_of(window).placements.plan == cloud
