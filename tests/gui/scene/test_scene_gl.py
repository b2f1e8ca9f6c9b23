"""The same view drawn into the window; needs an X display with OpenGL."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QColor, QGuiApplication
from PySide6.QtTest import QTest
from scene_stage import LEFT, RIGHT, Stage, two_plates

from sd2app.scene.offscreen_backend import ImageBackend
from sd2core.placements.placements import Place

pytestmark = pytest.mark.gl


@pytest.fixture
def gl_stage(make_stage: Any, qtbot: Any) -> Stage:
    if QGuiApplication.platformName() != "xcb":
        pytest.skip("needs QT_QPA_PLATFORM=xcb and a display")
    made = make_stage("gl")
    assert not isinstance(made.view._backend, ImageBackend)
    qtbot.waitExposed(made.view)
    made.open(two_plates())
    made.view.set_view("camera")
    made.scatter(np.where(np.arange(8) < 4, 1.5, -1.5), np.ones(8, bool))
    made.view.grab()
    return made


@pytest.mark.slow
def test_the_window_shows_the_colours(gl_stage: Stage) -> None:
    left, right = gl_stage.colour_at(LEFT), gl_stage.colour_at(RIGHT)
    assert left.red() > left.blue() + 60
    assert right.blue() > right.red() + 60
    ground = gl_stage.view.grab().toImage().pixelColor(300, 20)
    assert ground == QColor(gl_stage.view.scene.colours.background)


def test_the_sensor_follows_the_mouse_to_the_pixel(gl_stage: Stage) -> None:
    gl_stage.view.set_view("overview")
    gl_stage.view.grab()
    widget = gl_stage.view.childAt(10, 300)
    start = gl_stage.pixel_of(gl_stage.sensor.sensor.position_m)
    target = start + QPoint(70, 40)
    QTest.mousePress(widget, Qt.MouseButton.LeftButton, pos=start)
    QTest.mouseMove(widget, target)
    QTest.mouseRelease(widget, Qt.MouseButton.LeftButton, pos=target)
    reached = gl_stage.pixel_of(gl_stage.sensor.sensor.position_m)
    assert (reached - target).manhattanLength() <= 1
    assert gl_stage.log == ["begin", "drag", "end"]
    sphere = gl_stage.view.grab().toImage().pixelColor(reached)
    assert sphere.blue() > sphere.red() + 60


def test_turning_the_view_leaves_the_sensor_alone(gl_stage: Stage) -> None:
    widget = gl_stage.view.childAt(10, 300)
    pose, sensor = gl_stage.view.scene.pose, gl_stage.sensor.sensor
    QTest.mousePress(widget, Qt.MouseButton.LeftButton, pos=QPoint(300, 430))
    QTest.mouseMove(widget, QPoint(340, 420))
    QTest.mouseRelease(widget, Qt.MouseButton.LeftButton, pos=QPoint(340, 420))
    assert gl_stage.view.scene.pose != pose
    assert gl_stage.sensor.sensor == sensor


def test_closing_and_opening_again_is_safe(gl_stage: Stage, make_stage: Any, qtbot: Any) -> None:
    gl_stage.view.close()
    gl_stage.display.set_dark(True)
    QGuiApplication.processEvents()
    again = make_stage("gl")
    qtbot.waitExposed(again.view)
    again.open(two_plates())
    again.view.set_view("camera")
    again.scatter(np.full(8, 1.5), np.ones(8, bool))
    assert again.colour_at(LEFT).red() > again.colour_at(LEFT).blue() + 60


def test_planned_places_have_the_colours_of_their_ranges(gl_stage: Stage) -> None:
    gl_stage.view.set_view("side")
    gl_stage.plan((Place(0.9), Place(1.9, 0.0, 30.0)))
    gl_stage.view.grab()
    near, far = (gl_stage.colour_at(point_m) for point_m in gl_stage.marker_middles_m())
    assert near.green() > near.blue() + 60
    assert far.blue() > far.green() + 10
