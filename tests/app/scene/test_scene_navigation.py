"""Gestures of the pointer, without a window and without drawing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import Qt
from vtkmodules.vtkRenderingCore import vtkRenderer

from sd2app.scene.camera import EyePose
from sd2app.scene.navigation import MIN_GRAB_PX, Navigator, Target
from sd2app.scene.scene import Scene
from sd2core.mesh.sequence import MeshSequence
from sd2core.placements.placements import Place
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

SIZE = (640.0, 460.0)
LEFT, MIDDLE = Qt.MouseButton.LeftButton, Qt.MouseButton.MiddleButton
NONE = Qt.KeyboardModifier.NoModifier
SHIFT, CTRL = Qt.KeyboardModifier.ShiftModifier, Qt.KeyboardModifier.ControlModifier


class Hand:
    """A scene, a navigator, and the edits that it makes of a drag."""

    def __init__(self) -> None:
        self.scene = Scene(vtkRenderer())
        self.scene.pose = EyePose(size_px=SIZE)
        vertices = np.random.default_rng(1).uniform((-0.3, -0.6, 1.9), (0.3, 1.0, 2.4), (60, 3))
        faces = np.arange(60).reshape(20, 3)
        self.scene.set_mesh(MeshSequence(vertices[None], faces, Timebase([0.0])))
        self.scene.set_sensor(VirtualSensor((0.4, -0.2, 0.3)))
        self.scene.pose = self.scene.preset_pose("overview")
        self.log: list[str] = []
        self.picked: list[int] = []
        self.navigator = Navigator(self.scene, self, self.picked.append, lambda: None)

    def begin_sensor_drag(self) -> None:
        self.log.append("begin")

    def drag_sensor(self, position_m: tuple[float, float, float]) -> None:
        self.log.append("drag")
        self.scene.set_sensor(replace(self.scene.sensor, position_m=position_m))

    def end_drag(self) -> None:
        self.log.append("end")

    @property
    def sensor_px(self) -> np.ndarray:
        return self.scene.pose.project(self.scene.sensor.position_m)[0][:2]

    @property
    def sensor_m(self) -> np.ndarray:
        return np.asarray(self.scene.sensor.position_m)


@pytest.fixture
def hand() -> Hand:
    return Hand()


def test_the_sensor_stays_under_the_pointer_where_it_was_taken(hand: Hand) -> None:
    start = hand.sensor_px
    grip = np.add(start, (5, -3))
    hand.navigator.press(*grip, LEFT, NONE)
    for step in ((40, 10), (-120, 70), (33.5, -80.25)):
        hand.navigator.move(*np.add(grip, step), NONE)
        np.testing.assert_allclose(hand.sensor_px, np.add(start, step), atol=1e-6)
    hand.navigator.release(*np.add(grip, step), LEFT)
    assert hand.log == ["begin", "drag", "drag", "drag", "end"]
    assert not hand.navigator.holds_sensor


def test_a_press_alone_does_not_move_the_sensor(hand: Hand) -> None:
    before = hand.sensor_m
    hand.navigator.press(*np.add(hand.sensor_px, 6), LEFT, NONE)
    hand.navigator.release(*np.add(hand.sensor_px, 6), LEFT)
    assert hand.log == ["begin", "end"]
    np.testing.assert_array_equal(hand.sensor_m, before)


def test_the_grip_is_wide_enough_for_a_hand(hand: Hand) -> None:
    far = replace(hand.scene.pose, distance_m=200.0)
    hand.scene.pose = far
    where = hand.sensor_px
    assert hand.navigator.sensor_at(where[0] + MIN_GRAB_PX - 1, where[1])
    assert not hand.navigator.sensor_at(where[0] + MIN_GRAB_PX + 3, where[1])


def test_shift_keeps_the_sensor_on_its_vertical(hand: Hand) -> None:
    before, start = hand.sensor_m, hand.sensor_px
    hand.navigator.press(*start, LEFT, NONE)
    hand.navigator.move(start[0] + 30, start[1] + 60, SHIFT)
    np.testing.assert_allclose(hand.sensor_m[[0, 2]], before[[0, 2]], atol=1e-9)
    assert hand.sensor_m[1] > before[1] + 0.05


def test_ctrl_keeps_the_sensor_on_the_line_to_the_body(hand: Hand) -> None:
    before, start = hand.sensor_m, hand.sensor_px
    body = hand.scene.extent.centre_m
    hand.navigator.press(*start, LEFT, NONE)
    hand.navigator.move(start[0] + 60, start[1], CTRL)
    moved = hand.sensor_m - before
    assert np.linalg.norm(moved) > 0.05
    np.testing.assert_allclose(np.cross(moved, body - before), 0.0, atol=1e-9)
    assert np.linalg.norm(hand.sensor_m - body) < np.linalg.norm(before - body)


def test_changing_the_constraint_goes_on_from_where_the_sensor_is(hand: Hand) -> None:
    start = hand.sensor_px
    hand.navigator.press(*start, LEFT, NONE)
    hand.navigator.move(start[0] + 80, start[1] + 40, NONE)
    middle = hand.sensor_m
    hand.navigator.move(start[0] + 80, start[1] + 41, SHIFT)
    assert np.linalg.norm(hand.sensor_m - middle) < 0.02


@pytest.mark.parametrize(("preset", "keys"), [("overview", CTRL), ("top", SHIFT), ("camera", CTRL)])
def test_a_line_brings_the_sensor_back_from_however_far(
    hand: Hand, preset: str, keys: Qt.KeyboardModifier
) -> None:
    hand.scene.pose = hand.scene.preset_pose(preset)
    hand.scene.set_sensor(VirtualSensor((0.9, -0.6, 0.3)))
    before, start = hand.sensor_m, hand.sensor_px
    line = hand.scene.extent.centre_m - before if keys == CTRL else np.array([0.0, 2.0, 0.0])
    hand.navigator.press(*start, LEFT, keys)
    for share in np.linspace(0.0, 10.0, 100):
        hand.navigator.move(*hand.scene.pose.project(before + share * line)[0][:2], keys)
    assert np.linalg.norm(hand.sensor_m - before) > 5.0
    hand.navigator.move(*start, keys)
    np.testing.assert_allclose(hand.sensor_m, before, atol=1e-6)


@pytest.mark.parametrize(("button", "keys"), [(LEFT, NONE), (MIDDLE, NONE), (LEFT, SHIFT)])
def test_the_view_moves_and_the_sensor_does_not(
    hand: Hand, button: Qt.MouseButton, keys: Qt.KeyboardModifier
) -> None:
    before, pose = hand.sensor_m, hand.scene.pose
    hand.navigator.press(500.0, 400.0, button, keys)
    hand.navigator.move(520.0, 380.0, keys)
    hand.navigator.release(520.0, 380.0, button)
    assert hand.log == []
    np.testing.assert_array_equal(hand.sensor_m, before)
    turned = (pose.azimuth_deg, pose.elevation_deg) != (
        hand.scene.pose.azimuth_deg,
        hand.scene.pose.elevation_deg,
    )
    assert turned == (button == LEFT and keys == NONE)
    assert hand.scene.pose != pose


def test_the_wheel_comes_nearer_but_not_while_the_sensor_is_held(hand: Hand) -> None:
    distance = hand.scene.pose.distance_m
    hand.navigator.wheel(300.0, 200.0, 1.0)
    assert hand.scene.pose.distance_m < distance
    pose = hand.scene.pose
    hand.navigator.press(*hand.sensor_px, LEFT, NONE)
    hand.navigator.wheel(300.0, 200.0, 1.0)
    assert hand.scene.pose == pose


def test_the_sensor_cannot_be_taken_while_one_looks_from_it(hand: Hand) -> None:
    hand.scene.pose = hand.scene.preset_pose("sensor")
    assert not hand.scene.sensor_shown
    assert not hand.navigator.sensor_at(SIZE[0] / 2, SIZE[1] / 2)


@pytest.mark.parametrize("preset", ["overview", "side", "top"])
def test_ready_made_views_show_body_sensor_and_camera(hand: Hand, preset: str) -> None:
    pose = hand.scene.preset_pose(preset)
    corners = np.concatenate([hand.scene.extent.points_m, [hand.sensor_m, (0, 0, 0)]])
    x, y, depth = pose.project(corners).T
    assert (depth > 0).all()
    assert ((x > 0) & (x < SIZE[0]) & (y > 0) & (y < SIZE[1])).all()


def test_the_view_from_the_camera_is_the_cameras(hand: Hand) -> None:
    pose = hand.scene.preset_pose("camera")
    np.testing.assert_allclose(pose.position, 0.0, atol=1e-12)
    np.testing.assert_allclose(pose.axes[2], (0, 0, 1), atol=1e-12)
    x, y, _ = pose.project(hand.scene.extent.points_m).T
    assert ((x > 0) & (x < SIZE[0]) & (y > 0) & (y < SIZE[1])).all()


def test_a_sensor_far_away_does_not_shrink_the_view_to_nothing(hand: Hand) -> None:
    hand.scene.set_sensor(VirtualSensor((1e6, 0.0, 0.0)))
    assert hand.scene.preset_pose("overview").distance_m < 30.0


def test_another_button_does_not_end_a_drag(hand: Hand) -> None:
    start = hand.sensor_px
    hand.navigator.press(*start, LEFT, NONE)
    hand.navigator.press(*start, MIDDLE, NONE)
    hand.navigator.release(*start, MIDDLE)
    assert hand.navigator.holds_sensor
    hand.navigator.move(*np.add(start, 20), NONE)
    np.testing.assert_allclose(hand.sensor_px, np.add(start, 20), atol=1e-6)
    hand.navigator.let_go()
    hand.navigator.release(*start, LEFT)
    assert hand.log == ["begin", "drag", "end"]


@pytest.fixture
def planned(hand: Hand) -> Hand:
    """Three places around the body; the second 0.02 m behind the first."""
    places = (Place(2.0, 60.0), Place(2.02, 60.0), Place(1.5, -40.0, 30.0))
    sensors = tuple(place.sensor((0.0, 0.2, 2.1)) for place in places)
    hand.scene.set_markers(sensors, np.array([one.range_m for one in places]), None)
    hand.scene.pose = hand.scene.preset_pose("overview")
    return hand


def marker_px(hand: Hand, number: int) -> np.ndarray:
    return hand.scene.pose.project(hand.scene.markers.positions_m[number])[0][:2]


def test_every_place_is_in_the_overview(planned: Hand) -> None:
    for number in range(3):
        assert (marker_px(planned, number) > 0).all()
        assert (marker_px(planned, number) < SIZE).all()


def test_a_click_picks_the_nearest_place_and_turns_nothing(planned: Hand) -> None:
    pose = planned.scene.pose
    for number in (2, 1, 0):
        x, y = marker_px(planned, number)
        planned.navigator.move(x, y, NONE)
        assert planned.navigator.target == Target("marker", number)
        planned.navigator.press(x, y, LEFT, NONE)
        planned.navigator.move(x + 2, y - 1, NONE)
        planned.navigator.release(x + 2, y - 1, LEFT)
    assert planned.picked == [2, 1, 0]
    assert planned.scene.pose == pose
    assert planned.log == []


def test_a_drag_that_begins_on_a_place_turns_the_view_and_picks_nothing(planned: Hand) -> None:
    pose = planned.scene.pose
    x, y = marker_px(planned, 2)
    planned.navigator.press(x, y, LEFT, NONE)
    planned.navigator.move(x + 30, y, NONE)
    planned.navigator.release(x + 30, y, LEFT)
    assert planned.picked == []
    assert planned.scene.pose != pose


def test_a_place_under_the_sensor_leaves_the_sensor_to_the_hand(planned: Hand) -> None:
    planned.scene.set_sensor(VirtualSensor(tuple(planned.scene.markers.positions_m[2])))
    x, y = marker_px(planned, 2)
    assert planned.navigator.target_at(x, y) == Target("sensor")
    planned.navigator.press(x, y, LEFT, NONE)
    assert planned.navigator.holds_sensor


def test_places_that_go_away_are_not_under_the_pointer(planned: Hand) -> None:
    planned.navigator.move(*marker_px(planned, 2), NONE)
    planned.scene.set_markers((), np.zeros(0), None)
    planned.navigator.look_again()
    assert planned.navigator.target is None
