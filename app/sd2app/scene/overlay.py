"""Texts and scales over the 3D picture: sharp, and without rendering again."""

from __future__ import annotations

import math

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QImage, QPainter, QPaintEvent, QPen, QPixmap
from PySide6.QtWidgets import QWidget

from sd2app.scene.colours import SceneColours, nice_step
from sd2app.scene.navigation import Navigator
from sd2app.scene.scene import Scene
from sd2core.figures.colours import DIVERGING, SEQUENTIAL

HINT = "Drag moves the sensor  ·  Shift: up and down  ·  Ctrl: nearer and farther"
MARKER_HINT = "Click puts the sensor there"
_VELOCITY_TITLE = "Radial velocity, m/s"
_BAR_WIDTH = 10.0
_PAD = 10.0
_GAP = 6.0


class Overlay(QWidget):
    """Colour bar, metre labels, axes and the sensor's coordinates."""

    def __init__(self, scene: Scene, navigator: Navigator, parent: QWidget) -> None:
        super().__init__(parent)
        self._scene = scene
        self._navigator = navigator
        self.message = ""
        self.marker_words: list[str] = []
        self._legend = QRectF()
        self._state: tuple[object, ...] | None = None
        self._picture = QPixmap()
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)

    @property
    def _colours(self) -> SceneColours:
        return self._scene.colours

    @property
    def legend_room_px(self) -> float:
        """Width to keep free on the right, the same for every colouring."""
        words = QFontMetricsF(self._font()).horizontalAdvance(_VELOCITY_TITLE)
        return words + 2 * _PAD + 2 * _GAP + 4.0

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint all texts; repainted only after a change."""
        scene = self._scene
        state = (
            self.message,
            self.size(),
            self.devicePixelRatioF(),
            self.font(),
            scene.pose,
            scene.sensor,
            scene.colours,
            scene.legend_state,
            scene.metre_labels,
            self._navigator.hovers_sensor,
            self._navigator.holds_sensor,
            self._navigator.marker,
        )
        if state != self._state:
            self._state = state
            ratio = self.devicePixelRatioF()
            self._picture = QPixmap(self.size() * ratio)
            self._picture.setDevicePixelRatio(ratio)
            self._picture.fill(Qt.GlobalColor.transparent)
            painter = QPainter(self._picture)
            self._paint_all(painter)
            painter.end()
        QPainter(self).drawPixmap(0, 0, self._picture)

    def _paint_all(self, painter: QPainter) -> None:
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setFont(self._font())
        if self.message:
            painter.setPen(QColor(self._colours.muted))
            rows = self.rect().adjusted(16, 8, -16, -12)
            where = Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignBottom
            painter.drawText(rows, where | Qt.TextFlag.TextWordWrap, self.message)
        self._legend = QRectF()
        self._paint_legend(painter)
        names = self._paint_names(painter)
        self._paint_metres(painter, [*names, self._legend, self._body_box()])
        self._paint_axes(painter)
        if self._navigator.holds_sensor:
            self._paint_coordinates(painter)
        elif self._navigator.hovers_sensor:
            self._paint_hint(painter, HINT)
        elif self._navigator.marker is not None:
            self._paint_marker(painter, self._navigator.marker)

    def _font(self) -> QFont:
        font = QFont(self.font())
        font.setPointSizeF(max(font.pointSizeF() - 1.0, 7.5))
        return font

    def _size(self) -> tuple[float, float]:
        return (self.width(), self.height())

    def _paint_metres(self, painter: QPainter, occupied: list[QRectF]) -> None:
        labels = self._scene.metre_labels
        if not labels:
            return
        painter.setPen(QColor(self._colours.muted))
        texts = [label.text for label in labels]
        sides = [
            self._metre_boxes(painter, texts, [label.left_m for label in labels], occupied),
            self._metre_boxes(painter, texts, [label.right_m for label in labels], occupied),
        ]
        for text, box in max(sides, key=len):
            painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)

    def _metre_boxes(
        self,
        painter: QPainter,
        texts: list[str],
        places: list[tuple[float, float, float]],
        occupied: list[QRectF],
    ) -> list[tuple[str, QRectF]]:
        """Boxes of the labels that fit into the view without touching anything."""
        metrics = QFontMetricsF(painter.font())
        view, middle = QRectF(self.rect()), self._body_box().center().x()
        taken = list(occupied)
        boxes: list[tuple[str, QRectF]] = []
        pixels = self._scene.pose.project(places, self._size())
        for text, (x, y, depth) in zip(texts, pixels, strict=True):
            if not depth > 0.1:
                continue
            outwards = 1.0 if x > middle else -1.0
            box = QRectF(0.0, 0.0, metrics.horizontalAdvance(text), metrics.height())
            box.moveCenter(QPointF(x + outwards * (box.width() / 2 + 6.0), y))
            if view.contains(box) and not any(box.intersects(other) for other in taken):
                boxes.append((text, box))
                taken.append(box.adjusted(-6.0, -3.0, 6.0, 3.0))
        return boxes

    def _body_box(self) -> QRectF:
        """Rectangle of the body in the picture; empty when it is behind the virtual camera."""
        box = self._scene.body_box_px(self._size())
        return QRectF() if box is None else QRectF(QPointF(*box[:2]), QPointF(*box[2:]))

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
            painter.drawText(box, Qt.AlignmentFlag.AlignCenter, name)

    def _paint_names(self, painter: QPainter) -> list[QRectF]:
        """Names of sensor and camera beside them; returns their boxes."""
        scene, size = self._scene, self._size()
        metrics = QFontMetricsF(painter.font())
        sensor, camera = scene.pose.project([scene.sensor.position_m, (0.0, 0.0, 0.0)], size)
        names: list[tuple[str, QPointF]] = []
        if scene.sensor_shown and sensor[2] > 0 and not self._navigator.holds_sensor:
            pixel = scene.pose.metres_per_pixel(scene.sensor.position_m, size[1])
            reach = scene.sensor_radius_m(size) / pixel + 8.0
            names.append(("Sensor", QPointF(sensor[0] - reach, sensor[1])))
        together = math.hypot(sensor[0] - camera[0], sensor[1] - camera[1]) < 48.0
        if scene.camera_shown and camera[2] > 0 and not together:
            names.append(("Camera", QPointF(camera[0] - 8.0, camera[1])))
        painter.setPen(QColor(self._colours.muted))
        boxes = []
        for text, right in names:
            width = metrics.horizontalAdvance(text)
            box = QRectF(
                right.x() - width, right.y() - metrics.height() / 2, width, metrics.height()
            )
            painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)
            boxes.append(box)
        return boxes

    def _paint_legend(self, painter: QPainter) -> None:
        mode = self._scene.mode
        if not self._scene.has_mesh or mode == "plain":
            return
        if mode == "visibility":
            self._paint_swatches(painter)
            return
        if mode == "velocity":
            top = self._scene.v_max_mps
            ticks = [(f"{value:+.3g}" if value else "0") for value in np.linspace(top, -top, 5)]
            shares = list(np.linspace(0.0, 1.0, 5))
            title, table, ends = (
                _VELOCITY_TITLE,
                DIVERGING[::-1],
                ("approaching", "receding"),
            )
        else:
            low, high = self._scene.range_limits_m
            step = nice_step(high - low, 6)
            values = np.arange(np.ceil(high / step - 1e-9) * step, low - 1e-9, -step)
            values = values[values <= high + 1e-9]
            decimals = max(-math.floor(math.log10(step) + 1e-9), 0)
            ticks = [f"{value:.{decimals}f}" for value in values]
            shares = [float((high - value) / (high - low)) for value in values]
            title, table, ends = "Range, m", SEQUENTIAL[::-1], ("far", "near")
        self._paint_bar(painter, title, table, ticks, shares, ends)

    def _paint_bar(
        self,
        painter: QPainter,
        title: str,
        table: np.ndarray,
        ticks: list[str],
        shares: list[float],
        ends: tuple[str, str],
    ) -> None:
        colours = self._colours
        metrics = QFontMetricsF(painter.font())
        line = metrics.height()
        length = min(max(0.36 * self.height(), 72.0), 170.0)
        tick_width = max(metrics.horizontalAdvance(text.replace("-", "−")) for text in ticks)
        words = max(metrics.horizontalAdvance(word) for word in ends)
        width = max(metrics.horizontalAdvance(title), words, _BAR_WIDTH + _GAP + tick_width)
        knows_hidden = self._scene.knows_hidden
        height = length + 4.0 * line + _GAP + (line + _GAP if knows_hidden else 0.0)
        card = self._card(painter, width, height)
        right = card.right() - _PAD
        y = card.top() + _PAD
        text_box = QRectF(card.left() + _PAD, y, width, line)
        painter.setPen(QColor(colours.text))
        painter.drawText(text_box, Qt.AlignmentFlag.AlignRight, title)
        painter.setPen(QColor(colours.muted))
        text_box.translate(0.0, line + _GAP)
        painter.drawText(text_box, Qt.AlignmentFlag.AlignRight, ends[0])
        # Half a line more than needed: the first and last tick reach beyond the bar.
        bar = QRectF(right - _BAR_WIDTH, text_box.bottom() + line / 2, _BAR_WIDTH, length)
        strip = np.ascontiguousarray(table).reshape(-1, 1, 3)
        image = QImage(strip.data, 1, len(strip), 3, QImage.Format.Format_RGB888)
        painter.drawImage(bar, image)
        for text, share in zip(ticks, shares, strict=True):
            y = bar.top() + share * bar.height()
            painter.setPen(QPen(QColor(colours.muted), 1.0))
            painter.drawLine(QPointF(bar.left() - 4.0, y), QPointF(bar.left() - 1.0, y))
            painter.setPen(QColor(colours.text))
            tick = QRectF(bar.left() - _GAP - tick_width, y - line / 2, tick_width, line)
            where = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
            painter.drawText(tick, where, text.replace("-", "−"))
        painter.setPen(QColor(colours.muted))
        text_box.moveTop(bar.bottom() + line / 2)
        painter.drawText(text_box, Qt.AlignmentFlag.AlignRight, ends[1])
        if knows_hidden:
            text_box.translate(0.0, line + _GAP)
            self._paint_swatch(painter, text_box, colours.hidden, "hidden")

    def _paint_swatches(self, painter: QPainter) -> None:
        if not self._scene.knows_hidden:
            return
        metrics = QFontMetricsF(painter.font())
        line = metrics.height()
        entries = (
            (self._colours.visible, "visible"),
            (self._colours.hidden, "hidden"),
        )
        width = max(metrics.horizontalAdvance(text) for _, text in entries) + _BAR_WIDTH + _GAP
        card = self._card(painter, width, 2 * line + _GAP)
        box = QRectF(card.left() + _PAD, card.top() + _PAD, width, line)
        for colour, text in entries:
            self._paint_swatch(painter, box, colour, text)
            box.translate(0.0, line + _GAP)

    def _paint_swatch(self, painter: QPainter, box: QRectF, colour: str, text: str) -> None:
        swatch = QRectF(0.0, 0.0, _BAR_WIDTH, _BAR_WIDTH)
        swatch.moveCenter(QPointF(box.right() - _BAR_WIDTH / 2, box.center().y()))
        painter.fillRect(swatch, QColor(colour))
        painter.setPen(QColor(self._colours.muted))
        words = box.adjusted(0.0, 0.0, -_BAR_WIDTH - _GAP, 0.0)
        where = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        painter.drawText(words, where, text)

    def _card(self, painter: QPainter, width: float, height: float) -> QRectF:
        card = QRectF(
            self.width() - width - 2 * _PAD - 8.0, 8.0, width + 2 * _PAD, height + 2 * _PAD
        )
        self._chip(painter, card)
        self._legend = card
        return card

    def _chip(self, painter: QPainter, box: QRectF) -> None:
        colour = QColor(self._colours.background)
        colour.setAlphaF(0.72)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(colour)
        painter.drawRoundedRect(box, 6.0, 6.0)
        painter.setBrush(Qt.BrushStyle.NoBrush)

    def _paint_coordinates(self, painter: QPainter) -> None:
        x, y, z = self._scene.sensor.position_m
        text = f"x {x:+.2f}   y {y:+.2f}   z {z:+.2f} m".replace("-", "−")
        self._paint_beside(painter, text, self._scene.sensor.position_m)

    def _paint_marker(self, painter: QPainter, marker: int) -> None:
        text = self.marker_words[marker].replace("-", "−")
        self._paint_beside(painter, text, tuple(self._scene.markers.positions_m[marker]))
        self._paint_hint(painter, MARKER_HINT)

    def _paint_beside(
        self, painter: QPainter, text: str, point_m: tuple[float, float, float]
    ) -> None:
        """Paint a text right above a point."""
        px, py, _ = self._scene.pose.project(point_m, self._size())[0]
        metrics = QFontMetricsF(painter.font())
        box = QRectF(0.0, 0.0, metrics.horizontalAdvance(text) + 16.0, metrics.height() + 8.0)
        box.moveTo(px + 18.0, py - box.height() - 12.0)
        box.moveLeft(min(max(box.left(), 8.0), self.width() - box.width() - 8.0))
        box.moveTop(min(max(box.top(), 8.0), self.height() - box.height() - 8.0))
        self._chip(painter, box)
        painter.setPen(QColor(self._colours.text))
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)

    def _paint_hint(self, painter: QPainter, text: str) -> None:
        metrics = QFontMetricsF(painter.font())
        box = QRectF(0.0, 0.0, metrics.horizontalAdvance(text) + 16.0, metrics.height() + 8.0)
        if box.width() > self.width() - 16.0:
            return
        box.moveCenter(QPointF(self.width() / 2, 0.0))
        box.moveBottom(self.height() - 8.0)
        self._chip(painter, box)
        painter.setPen(QColor(self._colours.text))
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)
