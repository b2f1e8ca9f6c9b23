"""Plots over the time axis of a session, and the mouse of maps and tracks under their titles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPen, QWheelEvent

from sd2app.maps.arrangement import HEADER_PX
from sd2app.session.session import Session
from sd2app.session.undo import Offset
from sd2app.widgets.canvas import Canvas, Overlay
from sd2app.widgets.time_axis import GUTTER_PX, MARGIN_PX, TimeScale, paint_cursor, signed_text

_CURSORS = {
    "seek": Qt.CursorShape.CrossCursor,
    "offset": Qt.CursorShape.SizeHorCursor,
    "fold": Qt.CursorShape.PointingHandCursor,
    "": Qt.CursorShape.ArrowCursor,
}
_ZOOM_PER_NOTCH = 0.8
_GRIP_PX = 152, 24


def offset_text(offset_s: float) -> str:
    """Offset of what was measured, in words."""
    return f"offset {signed_text(round(offset_s, 3))} s"


class TimePlot(Canvas):
    """Plot over the time axis that follows the clock, the theme, and what others draw over it."""

    TOP_PX: ClassVar[int] = 0
    """Room above the plot."""
    BOTTOM_PX: ClassVar[int] = 0
    """Room below the plot."""

    def __init__(self, session: Session, overlays: Sequence[Overlay] = ()) -> None:
        super().__init__()
        self._session, self._overlays = session, tuple(overlays)
        self._span, self._playback, self._pointer = session.span, session.playback, session.pointer
        self._display = session.display
        self._grab: tuple[str, float] | None = None  # what is dragged, and from where
        self._dragged_px = 0.0  # how far a grip is from the middle
        self.follow(self._playback.frame_changed, session.aligning.changed)
        self._display.theme_changed.connect(self.redraw)
        for overlay in self._overlays:
            self.follow(*overlay.changed)

    def _paint_overlays(self, painter: QPainter) -> None:
        for overlay in self._overlays:
            overlay.paint(painter, self.plot_rect(), self.scale)

    @property
    def scale(self) -> TimeScale:
        """Time axis of this widget."""
        return TimeScale(*self._span.span_s, self.width())

    def plot_rect(self) -> QRectF:
        """Rectangle of the plot, in pixels."""
        width, height = self.width() - GUTTER_PX - MARGIN_PX, self.height() - self.TOP_PX
        return QRectF(GUTTER_PX, self.TOP_PX, max(width, 1), max(height - self.BOTTOM_PX, 1))

    def grip_rect(self) -> QRectF:
        """Rectangle of what moves the plot in time; empty where nothing does."""
        return QRectF()

    def paint_cursors(self, painter: QPainter, plot: QRectF, pointer_colour: QColor) -> None:
        """Paint the time under the pointer, dotted, and the time on screen."""
        if self.still:
            return
        if self._pointer.time_s is not None:
            painter.setPen(QPen(pointer_colour, 1, Qt.PenStyle.DotLine))
            x = self.scale.x_of(self._pointer.time_s)
            painter.drawLine(QPointF(x, plot.top()), QPointF(x, plot.bottom()))
        paint_cursor(painter, plot, self.scale.x_of(self._playback.time_s))


class ZoomedPlot(TimePlot):
    """Plot whose time axis follows the wheel."""

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom about the pointer, or pan with Shift or a sideways wheel."""
        delta, span = event.angleDelta(), self._span
        sideways = delta.x() or (
            delta.y() if event.modifiers() & Qt.KeyboardModifier.ShiftModifier else 0
        )
        if sideways:
            span.pan(-sideways / 120.0 * span.duration_s * 0.1)
        elif delta.y():
            anchor_s = self.scale.time_of(event.position().x())
            span.zoom(_ZOOM_PER_NOTCH ** (delta.y() / 120.0), anchor_s)
        event.accept()


class SeekingPlot(TimePlot):
    """Plot on which a click or drag seeks."""

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Seek while the left button is down."""
        if event.buttons() & Qt.MouseButton.LeftButton:
            self._playback.seek(self.scale.time_of(event.position().x()))

    mouseMoveEvent = mousePressEvent


class TrackMouse(ZoomedPlot):
    """Click or drag seeks, the middle button and the wheel move and scale the time axis.

    While the user aligns, what was measured has a grip in its middle that moves it in time.
    """

    OFFSET: ClassVar[Offset]
    """What the grip moves."""

    @property
    def measured_from_s(self) -> float | None:
        """Offset of what was measured; None where nothing was."""
        return None

    def grip_rect(self) -> QRectF:
        """Rectangle of the grip; empty where none is shown."""
        plot, shown = self.plot_rect(), self._session.aligning.active and not self.still
        if not shown or self.measured_from_s is None:
            return QRectF()
        width, height = _GRIP_PX
        grip = QRectF(0, 0, min(width, plot.width()), min(height, plot.height()))
        grip.moveCenter(plot.center() + QPointF(self._dragged_px, 0))
        return grip

    def paint_grip(self, painter: QPainter) -> None:
        """Paint the grip with the offset on it."""
        grip, offset_s, colours = self.grip_rect(), self.measured_from_s, self._display.palette
        if grip.isEmpty() or offset_s is None:
            return
        painter.setPen(QPen(QColor(colours.accent), 1.5))
        painter.setBrush(QColor(colours.panel))
        painter.drawRoundedRect(grip, 4, 4)
        painter.setPen(QColor(colours.text))
        painter.drawText(grip, Qt.AlignmentFlag.AlignCenter, f"◂  {offset_text(offset_s)}  ▸")

    def use_of(self, place: QPointF) -> str:
        """Use of the left button at a place: a key of the cursors."""
        return "offset" if self.grip_rect().contains(place) else "seek"

    def point_at(self, place: QPointF) -> None:
        """Read what is under the pointer."""
        raise NotImplementedError

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Start to drag the cursor, the time axis or the alignment, with one button."""
        if self._grab is not None:
            return
        place = event.position()
        time_s = self.scale.time_of(place.x())
        if event.button() == Qt.MouseButton.MiddleButton:
            self._grab = ("pan", time_s)
        elif event.button() == Qt.MouseButton.LeftButton:
            use = self.use_of(place)
            if use == "seek":
                self._session.playback.seek(time_s)
            elif use == "offset":
                self._session.edits.begin_offset_drag(self.OFFSET)
            else:
                return
            self._grab = (use, time_s)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag what is held, and read what is under the pointer."""
        place = event.position()
        self.point_at(place)
        if not event.buttons():
            self.mouseReleaseEvent(event)  # a menu or a dialog may have taken it
        if self._grab is None:
            self.setCursor(_CURSORS[self.use_of(place)])
            return
        what, start_s = self._grab
        time_s = self.scale.time_of(place.x())
        if what == "seek":
            self._session.playback.seek(time_s)
        elif what == "pan":
            self._session.span.pan(start_s - time_s)
        else:
            self._dragged_px = place.x() - self.scale.x_of(start_s)
            self._session.edits.drag_offset(time_s - start_s)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End the drag."""
        if self._grab is not None and self._grab[0] == "offset":
            self._session.edits.end_drag()
            self._dragged_px = 0.0
            self.update()
        self._grab = None

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Show the whole recording."""
        if event.position().y() >= HEADER_PX:
            self._session.span.fit()

    def leaveEvent(self, event: object) -> None:
        """Clear the reading under the pointer."""
        self._session.pointer.leave()
        self.update()
