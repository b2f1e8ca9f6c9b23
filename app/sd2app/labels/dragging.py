"""Mouse drags that draw, move and resize spans; each is one step in the history."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, QPointF, Qt, Signal
from PySide6.QtGui import QMouseEvent

from sd2app.labels.edits import LabelEdits
from sd2app.labels.loop import SpanLoop
from sd2app.maps.track_mouse import TimePlot
from sd2app.widgets.time_axis import TimeScale
from sd2core.errors import Sd2Error
from sd2core.labels.edits import Change, Edit, Edits, Side

MOVED_PX = 3.0
"""Way of the mouse from which a press is a drag."""
_EDGE_PX = 4.0
_ATTRACT_PX = 8.0


def attraction_s(event: QMouseEvent, scale: TimeScale) -> float:
    """Return the distance from which edges attract what is dragged; 0 with Alt."""
    free = event.modifiers() & Qt.KeyboardModifier.AltModifier
    return 0.0 if free else _ATTRACT_PX * scale.seconds_per_px


class LabelDragging(QObject):
    """State of a mouse drag of labels, from press to release.

    A refused position is not reported: the user sees that the span stops. ``changed`` is emitted
    when a drag begins or ends.
    """

    changed = Signal()

    def __init__(self, edits: LabelEdits, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.labels, self._playback, self._edits = edits.labels, edits.playback, edits
        self._before: Edits | None = None
        self._dragged: Edit | None = None
        edits.applying.connect(self.end_drag)

    @property
    def dragging(self) -> bool:
        """True during a drag."""
        return self._before is not None

    def begin_drag(self) -> bool:
        """Begin a drag; False where labels cannot be edited."""
        if self._edits.refused():
            return False
        self._before, self._dragged = Edits(self.labels.labels, self._playback.timebase), None
        self.changed.emit()
        return True

    def drag_edge(self, span_id: int, side: Side, time_s: float, within_s: float) -> None:
        """Move an edge of a span to a time; spans within a distance attract it."""
        self._drag(lambda now: now.resize(span_id, side, now.snap(time_s, within_s, {span_id})))

    def drag_span(self, span_id: int, start_s: float, within_s: float) -> None:
        """Move a span to a start; either end snaps.

        Where it is one of several selected spans, all of them move.
        """
        ids = {span_id}
        if span_id in self.labels.selected_ids:
            ids |= self.labels.selected_ids

        def moved(now: Edits) -> Edit:
            ends_s = (0.0, now.labels.span(span_id).duration_s)
            starts_s = (now.snap(start_s + end_s, within_s, ids) - end_s for end_s in ends_s)
            return now.move(ids, span_id, min(starts_s, key=lambda one: abs(one - start_s)))

        self._drag(moved)

    def drag_new(
        self, track: str, from_s: float, to_s: float, within_s: float, *, cutting: bool = False
    ) -> None:
        """Draw a span between two times; ``cutting`` cuts away others there."""
        label, make = self.labels.label, Edits.overwrite if cutting else Edits.create
        self._drag(
            lambda now: make(
                now, track, now.snap(from_s, within_s), now.snap(to_s, within_s), label
            )
        )

    def end_drag(self) -> None:
        """End the drag, as one step in the history."""
        before, self._before = self._before, None
        if before is not None and self._dragged is not None:
            self._edits.make(self._dragged)
        self._dragged = None
        self.changed.emit()

    def cancel_drag(self) -> None:
        """Restore the labels from before the drag."""
        before, self._before, self._dragged = self._before, None, None
        if before is not None:
            self.labels.set_labels(before.labels)
        self.changed.emit()

    def _drag(self, change: Change) -> None:
        assert self._before is not None
        try:
            self._dragged = change(self._before)
        except Sd2Error:
            return
        self.labels.set_labels(self._dragged.labels)


class SpanDragger(QObject):
    """Event filter on a map; the map itself still seeks, except at edges of selected spans."""

    def __init__(self, view: TimePlot, dragging: LabelDragging, loop: SpanLoop) -> None:
        super().__init__(view)
        self._view, self._labels, self._dragging, self._loop = view, dragging.labels, dragging, loop
        self._pressed_px: float | None = None
        self._edge: tuple[int, Side] | None = None
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
            if self._pressed_px is not None and abs(place.x() - self._pressed_px) >= MOVED_PX:
                self._pressed_px = None
            return False
        if not event.buttons():  # a menu or a dialog took the release
            return self._release(place)
        if self._dragging.dragging or self._dragging.begin_drag():
            within_s = attraction_s(event, self._view.scale)
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

    def _edge_at(self, place: QPointF) -> tuple[int, Side] | None:
        """Edge of a selected span near a place."""
        if not self._is_inside(place):
            return None
        time_s = self._time_s(place)
        reach_s = _EDGE_PX * self._view.scale.seconds_per_px
        for span in self._labels.within(time_s - reach_s, time_s + reach_s):
            if span.id in self._labels.selected_ids:
                if abs(span.start_s - time_s) <= reach_s:
                    return span.id, "start"
                if abs(span.end_s - time_s) <= reach_s:
                    return span.id, "end"
        return None

    def _is_inside(self, place: QPointF) -> bool:
        view = self._view
        return view.plot_rect().contains(place) and not view.grip_rect().contains(place)

    def _time_s(self, place: QPointF) -> float:
        return self._view.scale.time_of(place.x())
