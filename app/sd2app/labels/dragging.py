"""Mouse drags that draw, move and resize spans; each is one step in the history."""

from __future__ import annotations

from collections.abc import Collection

from PySide6.QtCore import QObject, Signal

from sd2app.labels.edits import LabelEdits
from sd2core.errors import Sd2Error
from sd2core.labels import edits
from sd2core.labels.edits import Change, Edit, Side, move_together
from sd2core.labels.free_time import snap
from sd2core.labels.spans import Labels


class LabelDragging(QObject):
    """State of a mouse drag of labels, from press to release.

    A refused position is not reported: the user sees that the span stops. ``changed`` is emitted
    when a drag begins or ends.
    """

    changed = Signal()

    def __init__(self, edits: LabelEdits, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._labels, self._playback, self._edits = edits.labels, edits.playback, edits
        self._before: Labels | None = None
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
        self._before, self._dragged = self._labels.labels, None
        self.changed.emit()
        return True

    def drag_edge(self, span_id: int, side: Side, time_s: float, within_s: float) -> None:
        """Move an edge of a span to a time; spans within a distance attract it."""
        place_s = self._snapped(time_s, within_s, {span_id})
        self._drag(lambda labels, base: edits.resize(labels, base, span_id, side, place_s))

    def drag_span(self, span_id: int, start_s: float, within_s: float) -> None:
        """Move a span to a start; either end snaps.

        Where it is one of several selected spans, all of them move.
        """
        assert self._before is not None
        length_s = self._before.span(span_id).duration_s
        ids = {span_id}
        if self._labels.is_selected(span_id):
            ids.update(span.id for span in self._labels.selected)
        ends = (
            (self._snapped(start_s, within_s, ids), 0.0),
            (self._snapped(start_s + length_s, within_s, ids), length_s),
        )
        near_s = min((at_s - offset_s for at_s, offset_s in ends), key=lambda t: abs(t - start_s))
        if len(ids) == 1:
            self._drag(lambda labels, base: edits.move(labels, base, span_id, near_s))
        else:
            self._drag(lambda labels, base: move_together(labels, base, ids, span_id, near_s))

    def drag_new(
        self, track: str, from_s: float, to_s: float, within_s: float, *, cutting: bool = False
    ) -> None:
        """Draw a span between two times; ``cutting`` cuts away others there."""
        one_s, other_s = (self._snapped(time_s, within_s) for time_s in (from_s, to_s))
        label, make = self._labels.label, edits.overwrite if cutting else edits.create
        self._drag(lambda labels, base: make(labels, base, track, one_s, other_s, label))

    def end_drag(self) -> None:
        """End the drag, as one step in the history."""
        before, self._before = self._before, None
        if before is not None and self._dragged is not None:
            self._edits.make(self._dragged, before)
        self._dragged = None
        self.changed.emit()

    def cancel_drag(self) -> None:
        """Restore the labels from before the drag."""
        before, self._before, self._dragged = self._before, None, None
        if before is not None:
            self._labels.set_labels(before)
        self.changed.emit()

    def _drag(self, change: Change) -> None:
        assert self._before is not None
        try:
            self._dragged = change(self._before, self._playback.timebase)
        except Sd2Error:
            return
        self._labels.set_labels(self._dragged.labels)

    def _snapped(self, time_s: float, within_s: float, held: Collection[int] = ()) -> float:
        assert self._before is not None
        base = self._playback.timebase
        return snap(self._before, base, time_s, within_s, ignore=held).time_s
