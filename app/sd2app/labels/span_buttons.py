"""Buttons on the selected suggestion of the timeline, which accept or reject it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QAction, QColor, QKeySequence, QPainter, QPen

from sd2app.labels.model import LabelsModel
from sd2app.labels.painting import LabelRows, lane_box
from sd2app.palette import Palette
from sd2app.widgets.time_axis import TimeScale

_WIDTHS_PX, _HEIGHT_PX, _GAP_PX = (30.0, 17.0), 17.0, 2.0
"""Of a button: with its key and, where there is no room for that, with its sign alone."""
_CLEAR_PX = 7.0
"""Distance from the edges of the span, which can be dragged."""
_TEXT_PX = 48.0
"""Width that is left to the label of a span where the buttons are on it."""


class SpanButtons:
    """Places, looks and hits of the buttons; nowhere while not just one suggestion is selected.

    Each has a sign, and what it does.
    They stand on the suggestion, or beside it where that is short, and never on another span.
    """

    def __init__(self, labels: LabelsModel, decisions: Sequence[tuple[str, QAction]]) -> None:
        self._labels, self._decisions = labels, decisions

    def placed(
        self, scale: TimeScale, plot: QRectF, rows: LabelRows
    ) -> Iterator[tuple[QRectF, str, QAction]]:
        """Yield places of the buttons with what is on them and what they do."""
        shown = [one for one in self._decisions if one[1].isEnabled()]
        for width_px in _WIDTHS_PX if shown else ():
            step_px = width_px + _GAP_PX
            corner = self._corner(scale, plot, rows, len(shown) * step_px - _GAP_PX)
            if corner is not None:
                for place, one in enumerate(shown):
                    left_px = corner.left() + place * step_px
                    yield QRectF(left_px, corner.top(), width_px, corner.height()), *one
                return

    def _corner(
        self, scale: TimeScale, plot: QRectF, rows: LabelRows, width_px: float
    ) -> QRectF | None:
        """Left of the first button, with the height of all."""
        labels, arrays = self._labels, self._labels.arrays
        chosen = labels.selected
        if len(chosen) != 1 or chosen[0].origin != "suggestion":
            return None
        (span,), (row,) = chosen, arrays.rows_of(labels.selected_ids)
        same_lane = arrays.rows == arrays.rows[row]
        before = arrays.ends_s[same_lane & (arrays.ends_s <= span.start_s)]
        after = arrays.starts_s[same_lane & (arrays.starts_s >= span.end_s)]
        left_px, right_px = scale.x_of(span.start_s), scale.x_of(span.end_s)
        from_px = max(scale.x_of(float(before.max())) if len(before) else plot.left(), plot.left())
        to_px = min(scale.x_of(float(after.min())) if len(after) else plot.right(), plot.right())
        seen_left_px, seen_right_px = max(left_px, plot.left()), min(right_px, plot.right())
        seen_px = seen_right_px - seen_left_px - 2 * _CLEAR_PX
        if seen_px < -2 * _CLEAR_PX:
            return None
        on_px = seen_right_px - _CLEAR_PX - width_px
        beside_px = right_px + _CLEAR_PX
        ahead_px = left_px - _CLEAR_PX - width_px
        if seen_px >= width_px + _TEXT_PX:
            x_px = on_px
        elif beside_px >= plot.left() and beside_px + width_px <= to_px:
            x_px = beside_px
        elif ahead_px >= from_px:
            x_px = ahead_px
        elif seen_px >= width_px:
            x_px = on_px
        else:
            return None
        box = lane_box(rows.row_of(span.track), int(arrays.lanes[row]), left_px, right_px)
        height_px = min(_HEIGHT_PX, box.height())
        return QRectF(x_px, box.center().y() - height_px / 2, 0.0, height_px)

    def paint(
        self, painter: QPainter, scale: TimeScale, plot: QRectF, rows: LabelRows, palette: Palette
    ) -> None:
        """Paint the buttons: sign and key."""
        for place, sign, action in self.placed(scale, plot, rows):
            painter.setPen(QPen(QColor(palette.accent), 1.0))
            painter.setBrush(QColor(palette.panel))
            painter.drawRoundedRect(place.adjusted(0.5, 0.5, -0.5, -0.5), 3.0, 3.0)
            painter.setPen(QColor(palette.text))
            key = action.shortcut().toString(QKeySequence.SequenceFormat.NativeText)
            roomy = len(key) == 1 and place.width() == max(_WIDTHS_PX)
            text = f"{sign} {key}" if roomy else sign
            painter.drawText(place, Qt.AlignmentFlag.AlignCenter, text)

    def at(self, place: QPointF, scale: TimeScale, plot: QRectF, rows: LabelRows) -> QAction | None:
        """Return what the button at a place does."""
        placed = self.placed(scale, plot, rows)
        return next((action for box, _, action in placed if box.contains(place)), None)
