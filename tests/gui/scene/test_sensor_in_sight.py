"""The sensor does not leave the picture unannounced: the view follows, or an arrow says where."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from scene_stage import Stage

LEFT = Qt.MouseButton.LeftButton


def place(stage: Stage, *position_m: float) -> None:
    """Type a place of the sensor."""
    stage.sensor.set_sensor(replace(stage.sensor.sensor, position_m=position_m))
    stage.view.grab()


def body_in_sight(stage: Stage) -> bool:
    scene = stage.view.scene
    x, y, depth = scene.pose.project(scene.extent.points_m).T
    width, height = scene.pose.size_px
    return bool(((depth > 0) & (x > 0) & (x < width) & (y > 0) & (y < height)).all())


def arrow_shown(stage: Stage) -> bool:
    """True if what is painted over the picture at its edges has the sensor's colour."""
    overlay = stage.view.overlay
    picture = overlay.grab().toImage()
    wanted = np.array(
        [int(overlay._colours.accent[at : at + 2], 16) for at in (1, 3, 5)]
    )  # fmt: skip
    data = np.frombuffer(picture.constBits(), np.uint8).reshape(picture.height(), -1, 4)
    return bool((np.abs(data[..., 2::-1].astype(int) - wanted).max(axis=2) < 4).sum() > 20)


@pytest.fixture
def overview(stage: Stage) -> Stage:
    stage.view.set_view("overview")
    stage.view.grab()
    return stage


@pytest.mark.parametrize("position_m", [(0.0, -0.5, -6.0), (6.0, 0.0, 2.0), (-4.0, -3.0, 5.0)])
def test_the_view_follows_a_sensor_that_is_typed_far_away(overview: Stage, position_m) -> None:
    before = overview.view.scene.pose
    place(overview, *position_m)
    scene = overview.view.scene
    assert scene.sensor_in_sight
    assert body_in_sight(overview)
    assert scene.pose.axes[2] == pytest.approx(before.axes[2])
    assert not arrow_shown(overview)
    place(overview, 0.0, 0.0, 0.0)
    assert scene.pose == before  # as it was, once the sensor is back


def test_a_view_that_was_turned_follows_as_well(overview: Stage) -> None:
    widget = overview.view.childAt(QPoint(300, 430))
    QTest.mousePress(widget, LEFT, pos=QPoint(300, 430))
    QTest.mouseMove(widget, QPoint(380, 410))
    turned = overview.view.scene.pose
    place(overview, 0.0, -0.5, -6.0)
    assert overview.view.scene.pose == turned  # not while the hand turns it
    assert arrow_shown(overview)
    QTest.mouseRelease(widget, LEFT, pos=QPoint(380, 410))
    place(overview, 0.0, 0.0, 0.0)
    place(overview, 0.0, -0.5, -6.0)
    assert overview.view.scene.sensor_in_sight
    assert overview.view.scene.pose.azimuth_deg == turned.azimuth_deg


def test_it_follows_when_a_drag_ends_and_not_before(overview: Stage) -> None:
    view, pose = overview.view, overview.view.scene.pose
    start = overview.pixel_of(overview.sensor.sensor.position_m)
    widget = view.childAt(start)
    QTest.mousePress(widget, LEFT, pos=start)
    for beyond in (QPoint(-40, 200), QPoint(-300, 200)):
        QTest.mouseMove(widget, beyond)
        assert view.scene.pose == pose
    assert not view.scene.sensor_in_sight
    QTest.mouseRelease(widget, LEFT, pos=QPoint(-300, 200))
    assert view.scene.sensor_in_sight
    assert body_in_sight(overview)
    assert view.scene.pose.distance_m > pose.distance_m


@pytest.mark.parametrize("preset", ["camera", "overview"])
def test_an_arrow_says_where_it_is_where_the_view_stays(stage: Stage, preset: str) -> None:
    stage.view.set_view(preset)
    stage.view.grab()
    far = {"camera": (0.0, 0.0, -6.0), "overview": (90.0, 0.0, 0.0)}[preset]
    assert not arrow_shown(stage)
    pose = stage.view.scene.pose
    place(stage, *far)
    assert stage.view.scene.pose == pose
    assert arrow_shown(stage)


def test_who_looks_at_something_else_is_left_alone(overview: Stage) -> None:
    scene = overview.view.scene
    scene.preset, scene.pose = None, replace(scene.pose, focus=(0.4, 0.0, 2.0), distance_m=0.3)
    overview.view.grab()
    near = scene.pose
    assert arrow_shown(overview)
    place(overview, 0.0, 0.0, 0.1)
    assert scene.pose == near
