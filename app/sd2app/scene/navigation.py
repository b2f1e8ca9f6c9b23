"""Mouse in the scene: rotate, pan, zoom, drag the sensor; no Qt, no VTK.

Positions are device-independent pixels of the view.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sd2app.scene.camera import Vector, drag_along, drag_in_view
from sd2app.scene.scene import Scene

Position = tuple[float, float, float]
Button = Literal["left", "middle", "right"]
Constraint = Literal["view", "vertical", "sight"]

LEAST_GRAB_PX = 14.0
_MARKER_PX = 9.0
_CLICK_PX = 4.0
"""Movement below which a press counts as a click."""
_ZOOM_PER_NOTCH = 0.88


@dataclass
class _Held:
    start_m: Vector
    offset_px: tuple[float, float]
    constraint: Constraint


class Navigator:
    """Turns pointer gestures into a new pose of the scene, or a drag of the sensor.

    Left drags the sensor, or turns the view when it starts elsewhere; middle,
    right or Shift + left shift the view; the wheel zooms at the pointer. While
    the sensor is held, Shift keeps it on its vertical and Ctrl on the line
    between it and the body. A click on a marker of a planned place picks it.
    """

    def __init__(
        self,
        scene: Scene,
        begin_drag: Callable[[], None],
        drag: Callable[[Position], None],
        end_drag: Callable[[], None],
        pick: Callable[[int], None],
        *,
        size_px: Callable[[], tuple[float, float]],
        changed: Callable[[], None],
    ) -> None:
        self._scene = scene
        self._begin_drag = begin_drag
        self._drag_to = drag
        self._end_drag = end_drag
        self._pick = pick
        self._size_px = size_px
        self._changed = changed
        self._button: Button | None = None
        self._held: _Held | None = None
        self._moving: Literal["orbit", "pan"] | None = None
        self._last_px = (0.0, 0.0)
        self._hovering = False
        self._marker: int | None = None
        self._clicking: tuple[int, float, float] | None = None

    @property
    def holds_sensor(self) -> bool:
        """True while the sensor is dragged."""
        return self._held is not None

    @property
    def hovers_sensor(self) -> bool:
        """True while the pointer is over the sensor."""
        return self._hovering

    @property
    def marker(self) -> int | None:
        """Number of the planned place under the pointer."""
        return self._marker

    @property
    def turning(self) -> bool:
        """True while the view is rotated or panned."""
        return self._moving is not None

    def sensor_at(self, x_px: float, y_px: float) -> bool:
        """True if the sensor is close enough to the pointer."""
        size = self._size_px()
        x, y, depth = self._scene.pose.project(self._scene.sensor.position_m, size)[0]
        if not depth > 0.0 or not self._scene.sensor_shown:
            return False
        pixel = self._scene.pose.metres_per_pixel(self._scene.sensor.position_m, size[1])
        radius = max(LEAST_GRAB_PX, self._scene.sensor_radius_m(size) / pixel)
        return math.hypot(x - x_px, y - y_px) <= radius

    def marker_at(self, x_px: float, y_px: float) -> int | None:
        """Number of the planned place within reach of a pointer, the nearest to it."""
        places = self._scene.markers.positions_m
        if not len(places) or self.sensor_at(x_px, y_px):
            return None
        x, y, depth = self._scene.pose.project(places, self._size_px()).T
        away = np.where(depth > 0.01, np.hypot(x - x_px, y - y_px), np.inf)
        nearest = int(away.argmin())
        return nearest if away[nearest] <= _MARKER_PX else None

    def press(self, x_px: float, y_px: float, button: Button, shift: bool, ctrl: bool) -> None:
        """Handle a pressed button; a second one changes nothing."""
        if self._button is not None:
            return
        self._button = button
        self._last_px = (x_px, y_px)
        if button == "left" and self.sensor_at(x_px, y_px):
            start = np.asarray(self._scene.sensor.position_m)
            x, y, _ = self._scene.pose.project(start, self._size_px())[0]
            self._held = _Held(start, (x - x_px, y - y_px), _constraint(shift, ctrl))
            self._begin_drag()
            self._show_hot()
        elif button == "left" and not shift:
            marker = self.marker_at(x_px, y_px)
            self._clicking = None if marker is None else (marker, x_px, y_px)
            self._moving = "orbit"
        else:
            self._moving = "pan"

    def move(self, x_px: float, y_px: float, shift: bool, ctrl: bool) -> None:
        """Handle a move of the pointer, with a button or without."""
        if self._clicking is not None:
            _, x, y = self._clicking
            if math.hypot(x_px - x, y_px - y) < _CLICK_PX:
                return
            self._clicking = None
        dx, dy = x_px - self._last_px[0], y_px - self._last_px[1]
        self._last_px = (x_px, y_px)
        if self._held is not None:
            self._drag(self._held, x_px, y_px, _constraint(shift, ctrl))
        elif self._moving == "orbit":
            self._scene.pose = self._scene.pose.orbited(dx, dy)
            self._changed()
        elif self._moving == "pan":
            self._scene.pose = self._scene.pose.panned(dx, dy, self._size_px()[1])
            self._changed()
        else:
            self._look(x_px, y_px)

    def release(self, x_px: float, y_px: float, button: Button) -> None:
        """Handle a released button."""
        if button == self._button:
            clicked = self._clicking
            self.let_go()
            if clicked is not None:
                self._pick(clicked[0])
            self._look(x_px, y_px)

    def let_go(self) -> None:
        """End whatever is going on, e.g. because the view is hidden."""
        self._button = self._moving = self._clicking = None
        if self._held is not None:
            self._held = None
            self._end_drag()
            self._show_hot()

    def look_again(self) -> None:
        """Test again what is under a resting pointer."""
        if (self._hovering or self._marker is not None) and self._held is None:
            self._look(*self._last_px)

    def leave(self) -> None:
        """Handle the pointer's leaving the view."""
        self._hover(False)
        self._hover_marker(None)

    def wheel(self, x_px: float, y_px: float, notches: float) -> None:
        """Zoom with the wheel; positive comes nearer."""
        if self._held is None:
            factor = _ZOOM_PER_NOTCH**notches
            self._scene.pose = self._scene.pose.zoomed(factor, x_px, y_px, self._size_px())
            self._changed()

    def _drag(self, held: _Held, x_px: float, y_px: float, constraint: Constraint) -> None:
        x, y = x_px + held.offset_px[0], y_px + held.offset_px[1]
        size, pose = self._size_px(), self._scene.pose
        if constraint != held.constraint:
            # Go on from here: the other constraint must not make it jump back.
            held.start_m = np.asarray(self._scene.sensor.position_m)
            held.constraint = constraint
        if constraint == "view":
            position: Vector | None = drag_in_view(held.start_m, pose, x, y, size)
        else:
            down = np.array([0.0, 1.0, 0.0])
            sight = self._scene.extent.centre_m - held.start_m
            direction = down if constraint == "vertical" else sight
            position = drag_along(held.start_m, direction, pose, x, y, size)
        if position is not None:
            self._drag_to((float(position[0]), float(position[1]), float(position[2])))

    def _look(self, x_px: float, y_px: float) -> None:
        self._hover(self.sensor_at(x_px, y_px))
        self._hover_marker(self.marker_at(x_px, y_px))

    def _hover_marker(self, marker: int | None) -> None:
        if marker != self._marker:
            self._marker = marker
            self._changed()

    def _hover(self, hovering: bool) -> None:
        if hovering != self._hovering:
            self._hovering = hovering
            self._show_hot()

    def _show_hot(self) -> None:
        self._scene.set_hot(self._hovering or self._held is not None)
        self._changed()


def _constraint(shift: bool, ctrl: bool) -> Constraint:
    if ctrl:
        return "sight"
    return "vertical" if shift else "view"
