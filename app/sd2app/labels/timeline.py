"""Tracks of labels under the maps: shown, and drawn, moved and shortened by hand."""

from __future__ import annotations

from typing import Literal

from PySide6.QtCore import QRectF, QSize, Qt, QTimer
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QWheelEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from sd2app.labels.dragging import LabelDragging
from sd2app.labels.edits import LabelEdits
from sd2app.labels.grip import Grip, grip_at, words
from sd2app.labels.loop import SpanLoop
from sd2app.labels.model import LabelsModel
from sd2app.labels.painting import lane_box, paint_span, paint_spans
from sd2app.labels.rows import ROW_PX, LabelRows
from sd2app.session.display import DisplayModel
from sd2app.session.playback import PlaybackModel
from sd2app.session.time_window import VisibleSpanModel
from sd2app.widgets.cached_paint import Still
from sd2app.widgets.time_axis import GUTTER_PX, MARGIN_PX, TimeScale, paint_cursor, turn_wheel

_ATTRACT_PX = 8.0
_MOVED_PX = 3.0
_CHOSEN_PX = 3.0
_SMALL = 0.82
"""Of names that would not be whole otherwise."""
_SCROLL_MS, _SCROLL_SHARE = 30, 0.03


class LabelTimeline(QWidget):
    """A row per track. Drag an empty place, a span or one of its edges; Alt lets nothing attract.

    With Shift a span is drawn over others, which it cuts. A click selects a span and goes to its
    start, with Ctrl it adds to the selection, with Shift all up to it; a double click plays it in
    a loop. A click on the name of a track lets new spans come there.
    """

    def __init__(
        self,
        labels: LabelsModel,
        edits: LabelEdits,
        dragging: LabelDragging,
        loop: SpanLoop,
        span: VisibleSpanModel,
        playback: PlaybackModel,
        display: DisplayModel,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._labels, self._edits, self._dragging, self._loop = labels, edits, dragging, loop
        self._span, self._playback, self._display = span, playback, display
        self._grip: Grip | None = None
        self._pointer_px = 0.0
        self._attracted = self._cutting = False
        self._rows = LabelRows.of(labels.labels.tracks, labels.arrays, labels.marks)
        self._still = Still(self)
        self._scroll = QTimer(self)
        self._scroll.setInterval(_SCROLL_MS)
        self._scroll.timeout.connect(self._scroll_on)
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName("Labels")
        for signal in (labels.changed, labels.marks_changed):
            signal.connect(self._follow)
        dragging.changed.connect(self._let_go)
        for signal in (
            labels.selection_changed,
            loop.changed,
            span.changed,
            display.theme_changed,
        ):
            signal.connect(self._redraw)
        playback.frame_changed.connect(self.update)
        self._follow()

    def sizeHint(self) -> QSize:
        """As high as its tracks."""
        return QSize(640, round(self._rows.height_px))

    @property
    def scale(self) -> TimeScale:
        """Time axis of this widget."""
        return TimeScale(self._span.start_s, self._span.end_s, self.width())

    @property
    def rows(self) -> LabelRows:
        """Where tracks and lanes stand."""
        return self._rows

    # --- painting -------------------------------------------------------------------------

    def paintEvent(self, event: QPaintEvent) -> None:
        """Names, spans, what is being marked, cursor."""
        scale, model, rows = self.scale, self._labels, self._rows
        plot = self._plot_rect()
        with QPainter(self) as painter:
            self._still.paint(painter, self._paint)
            painter.setClipRect(plot)
            if not (model.labels.spans or model.marks or self._edits.refusal) and rows.tracks:
                self._paint_hint(painter, QRectF(0, 0, self.width(), ROW_PX))
            for mark, lane in zip(model.marks, rows.mark_lanes, strict=True):
                left, right = sorted((scale.x_of(mark.start_s), scale.x_of(self._playback.time_s)))
                box = lane_box(rows.row_of(mark.track), lane, left, right)
                colour, palette = model.colour_of(mark.label), self._display.palette
                paint_span(painter, box, f"{mark.label} …", colour, palette, selected=True)
            paint_cursor(painter, plot, scale.x_of(self._playback.time_s))

    def _plot_rect(self) -> QRectF:
        return QRectF(GUTTER_PX, 0, self.width() - GUTTER_PX - MARGIN_PX, self.height())

    def _paint(self, painter: QPainter) -> None:
        """What stands still: names, rows, spans."""
        palette, rows = self._display.palette, self._rows.tracks
        painter.fillRect(self.rect(), QColor(palette.panel))
        self._paint_names(painter)
        for row in rows:
            whole = QRectF(0, row.top_px, self.width(), row.height_px)
            painter.fillRect(whole.adjusted(GUTTER_PX, 1, -MARGIN_PX, -1), QColor(palette.well))
        plot = self._plot_rect()
        painter.setClipRect(plot)
        paint_spans(painter, plot, self.scale, self._labels, rows, palette)

    def _paint_names(self, painter: QPainter) -> None:
        palette, rows = self._display.palette, self._rows.tracks
        room_px = GUTTER_PX - 11
        painter.save()
        if any(painter.fontMetrics().horizontalAdvance(row.name) > room_px for row in rows):
            font = painter.font()
            font.setPixelSize(round(_SMALL * painter.fontInfo().pixelSize()))
            painter.setFont(font)
        metrics = painter.fontMetrics()
        place = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        for row in rows:
            chosen = row.name == self._labels.track and len(rows) > 1
            painter.setPen(QColor(palette.accent if chosen else palette.muted))
            if chosen:
                bar = QRectF(0, row.top_px + 3, _CHOSEN_PX, row.height_px - 6)
                painter.fillRect(bar, QColor(palette.accent))
            room = QRectF(5, row.top_px, room_px, row.height_px)
            whole = metrics.horizontalAdvance(row.name) <= room_px
            words = max(map(metrics.horizontalAdvance, row.name.split()))
            if not whole and words <= room_px and row.height_px > 2 * metrics.height():
                painter.drawText(room, place | Qt.TextFlag.TextWordWrap, row.name)
            else:
                shown = metrics.elidedText(row.name, Qt.TextElideMode.ElideRight, room_px)
                painter.drawText(room, place, shown)
        painter.restore()

    def _paint_hint(self, painter: QPainter, row: QRectF) -> None:
        keys = [one.key for one in self._labels.labels.label_set.labels if one.key]
        pressed = f"Press {keys[0]} to {keys[-1]} while it plays" if keys else "Drag here"
        painter.setPen(QColor(self._display.palette.muted))
        painter.drawText(
            row.adjusted(GUTTER_PX + 8, 0, -MARGIN_PX, 0),
            Qt.AlignmentFlag.AlignVCenter,
            f"{pressed} to mark a gesture, again to end it – or drag here",
        )

    def _follow(self) -> None:
        labels = self._labels
        self._rows = LabelRows.of(labels.labels.tracks, labels.arrays, labels.marks)
        self.setFixedHeight(self.sizeHint().height())
        self._redraw()

    def _redraw(self) -> None:
        self._still.forget()
        self.update()

    # --- the hand -------------------------------------------------------------------------

    def grip_at(self, x_px: float, y_px: float) -> Grip | None:
        """What is under the pointer."""
        return grip_at(self._labels, self._rows, self.scale, x_px, y_px)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Take hold."""
        if event.button() == Qt.MouseButton.LeftButton:
            self._grip = self.grip_at(event.position().x(), event.position().y())
            self._cutting = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Show what could be held, or drag what is."""
        x = event.position().x()
        if self._grip is None:
            if not event.buttons():
                self._show_grip(self.grip_at(x, event.position().y()))
            return
        if not self._dragging.dragging and (
            self._grip.part == "name"
            or abs(x - self._grip.x_px) < _MOVED_PX
            or not self._dragging.begin_drag()
        ):
            return
        self._attracted = not event.modifiers() & Qt.KeyboardModifier.AltModifier
        self._pointer_px = x
        outside = not GUTTER_PX <= x <= self.width() - MARGIN_PX
        if outside != self._scroll.isActive():
            self._scroll.start() if outside else self._scroll.stop()
        self._drag()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let go, or click."""
        self._scroll.stop()
        grip, self._grip = self._grip, None
        if self._dragging.dragging:
            self._dragging.end_drag()
        elif grip is not None:
            self._click(grip, event.modifiers())

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Play a span in a loop."""
        grip = self.grip_at(event.position().x(), event.position().y())
        if grip is not None and grip.span is not None:
            self._loop.play(grip.span)
        else:
            self.mousePressEvent(event)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom about the pointer, or pan."""
        turn_wheel(event, self._span, self.scale)

    def _click(self, grip: Grip, modifiers: Qt.KeyboardModifier) -> None:
        if grip.part != "name" and modifiers & Qt.KeyboardModifier.ShiftModifier and grip.span:
            self._labels.select_up_to(grip.span)
            return
        self._labels.set_track(grip.track)
        if grip.span is not None and modifiers & Qt.KeyboardModifier.ControlModifier:
            chosen = {span.id for span in self._labels.selected}
            self._labels.select(chosen ^ {grip.span.id})
        elif grip.span is not None:
            self._edits.go_to(grip.span)
        elif grip.part != "name":
            self._labels.select(())
            self._playback.seek(self.scale.time_of(grip.x_px))

    def _let_go(self) -> None:
        """What is no longer dragged is no longer held."""
        if not self._dragging.dragging:
            self._scroll.stop()
            self._grip = None

    def _drag(self) -> None:
        grip = self._grip
        assert grip is not None
        scale = self.scale
        within_s = _ATTRACT_PX * scale.seconds_per_px if self._attracted else 0.0
        time_s, pressed_s = scale.time_of(self._pointer_px), scale.time_of(grip.x_px)
        if grip.span is None or self._cutting:
            self._dragging.drag_new(grip.track, pressed_s, time_s, within_s, cutting=self._cutting)
        elif grip.part == "span":
            start_s = grip.span.start_s + time_s - pressed_s
            self._dragging.drag_span(grip.span.id, start_s, within_s)
        else:
            side: Literal["start", "end"] = "start" if grip.part == "start" else "end"
            self._dragging.drag_edge(grip.span.id, side, time_s, within_s)

    def _scroll_on(self) -> None:
        """The hand is beyond the end: the axis moves on, and what is held with it."""
        step_s = _SCROLL_SHARE * self._span.duration_s
        before_s = self._span.start_s
        self._span.pan(step_s if self._pointer_px > GUTTER_PX else -step_s)
        assert self._grip is not None
        moved_px = (self._span.start_s - before_s) / self.scale.seconds_per_px
        self._grip = self._grip._replace(x_px=self._grip.x_px - moved_px)
        self._drag()

    def _show_grip(self, grip: Grip | None) -> None:
        shapes = {
            "start": Qt.CursorShape.SizeHorCursor,
            "end": Qt.CursorShape.SizeHorCursor,
            "span": Qt.CursorShape.OpenHandCursor,
        }
        part = "nothing" if grip is None or self._edits.refusal else grip.part
        self.setCursor(shapes.get(part, Qt.CursorShape.ArrowCursor))
        self.setToolTip("" if grip is None else words(grip))
