"""Mouse in the scene: rotate, pan, zoom, drag the sensor and things; no widgets, no VTK.

Positions are device-independent pixels of the view.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from PySide6.QtCore import Qt

from sd2app.scene.camera import Vector, drag_along, drag_in_view, drag_level, triple
from sd2app.scene.scene import Scene
from sd2app.session.undo import Edits

_BUTTONS = (Qt.MouseButton.LeftButton, Qt.MouseButton.MiddleButton, Qt.MouseButton.RightButton)
Constraint = Literal["view", "vertical", "sight"]

MIN_GRAB_PX = 14.0
_MARKER_PX = 9.0
_BODY_PX = 6.0
_CLICK_PX = 4.0
"""Movement below which a press counts as a click."""
_ZOOM_PER_NOTCH = 0.88


@dataclass(frozen=True)
class Target:
    """Target of the pointer: the sensor, a planned place, or a thing or other body."""

    kind: Literal["sensor", "marker", "movable"]
    number: int = 0  # of the place, or of what can be moved: bodies after things
    vertex: int = field(default=0, compare=False)
    place_m: Vector | None = field(default=None, compare=False)  # where it is taken hold of


@dataclass
class _Held:
    number: int | None  # of those that are shown, bodies after things; None: the sensor
    at_m: Vector  # where it was taken hold of
    offset_px: tuple[float, float]
    moved_m: Vector
    start_m: Vector  # where it was when its constraint was chosen
    constraint: Constraint


class Navigator:
    """Turns pointer gestures into a new pose of the scene, or a drag of the sensor or a thing.

    Left drags the sensor, or turns the view when it starts elsewhere; middle,
    right or Shift + left shift the view; the wheel zooms at the pointer. While
    the sensor is held, Shift keeps it on its vertical and Ctrl on the line
    between it and the body. A thing stays on its level while it is dragged, with Shift on its
    vertical. A click on a marker of a planned place picks it.
    """

    def __init__(
        self, scene: Scene, edits: Edits, pick: Callable[[int], None], changed: Callable[[], None]
    ) -> None:
        self._scene, self._edits = scene, edits
        self._pick, self._changed = pick, changed
        self.target: Target | None = None  # under the pointer
        self._button: Qt.MouseButton | None = None
        self._held: _Held | None = None
        self._moving: Literal["orbit", "pan"] | None = None
        self._last_px = (0.0, 0.0)
        self._pressed_px: tuple[float, float] | None = None  # until it is no click any more

    @property
    def busy(self) -> bool:
        """True while a button is held."""
        return self._button is not None

    @property
    def holds_sensor(self) -> bool:
        """True while the sensor is dragged."""
        return self._held is not None and self._held.number is None

    def sensor_at(self, x_px: float, y_px: float) -> bool:
        """True if the sensor is close enough to the pointer."""
        scene, position_m = self._scene, self._scene.sensor.position_m
        x, y, depth = scene.pose.project(position_m)[0]
        if not depth > 0.0 or not scene.sensor_shown:
            return False
        radius_px = scene.sensor_radius_m / scene.pose.metres_per_pixel(position_m)
        return math.hypot(x - x_px, y - y_px) <= max(MIN_GRAB_PX, radius_px)

    @property
    def held_thing(self) -> tuple[int, tuple[float, ...], tuple[float, ...]] | None:
        """Number of the thing or body that is dragged, where it is held, and how far it moved."""
        held = self._held
        if held is None or held.number is None:
            return None
        return held.number, triple(held.at_m + held.moved_m), triple(held.moved_m)

    def target_at(self, x_px: float, y_px: float) -> Target | None:
        """Target at a place of the view; nothing that is behind the first body."""
        scene, pose = self._scene, self._scene.pose
        if self.sensor_at(x_px, y_px):
            return Target("sensor", place_m=np.asarray(self._scene.sensor.position_m))
        marker = pose.nearest(scene.markers.positions_m, x_px, y_px, _MARKER_PX)
        if marker is not None:
            return Target("marker", marker)
        hit = scene.movables.under(pose, x_px, y_px)
        if hit is not None and scene.mesh_shown:
            x, y, depth = pose.project(scene.body.points).T
            beneath = depth[np.hypot(x - x_px, y - y_px) <= _BODY_PX]
            hit = None if (beneath < pose.project(hit[2])[0, 2]).any() else hit
        return None if hit is None else Target("movable", *hit)

    def press(
        self, x_px: float, y_px: float, button: Qt.MouseButton, keys: Qt.KeyboardModifier
    ) -> None:
        """Handle a pressed button, with keys held; a second button changes nothing."""
        if self._button is not None or button not in _BUTTONS:
            return
        left = button == Qt.MouseButton.LeftButton
        target = self.target_at(x_px, y_px) if left else None
        self._button = button
        self._last_px = self._pressed_px = (x_px, y_px)
        if target is not None and target.place_m is not None:
            x, y, _ = self._scene.pose.project(target.place_m)[0]
            number = None if target.kind == "sensor" else target.number
            start_m, offset_px = target.place_m, (x - x_px, y - y_px)
            self._held = _Held(number, start_m, offset_px, np.zeros(3), start_m, _constraint(keys))
            if number is None:
                self._edits.begin_sensor_drag()
            else:
                self._edits.begin_scene_drag(number)
            self._show_hot()
        elif left and not keys & Qt.KeyboardModifier.ShiftModifier:
            self._moving = "orbit"
        else:
            self._moving = "pan"

    def move(self, x_px: float, y_px: float, keys: Qt.KeyboardModifier) -> None:
        """Handle a move of the pointer, with a button or without."""
        if self._pressed_px is not None:
            if math.dist(self._pressed_px, (x_px, y_px)) >= _CLICK_PX:
                self._pressed_px = None
            elif not self.holds_sensor:
                return
        dx, dy = x_px - self._last_px[0], y_px - self._last_px[1]
        self._last_px = (x_px, y_px)
        if self._held is not None:
            self._drag(self._held, x_px, y_px, _constraint(keys))
        elif self._moving is not None:
            pose = self._scene.pose
            self._scene.preset = None
            turn = pose.orbited if self._moving == "orbit" else pose.panned
            self._scene.pose = turn(dx, dy)
            self._changed()
        else:
            self._hover(self.target_at(x_px, y_px))

    def release(self, x_px: float, y_px: float, button: Qt.MouseButton) -> bool:
        """Handle a released button; True for a click."""
        if button != self._button:
            return False
        clicked, turned = self._pressed_px is not None, self._moving == "orbit"
        self.let_go()
        self._hover(self.target_at(x_px, y_px))
        if clicked and turned and self.target is not None and self.target.kind == "marker":
            self._pick(self.target.number)
        return clicked

    def let_go(self) -> None:
        """End whatever is going on, e.g. because the view is hidden."""
        self._button = self._moving = self._pressed_px = None
        if self._held is not None:
            self._held = None
            self._edits.end_drag()
            self._show_hot()

    def look_again(self) -> None:
        """Test again what is under a resting pointer."""
        if self.target is not None and self._button is None:
            self._hover(self.target_at(*self._last_px))

    def leave(self) -> None:
        """Handle the pointer's leaving the view."""
        self._hover(None)

    def wheel(self, x_px: float, y_px: float, notches: float) -> None:
        """Zoom with the wheel; positive comes nearer."""
        if self._held is None:
            self._scene.pose = self._scene.pose.zoomed(_ZOOM_PER_NOTCH**notches, x_px, y_px)
            self._changed()

    def _drag(self, held: _Held, x_px: float, y_px: float, constraint: Constraint) -> None:
        x, y = x_px + held.offset_px[0], y_px + held.offset_px[1]
        if constraint != held.constraint:  # go on from here: it must not jump
            held.start_m, held.constraint = held.at_m + held.moved_m, constraint
        pose, start = self._scene.pose, held.start_m
        if constraint == "vertical":
            at = drag_along(start, np.array([0.0, 1.0, 0.0]), pose, x, y)
        elif held.number is not None:
            at = drag_level(start, pose, x, y)
        elif constraint == "sight":
            at = drag_along(start, self._scene.extent.centre_m - start, pose, x, y)
        else:
            at = drag_in_view(start, pose, x, y)
        if at is None:
            return
        held.moved_m = at - held.at_m
        if held.number is None:
            self._edits.drag_sensor(triple(at))
        else:
            self._scene.movables.shift(held.number, held.moved_m)
            self._edits.drag_in_scene(triple(held.moved_m))
            self._changed()

    def _hover(self, target: Target | None) -> None:
        before, self.target = self.target, target
        if target != before:
            self._show_hot()

    def _show_hot(self) -> None:
        kind, number = (self.target.kind, self.target.number) if self.target else ("", 0)
        self._scene.set_hot(kind == "sensor" or self.holds_sensor)
        movable, held = number if kind == "movable" else None, self.held_thing
        self._scene.movables.set_hot(movable if held is None else held[0])
        self._changed()


def _constraint(keys: Qt.KeyboardModifier) -> Constraint:
    if keys & Qt.KeyboardModifier.ControlModifier:
        return "sight"
    return "vertical" if keys & Qt.KeyboardModifier.ShiftModifier else "view"
