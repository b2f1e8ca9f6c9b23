"""Texts and scales over the 3D picture: sharp, and without rendering again."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QImage, QPainter, QPen
from PySide6.QtWidgets import QWidget

from sd2app.palette import Palette
from sd2app.scene.colours import Colouring
from sd2app.scene.navigation import Navigator
from sd2app.scene.scene import Scene
from sd2app.widgets.canvas import AT_RIGHT, Canvas
from sd2app.widgets.time_axis import paint_readout, tick_step, ticks
from sd2core.figures.colours import DIVERGING, SEQUENTIAL, Rgb

HINT = "Drag moves the sensor  ·  Shift: up and down  ·  Ctrl: nearer and farther"
MARKER_HINT = "Click puts the sensor there"
THING_HINT = "Drag moves the {}  ·  Shift: up and down"
_VELOCITY_TITLE = "Radial velocity, m/s"
_BAR_WIDTH = 10.0
_PAD = 10.0
_GAP = 6.0
_ARROW_PX = 8.0
_CENTRE = Qt.AlignmentFlag.AlignCenter


@dataclass(frozen=True)
class _Bar:
    """A bar of colours, from top to bottom."""

    title: str
    table: Rgb
    ends: tuple[str, str]
    ticks: list[tuple[float, str]]  # share of the bar's height, text

    @classmethod
    def of(cls, colouring: Colouring) -> _Bar | None:
        """Bar of what the colour of the mesh means, where that is a number."""
        if colouring.limbs:
            return None
        if colouring.mode == "velocity":
            values = [colouring.v_max_mps * (1.0 - 2.0 * share) for share in np.linspace(0, 1, 5)]
            texts = [f"{value:+.3g}".replace("-", "−") if value else "0" for value in values]
            marks = list(zip(np.linspace(0.0, 1.0, 5), texts, strict=True))
            return cls(_VELOCITY_TITLE, DIVERGING[::-1], ("approaching", "receding"), marks)
        if colouring.mode == "range":
            low, high = colouring.range_limits_m
            decimals = max(-math.floor(math.log10(tick_step(high - low, 6)) + 1e-9), 0)
            marks = [
                ((high - value) / (high - low), f"{value:.{decimals}f}")
                for value in ticks(low, high, 6)
            ]
            return cls("Range, m", SEQUENTIAL[::-1], ("far", "near"), marks)
        return None


class Overlay(Canvas):
    """Colour bar, metre labels, axes and the sensor's coordinates."""

    def __init__(self, scene: Scene, navigator: Navigator, parent: QWidget) -> None:
        super().__init__(parent)
        self.reading, self._read_at = "", QPointF()
        self._scene = scene
        self._navigator = navigator
        self.message = ""
        self.hint = ""  # on what a click does now
        self.marker_words: list[str] = []
        self.thing_names: list[str] = []
        self._legend = QRectF()
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)

    @property
    def _colours(self) -> Palette:
        return self._scene.colours

    @property
    def legend_room_px(self) -> float:
        """Width to keep free on the right, the same for every colouring."""
        words = QFontMetricsF(self._font()).horizontalAdvance(_VELOCITY_TITLE)
        return words + 2 * _PAD + 2 * _GAP + 4.0

    def paint(self, painter: QPainter) -> None:
        """Paint all texts."""
        for part in (self._paint_legend, self._paint_rest):
            painter.save()
            part(painter)
            painter.restore()
        if self.reading:
            area = QRectF(self.rect())
            paint_readout(painter, area, self._read_at, (self.reading,), self._colours)

    def show_reading(self, place_px: tuple[float, float], text: str) -> None:
        """Show what is read of the mesh beside the pointer; an empty text ends it."""
        if text or self.reading:
            self.reading, self._read_at = text, QPointF(*place_px)
            self.update()

    def _paint_rest(self, painter: QPainter) -> None:
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setFont(self._font())
        if self.message:
            rows = QRectF(self.rect().adjusted(16, 8, -16, -12))
            where = Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignBottom
            self._write(painter, rows, self.message, where | Qt.TextFlag.TextWordWrap)
        names = self._paint_names(painter)
        # Behind the virtual camera there is no body.
        box = self._scene.body_box_px
        body = QRectF() if box is None else QRectF(QPointF(*box[:2]), QPointF(*box[2:]))
        self._paint_metres(painter, [*names, self._legend], body)
        self._paint_axes(painter)
        if not (self._scene.sensor_in_sight or self._navigator.holds_sensor):
            self._paint_where_sensor_is(painter)
        position_m, target = self._scene.sensor.position_m, self._navigator.target
        kind, number = (target.kind, target.number) if target is not None else ("", 0)
        if self._navigator.holds_sensor:
            self._paint_beside(painter, _place_words(position_m), position_m)
        elif (held := self._navigator.held_thing) is not None:
            held_number, at_m, moved_m = held
            self._paint_beside(painter, self._words_of_held(held_number, moved_m), at_m)
        elif kind == "sensor":
            self._paint_hint(painter, HINT)
        elif kind == "movable" and number < len(self.thing_names):
            words = THING_HINT.format(self.thing_names[number])
            if not (self.hint and self._paint_hint(painter, f"{words}  ·  {self.hint}")):
                self._paint_hint(painter, words)
        elif self.hint:
            self._paint_hint(painter, self.hint)
        elif kind == "marker":
            place_m = self._scene.markers.positions_m[number]
            self._paint_beside(painter, self.marker_words[number], place_m)
            self._paint_hint(painter, MARKER_HINT)

    def _words_of_held(self, number: int, moved_m: Sequence[float]) -> str:
        """Place of a dragged thing's foot, or the way of a body from its file's place, in words."""
        movables = self._scene.movables
        other = movables.person_of(number)
        if other is None:
            return _place_words(np.add(movables.things[number].thing.position_m, moved_m))
        placed = movables.people[other].mesh.placed
        before_m = (0.0, 0.0, 0.0) if placed is None else placed.moved_m
        return f"moved by {_place_words(np.add(before_m, moved_m))}"

    def _font(self) -> QFont:
        font = QFont(self.font())
        font.setPointSizeF(max(font.pointSizeF() - 1.0, 7.5))
        return font

    def _write(
        self, painter: QPainter, box: QRectF, text: str, where: Any = _CENTRE, colour: str = ""
    ) -> None:
        painter.setPen(QColor(colour or self._colours.muted))
        painter.drawText(box, where, text)

    def _paint_metres(self, painter: QPainter, occupied: list[QRectF], body: QRectF) -> None:
        labels = self._scene.metre_labels
        if not labels:
            return
        texts = [label.text for label in labels]
        left, right = [one.left_m for one in labels], [one.right_m for one in labels]
        sides = [
            self._metre_boxes(painter, texts, places, occupied, body) for places in (left, right)
        ]
        for text, box in max(sides, key=len):
            self._write(painter, box, text)

    def _metre_boxes(
        self,
        painter: QPainter,
        texts: list[str],
        places: list[tuple[float, float, float]],
        occupied: list[QRectF],
        body: QRectF,
    ) -> list[tuple[str, QRectF]]:
        """Boxes of the labels that fit into the view without touching anything."""
        metrics = QFontMetricsF(painter.font())
        view, middle = QRectF(self.rect()), body.center().x()
        taken = [*occupied, body]
        boxes: list[tuple[str, QRectF]] = []
        for text, (x, y, depth) in zip(texts, self._scene.pose.project(places), strict=True):
            if not depth > 0.1:
                continue
            outwards = 1.0 if x > middle else -1.0
            box = QRectF(0.0, 0.0, metrics.horizontalAdvance(text), metrics.height())
            box.moveCenter(QPointF(x + outwards * (box.width() / 2 + 6.0), y))
            if view.contains(box) and not any(box.intersects(other) for other in taken):
                boxes.append((text, box))
                taken.append(box.adjusted(-6.0, -3.0, 6.0, 3.0))
        return boxes

    def _paint_axes(self, painter: QPainter) -> None:
        right, down, forward = self._scene.pose.axes
        centre = QPointF(34.0, self.height() - 34.0)
        arms = []
        for name, axis in zip("xyz", np.eye(3), strict=True):
            arms.append((float(axis @ forward), name, float(axis @ right), float(axis @ down)))
        for depth, name, across, downward in sorted(arms, reverse=True):
            colour = QColor(self._colours.muted)
            colour.setAlphaF(1.0 if depth < 0.5 else 0.6)
            if math.hypot(across, downward) < 0.2:
                continue  # it points at the eye
            painter.setPen(QPen(colour, 1.4))
            tip = centre + QPointF(20.0 * across, 20.0 * downward)
            painter.drawLine(centre, tip)
            box = QRectF(0.0, 0.0, 14.0, 14.0)
            box.moveCenter(centre + QPointF(27.0 * across, 27.0 * downward))
            painter.drawText(box, _CENTRE, name)

    def _paint_names(self, painter: QPainter) -> list[QRectF]:
        """Names of sensor and camera beside them; returns their boxes."""
        scene, metrics = self._scene, QFontMetricsF(painter.font())
        sensor, camera = scene.pose.project([scene.sensor.position_m, (0.0, 0.0, 0.0)])
        names: list[tuple[str, float, float]] = []
        if scene.sensor_shown and sensor[2] > 0 and not self._navigator.holds_sensor:
            pixel_m = scene.pose.metres_per_pixel(scene.sensor.position_m)
            names.append(("Sensor", sensor[0] - scene.sensor_radius_m / pixel_m - 8.0, sensor[1]))
        together = math.hypot(sensor[0] - camera[0], sensor[1] - camera[1]) < 48.0
        if scene.camera_shown and camera[2] > 0 and not together:
            names.append(("Camera", camera[0] - 8.0, camera[1]))
        boxes = []
        for text, right, middle in names:
            width, height = metrics.horizontalAdvance(text), metrics.height()
            boxes.append(QRectF(right - width, middle - height / 2, width, height))
            self._write(painter, boxes[-1], text)
        return boxes

    def _paint_legend(self, painter: QPainter) -> None:
        """Paint a bar of colours, a swatch for each of the others, and a card behind them."""
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setFont(self._font())
        self._legend = QRectF()
        scene, colours, metrics = self._scene, self._colours, QFontMetricsF(painter.font())
        mode, bar = scene.colouring.mode, _Bar.of(scene.colouring)
        swatches = [(colour, words) for words, colour in scene.colouring.limbs]
        if not swatches and scene.knows_hidden and mode != "plain":
            swatches = [(colours.visible, "visible")] if mode == "visibility" else []
            swatches += [(colours.hidden, "hidden")]
        if not scene.has_mesh or not (bar or swatches):
            return
        line = metrics.height()
        length = min(max(0.36 * self.height(), 72.0), 170.0)
        beside = [text for _, text in [*(bar.ticks if bar else []), *swatches]]
        width = _BAR_WIDTH + _GAP + max(map(metrics.horizontalAdvance, beside))
        height = len(swatches) * (line + _GAP) - _GAP
        if bar is not None:
            width = max(width, *map(metrics.horizontalAdvance, (bar.title, *bar.ends)))
            height += length + 4.0 * line + 2.0 * _GAP
        left, room = self.width() - width - 2 * _PAD - 8.0, 2 * _PAD
        self._legend = QRectF(left, 8.0, width + room, height + room)
        self._chip(painter, self._legend)
        row = QRectF(left + _PAD, 8.0 + _PAD, width, line)
        if bar is not None:
            self._paint_bar(painter, bar, row, length)
        for colour, text in swatches:
            swatch = QRectF(0.0, 0.0, _BAR_WIDTH, _BAR_WIDTH)
            swatch.moveCenter(QPointF(row.right() - _BAR_WIDTH / 2, row.center().y()))
            painter.fillRect(swatch, QColor(colour))
            self._write(painter, row.adjusted(0.0, 0.0, -_BAR_WIDTH - _GAP, 0.0), text, AT_RIGHT)
            row.translate(0.0, line + _GAP)

    def _paint_bar(self, painter: QPainter, bar: _Bar, row: QRectF, length: float) -> None:
        """Paint title, ends and ticks of a bar, and move ``row`` below it."""
        line, text = row.height(), self._colours.text
        self._write(painter, row, bar.title, AT_RIGHT, text)
        row.translate(0.0, line + _GAP)
        self._write(painter, row, bar.ends[0], AT_RIGHT)
        # Half a line more than needed: the first and last tick reach beyond the bar.
        strip = QRectF(row.right() - _BAR_WIDTH, row.bottom() + line / 2, _BAR_WIDTH, length)
        table = np.ascontiguousarray(bar.table)
        painter.drawImage(strip, QImage(table.data, 1, len(table), 3, QImage.Format.Format_RGB888))
        for share, words in bar.ticks:
            y = strip.top() + share * length
            painter.setPen(QPen(QColor(self._colours.muted), 1.0))
            painter.drawLine(QPointF(strip.left() - 4.0, y), QPointF(strip.left() - 1.0, y))
            tick = QRectF(row.left(), y - line / 2, strip.left() - _GAP - row.left(), line)
            self._write(painter, tick, words, AT_RIGHT, text)
        row.moveTop(strip.bottom() + line / 2)
        self._write(painter, row, bar.ends[1], AT_RIGHT)
        row.translate(0.0, line + _GAP)

    def _chip(self, painter: QPainter, box: QRectF) -> None:
        colour = QColor(self._colours.backdrop)
        colour.setAlphaF(0.72)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(colour)
        painter.drawRoundedRect(box, 6.0, 6.0)
        painter.setBrush(Qt.BrushStyle.NoBrush)

    def _paint_beside(self, painter: QPainter, text: str, point_m: ArrayLike) -> None:
        """Paint a text right above a point, on a chip."""
        x, y, _ = self._scene.pose.project(point_m)[0]
        text = text.replace("-", "−")
        box = self._chip_box(painter, text)
        box.moveTo(x + 18.0, y - box.height() - 12.0)
        box.moveLeft(min(max(box.left(), 8.0), self.width() - box.width() - 8.0))
        box.moveTop(min(max(box.top(), 8.0), self.height() - box.height() - 8.0))
        self._chip(painter, box)
        self._write(painter, box, text, colour=self._colours.text)

    def _paint_where_sensor_is(self, painter: QPainter) -> None:
        """Paint at the edge an arrow to a sensor beyond the picture, and how far off it is."""
        scene, pose = self._scene, self._scene.pose
        position_m = np.asarray(scene.sensor.position_m)
        right, down, _ = pose.axes
        away_m = float(np.linalg.norm(position_m - scene.extent.centre_m))
        towards = np.array([(position_m - pose.position) @ axis for axis in (right, down)])
        length = float(np.linalg.norm(towards))
        # What is right behind the eye is below the picture.
        towards = towards / length if length > 1e-6 else np.array([0.0, 1.0])
        text = f"Sensor, {away_m:.1f} m from the body"
        box = self._chip_box(painter, text)
        box.setWidth(box.width() + 2 * _ARROW_PX)
        room = QRectF(self.rect()).adjusted(8.0, 8.0, -8.0, -8.0)
        free = np.array([room.width() - box.width(), room.height() - box.height()]) / 2
        reach = float((free / np.maximum(np.abs(towards), 1e-9)).min())
        box.moveCenter(room.center() + QPointF(*(reach * towards)))
        if box.intersects(self._legend):
            box.moveTop(self._legend.bottom() + 8.0)
        self._chip(painter, box)
        words = box.adjusted(2 * _ARROW_PX, 0.0, 0.0, 0.0)
        self._write(painter, words, text, colour=self._colours.text)
        middle, along = QPointF(box.left() + _ARROW_PX + 4.0, box.center().y()), QPointF(*towards)
        across = QPointF(-along.y(), along.x())
        painter.setBrush(QColor(self._colours.accent))
        painter.setPen(Qt.PenStyle.NoPen)
        tip, back = middle + along * _ARROW_PX, middle - along * (0.6 * _ARROW_PX)
        painter.drawPolygon([tip, back + across * 5.0, back - across * 5.0])
        painter.setBrush(Qt.BrushStyle.NoBrush)

    def _paint_hint(self, painter: QPainter, text: str) -> bool:
        """Paint a text at the lower edge, on a chip; False where there is no room."""
        box = self._chip_box(painter, text)
        if box.width() > self.width() - 16.0:
            return False
        box.moveCenter(QPointF(self.width() / 2, 0.0))
        box.moveBottom(self.height() - 8.0)
        self._chip(painter, box)
        self._write(painter, box, text, colour=self._colours.text)
        return True

    def _chip_box(self, painter: QPainter, text: str) -> QRectF:
        metrics = QFontMetricsF(painter.font())
        return QRectF(0.0, 0.0, metrics.horizontalAdvance(text) + 16.0, metrics.height() + 8.0)


def _place_words(place_m: Iterable[float]) -> str:
    x, y, z = place_m
    return f"x {x:+.2f}   y {y:+.2f}   z {z:+.2f} m"
