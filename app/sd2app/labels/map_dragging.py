"""Mouse actions on spans over a map: a click selects, a double click loops, edges are dragged."""

from __future__ import annotations

from typing import Literal

from PySide6.QtCore import QEvent, QObject, QPointF, Qt
from PySide6.QtGui import QMouseEvent

from sd2app.labels.dragging import LabelDragging
from sd2app.labels.loop import SpanLoop
from sd2app.labels.model import LabelsModel
from sd2app.widgets.time_plot import TimePlot

_EDGE_PX = 4.0
_ATTRACT_PX = 8.0
_MOVED_PX = 3.0

Edge = tuple[int, Literal["start", "end"]]


class SpanDragger(QObject):
    """Event filter on a map; the map itself still seeks, except at edges of selected spans."""

    def __init__(
        self, view: TimePlot, labels: LabelsModel, dragging: LabelDragging, loop: SpanLoop
    ) -> None:
        super().__init__(view)
        self._view, self._labels, self._dragging, self._loop = view, labels, dragging, loop
        self._pressed_px: float | None = None
        self._edge: Edge | None = None
        dragging.changed.connect(self._let_go)
        view.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Handle the mouse events that concern spans."""
        if not isinstance(event, QMouseEvent):
            return False
        place, kind = event.position(), event.type()
        left = event.button() == Qt.MouseButton.LeftButton
        if kind == QEvent.Type.MouseMove:
            return self._move(place, event)
        if kind == QEvent.Type.MouseButtonPress and left:
            return self._press(place)
        if kind == QEvent.Type.MouseButtonRelease and left:
            return self._release(place)
        if kind == QEvent.Type.MouseButtonDblClick and left:
            span = self._labels.at(self._time_s(place)) if self._is_inside(place) else None
            if span is not None:
                self._loop.play(span)
            return span is not None
        return False

    def _press(self, place: QPointF) -> bool:
        self._edge = self._edge_at(place)
        self._pressed_px = place.x() if self._edge is None and self._is_inside(place) else None
        return self._edge is not None

    def _move(self, place: QPointF, event: QMouseEvent) -> bool:
        if self._edge is None:
            if not event.buttons() and self._edge_at(place) is not None:
                self._view.setCursor(Qt.CursorShape.SizeHorCursor)
                return True
            if self._pressed_px is not None and abs(place.x() - self._pressed_px) >= _MOVED_PX:
                self._pressed_px = None
            return False
        if self._dragging.dragging or self._dragging.begin_drag():
            attracted = not event.modifiers() & Qt.KeyboardModifier.AltModifier
            within_s = _ATTRACT_PX * self._view.scale.seconds_per_px if attracted else 0.0
            self._dragging.drag_edge(*self._edge, self._time_s(place), within_s)
        return True

    def _release(self, place: QPointF) -> bool:
        held, pressed_px = self._edge, self._pressed_px
        self._edge = self._pressed_px = None
        if held is not None:
            self._dragging.end_drag()
            return True
        span = self._labels.at(self._time_s(place)) if pressed_px is not None else None
        if span is not None:
            self._labels.select((span.id,))
        return False

    def _let_go(self) -> None:
        if not self._dragging.dragging:
            self._edge = None

    def _edge_at(self, place: QPointF) -> Edge | None:
        """Edge of a selected span near a place."""
        if not self._is_inside(place):
            return None
        time_s = self._time_s(place)
        reach_s = _EDGE_PX * self._view.scale.seconds_per_px
        for span in self._labels.within(time_s - reach_s, time_s + reach_s):
            if self._labels.is_selected(span.id):
                if abs(span.start_s - time_s) <= reach_s:
                    return span.id, "start"
                if abs(span.end_s - time_s) <= reach_s:
                    return span.id, "end"
        return None

    def _is_inside(self, place: QPointF) -> bool:
        return self._view.plot_rect().contains(place)

    def _time_s(self, place: QPointF) -> float:
        return self._view.scale.time_of(place.x())
