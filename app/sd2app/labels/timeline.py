"""Timeline of labels under the maps, on which spans are drawn, moved and resized by mouse."""

from __future__ import annotations

from typing import Literal, NamedTuple

from PySide6.QtCore import QEvent, QObject, QPoint, QPointF, QRect, QRectF, QSize, Qt, QTimer
from PySide6.QtGui import QAction, QColor, QMouseEvent, QPainter, QResizeEvent
from PySide6.QtWidgets import QFrame, QLabel, QScrollArea, QSizePolicy, QToolTip

from sd2app.labels.dragging import MOVED_PX, LabelDragging, attraction_s
from sd2app.labels.edits import LabelEdits
from sd2app.labels.loop import SpanLoop
from sd2app.labels.model import LabelsModel
from sd2app.labels.painting import (
    ROW_PX,
    LabelRows,
    SpanButtons,
    lane_box,
    paint_span,
    paint_tracks,
)
from sd2app.maps.track_mouse import ZoomedPlot
from sd2app.session.session import Session
from sd2app.widgets.canvas import AT_LEFT
from sd2app.widgets.time_axis import GUTTER_PX, MARGIN_PX, paint_cursor
from sd2core.labels.spans import Span

_EDGE_PX = 5.0
_TIP_MS = 6000


class HitTarget(NamedTuple):
    """Part of the timeline at a place: an edge or the inside of a span, a name, or empty."""

    part: Literal["start", "end", "span", "nothing", "name"]
    x_px: float
    track: str
    span: Span | None = None


def _tip_of(target: HitTarget) -> str:
    span = target.span
    if span is None:
        return target.track if target.part == "name" else ""
    what = f"{span.label} of {span.person}" if span.person else span.label
    lines = [f"{what}: {span.start_s:.3f} to {span.end_s:.3f} s ({span.duration_s:.3f} s)"]
    lines += [span.note] if span.note else []
    return "\n".join(lines)


_SCROLL_MS, _SCROLL_SHARE = 30, 0.03


class LabelTimeline(ZoomedPlot):
    """A row per track. Drag an empty place, a span or an edge of it; with Alt nothing snaps.

    With Shift a new span is drawn over others, which it cuts. A click selects a span and goes to
    its start, with Ctrl it adds to the selection, with Shift it selects all up to it; a double
    click plays it in a loop. A click on the name of a track makes it the one for new spans; what
    is drawn on that of the suggestions comes there too. ``buttons`` decide on a suggestion.
    """

    def __init__(
        self,
        session: Session,
        edits: LabelEdits,
        dragging: LabelDragging,
        loop: SpanLoop,
        buttons: SpanButtons,
    ) -> None:
        super().__init__(session)
        self._edits, self._dragging, self._loop = edits, dragging, loop
        self._labels = labels = edits.labels
        self.buttons = buttons
        self._pressed: QAction | None = None
        self._target: HitTarget | None = None
        self._pressed_s = self._pointer_px = 0.0
        self._within_s, self._cutting = 0.0, False
        self._scroll = QTimer(self, interval=_SCROLL_MS)
        self._scroll.timeout.connect(self._scroll_on)
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName("Labels")
        for signal in (labels.changed, labels.marks_changed):
            signal.connect(self._follow)
        dragging.changed.connect(self._let_go)
        edits.had_no_room.connect(self._say_here)
        for signal in (labels.selection_changed, loop.changed, session.span.changed):
            signal.connect(self.redraw)
        self._follow()

    def sizeHint(self) -> QSize:
        """Return the height of all tracks."""
        return QSize(640, round(self.rows.height_px))

    # --- painting -------------------------------------------------------------------------

    def paint(self, painter: QPainter) -> None:
        """Paint names, spans, marks and the cursor."""
        scale, model, rows = self.scale, self._labels, self.rows
        plot = self.plot_rect()
        colour_of, palette = model.labels.label_set.colour_of, self._session.display.palette
        self.paint_kept(painter, self._paint_rows)
        painter.setClipRect(plot)
        if not (model.labels.spans or model.marks or self._edits.refusal) and rows.tracks:
            self._paint_hint(painter, QRectF(0, 0, self.width(), ROW_PX))
        for mark, lane in zip(model.marks, rows.mark_lanes, strict=True):
            left, right = sorted((scale.x_of(mark.start_s), scale.x_of(self._playback.time_s)))
            box = lane_box(rows.row_of(mark.track), lane, left, right)
            text, colour = f"{mark.label} …", colour_of(mark.label)
            paint_span(painter, box, text, colour, palette, selected=True)
        paint_cursor(painter, plot, scale.x_of(self._playback.time_s))
        self.buttons.paint(painter, scale, plot, rows, palette)

    def _paint_rows(self, painter: QPainter) -> None:
        """Paint the parts that do not move: names, rows, spans."""
        palette = self._session.display.palette
        painter.fillRect(self.rect(), QColor(palette.panel))
        plot, rows = self.plot_rect(), self.rows.tracks
        paint_tracks(painter, plot, self.scale, self._labels, rows, palette)

    def _paint_hint(self, painter: QPainter, row: QRectF) -> None:
        keys = [one.key for one in self._labels.labels.label_set.labels if one.key]
        pressed = f"Press {keys[0]} to {keys[-1]} while it plays" if keys else "Drag here"
        painter.setPen(QColor(self._session.display.palette.muted))
        hint = f"{pressed} to mark a gesture, again to end it – or drag here"
        painter.drawText(row.adjusted(GUTTER_PX + 8, 0, -MARGIN_PX, 0), AT_LEFT, hint)

    def _say_here(self, why: str) -> None:
        """Say at the cursor, once, why nothing comes there."""
        row = self.rows.row_of(self._labels.track) if self._labels.track else self.rows.tracks[0]
        x_px = min(max(self.scale.x_of(self._playback.time_s), GUTTER_PX), self.width())
        place = QPoint(round(x_px), round(row.top_px + row.height_px))
        QToolTip.showText(self.mapToGlobal(place), why, self, QRect(), _TIP_MS)

    def _follow(self) -> None:
        labels = self._labels
        self.rows = LabelRows.of(labels.labels.tracks, labels.arrays, labels.marks)
        self.setFixedHeight(self.sizeHint().height())
        self.redraw()

    # --- the hand -------------------------------------------------------------------------

    def target_at(self, x_px: float, y_px: float) -> HitTarget | None:
        """Find the part of the timeline at a place; edges of selected spans go first."""
        labels, scale, row = self._labels, self.scale, self.rows.row_at(y_px)
        if row is None:
            return None
        if x_px < GUTTER_PX:
            return HitTarget("name", x_px, row.name)
        arrays = labels.arrays
        reach_s = _EDGE_PX * scale.seconds_per_px
        time_s, lane = scale.time_of(x_px), row.lane_at(y_px)
        near = [
            arrays.spans[one]
            for one in arrays.within(time_s - reach_s, time_s + reach_s)
            if arrays.spans[one].track == row.name and arrays.lanes[one] == lane
        ]
        near.sort(key=lambda one: one.id not in labels.selected_ids)
        for span in near:
            # The middle third of a short span is for moving it.
            edge_s = min(reach_s, span.duration_s / 3)
            inside = span.start_s <= time_s < span.end_s
            if abs(time_s - span.start_s) <= (edge_s if inside else reach_s):
                return HitTarget("start", x_px, row.name, span)
            if abs(time_s - span.end_s) <= (edge_s if inside else reach_s):
                return HitTarget("end", x_px, row.name, span)
        held = next((one for one in near if one.start_s <= time_s < one.end_s), None)
        return HitTarget("nothing" if held is None else "span", x_px, row.name, held)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Start a click or a drag, or press a button."""
        if event.button() == Qt.MouseButton.LeftButton:
            self._pressed = self._button_at(event.position())
            if self._pressed is not None:
                return
            self._target = self.target_at(event.position().x(), event.position().y())
            self._pressed_s = self.scale.time_of(event.position().x())
            self._cutting = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag, or show by the cursor what could be dragged."""
        x = event.position().x()
        if self._target is not None and not event.buttons():
            self.mouseReleaseEvent(event)  # a menu or a dialog took it
        if self._target is None:
            if not event.buttons():
                button = self._button_at(event.position())
                self._show_target(self.target_at(x, event.position().y()), button)
            return
        if not self._dragging.dragging and (
            self._target.part == "name"
            or abs(x - self._target.x_px) < MOVED_PX
            or not self._dragging.begin_drag()
        ):
            return
        self._within_s = attraction_s(event, self.scale)
        self._pointer_px = x
        outside = not GUTTER_PX <= x <= self.width() - MARGIN_PX
        if outside != self._scroll.isActive():
            self._scroll.start() if outside else self._scroll.stop()
        self._drag()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End a drag, or take it as a click."""
        self._scroll.stop()
        pressed, self._pressed = self._pressed, None
        if pressed is not None:
            if pressed is self._button_at(event.position()):
                pressed.trigger()
            return
        target, self._target = self._target, None
        if self._dragging.dragging:
            self._dragging.end_drag()
        elif target is not None:
            self._click(target, event.modifiers())

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Play a span in a loop."""
        target = self.target_at(event.position().x(), event.position().y())
        on_button = self._button_at(event.position()) is not None
        if target is not None and target.span is not None and not on_button:
            self._loop.play(target.span)
        else:
            self.mousePressEvent(event)

    def _button_at(self, place: QPointF) -> QAction | None:
        return self.buttons.at(place, self.scale, self.plot_rect(), self.rows)

    def _click(self, target: HitTarget, modifiers: Qt.KeyboardModifier) -> None:
        if target.part != "name" and modifiers & Qt.KeyboardModifier.ShiftModifier and target.span:
            self._labels.select_up_to(target.span)
            return
        self._labels.set_track(target.track)
        if target.span is not None and modifiers & Qt.KeyboardModifier.ControlModifier:
            chosen = {span.id for span in self._labels.selected}
            self._labels.select(chosen ^ {target.span.id})
        elif target.span is not None:
            self._edits.go_to(target.span)
        elif target.part != "name":
            self._labels.select(())
            self._playback.seek(self.scale.time_of(target.x_px))

    def _let_go(self) -> None:
        """Forget the target once the drag was ended elsewhere."""
        if not self._dragging.dragging:
            self._scroll.stop()
            self._target = None

    def _drag(self) -> None:
        target = self._target
        assert target is not None
        # The axis may have been zoomed, or turned a page, since it was pressed.
        time_s, pressed_s = self.scale.time_of(self._pointer_px), self._pressed_s
        within_s = self._within_s
        if target.span is None or self._cutting:
            known = {one.name for one in self._labels.targets}
            track = target.track if target.track in known else self._labels.track
            self._dragging.drag_new(track, pressed_s, time_s, within_s, cutting=self._cutting)
        elif target.part == "span":
            start_s = target.span.start_s + time_s - pressed_s
            self._dragging.drag_span(target.span.id, start_s, within_s)
        else:
            side: Literal["start", "end"] = "start" if target.part == "start" else "end"
            self._dragging.drag_edge(target.span.id, side, time_s, within_s)

    def _scroll_on(self) -> None:
        """Scroll the axis while the mouse is beyond its end."""
        step_s = _SCROLL_SHARE * self._span.duration_s
        self._span.pan(step_s if self._pointer_px > GUTTER_PX else -step_s)
        self._drag()

    def _show_target(self, target: HitTarget | None, button: QAction | None) -> None:
        if button is not None:
            self.setCursor(Qt.CursorShape.ArrowCursor)
            self.setToolTip(f"{button.text().replace('&', '')}\n{button.toolTip()}")
            return
        shapes = {
            "start": Qt.CursorShape.SizeHorCursor,
            "end": Qt.CursorShape.SizeHorCursor,
            "span": Qt.CursorShape.OpenHandCursor,
        }
        part = "nothing" if target is None or self._edits.refusal else target.part
        self.setCursor(shapes.get(part, Qt.CursorShape.ArrowCursor))
        self.setToolTip("" if target is None else _tip_of(target))


class TargetLine(QLabel):
    """Name of the track that new spans go to, where there is more than one."""

    def __init__(self, labels: LabelsModel) -> None:
        super().__init__()
        self._labels = labels
        self.setObjectName("muted")
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setIndent(GUTTER_PX)
        self.setAccessibleName("Track that is marked on")
        self.setToolTip("Click the name of another track to mark on that one")
        for signal in (labels.choices_changed, labels.selection_changed):
            signal.connect(self._follow)
        self._follow()

    def _follow(self) -> None:
        labels = self._labels
        target = labels.track or "no track – add one with Labels → Add track…"
        self.setText(f"Marking on: {target}")
        self.setVisible(len(labels.labels.tracks) > 1 or not labels.track)


_HIGHEST_PX = round(8.5 * ROW_PX)
"""Half a row says that there are more."""


class LabelArea(QScrollArea):
    """Scroll area for many tracks; keeps the track for new spans in view.

    The scroll bar covers the margin beside the tracks, so the time axis keeps its width.
    """

    def __init__(self, timeline: LabelTimeline, labels: LabelsModel) -> None:
        super().__init__()
        self._timeline, self._labels = timeline, labels
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setWidget(timeline)
        bar, across = self.verticalScrollBar(), self.horizontalScrollBar()
        across.rangeChanged.connect(lambda *_: across.setRange(0, 0))  # the margin stays covered
        bar.setAccessibleName("Scroll the tracks of labels")
        bar.setFixedWidth(MARGIN_PX)
        bar.setSingleStep(round(ROW_PX))
        labels.selection_changed.connect(self._show_track)
        self._fit()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Follow the height of the tracks."""
        if event.type() == QEvent.Type.Resize:
            self._fit()
        return super().eventFilter(watched, event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Give the tracks the whole width."""
        super().resizeEvent(event)
        self._timeline.setFixedWidth(self.width())

    def _fit(self) -> None:
        self.setFixedHeight(min(self._timeline.sizeHint().height(), _HIGHEST_PX))

    def _show_track(self) -> None:
        if self._labels.track:
            row = self._timeline.rows.row_of(self._labels.track)
            middle_px = round(row.top_px + row.height_px / 2)
            self.ensureVisible(0, middle_px, 0, round(row.height_px / 2))
