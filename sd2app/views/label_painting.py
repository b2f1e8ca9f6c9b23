"""How spans look: a box on the timeline, a tinted stretch on every map."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QPainter, QPen

from sd2app.models.labels import LabelsModel
from sd2app.palette import Palette
from sd2app.views.time_axis import TimeScale
from sd2core.labels.spans import Span

_TINT, _SELECTED_TINT = 64, 136
_REGION_TINT, _SELECTED_REGION_TINT = 16, 52
"""Faint: a map's colours are read as levels."""
_TEXT_FROM_PX = 26.0
_INSET_PX = 2.0


def paint_span(
    painter: QPainter,
    box: QRectF,
    text: str,
    colour: str,
    palette: Palette,
    *,
    selected: bool = False,
    suggestion: bool = False,
) -> None:
    """One span in its row: tinted, edges in full colour, and what it is called."""
    full = QColor(colour)
    tint = QColor(full)
    tint.setAlpha(_SELECTED_TINT if selected else _TINT)
    if suggestion:
        painter.fillRect(box, QBrush(tint, Qt.BrushStyle.BDiagPattern))
    else:
        painter.fillRect(box, tint)
    if box.width() >= 3.0:
        painter.fillRect(QRectF(box.left(), box.top(), 2.0, box.height()), full)
        painter.fillRect(QRectF(box.right() - 2.0, box.top(), 2.0, box.height()), full)
    if selected:
        painter.setPen(QPen(QColor(palette.text), 1.0))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(box.adjusted(0.5, 0.5, -0.5, -0.5))
    if box.width() >= _TEXT_FROM_PX:
        room = box.adjusted(6.0, 0.0, -4.0, 0.0)
        metrics = painter.fontMetrics()
        shown = metrics.elidedText(text, Qt.TextElideMode.ElideRight, int(room.width()))
        painter.setPen(QColor(palette.text))
        painter.drawText(room, Qt.AlignmentFlag.AlignVCenter, shown)


def span_box(span: Span, row: QRectF, scale: TimeScale) -> QRectF:
    """Where a span stands in its row; the shortest is still seen."""
    left, right = scale.x_of(span.start_s), scale.x_of(span.end_s)
    height = row.height() - 2 * _INSET_PX
    return QRectF(left, row.top() + _INSET_PX, max(right - left, 2.0), height)


def paint_regions(painter: QPainter, plot: QRectF, scale: TimeScale, model: LabelsModel) -> None:
    """The spans as stretches of a map: the edges of all, and the selected ones tinted."""
    painter.save()
    painter.setClipRect(plot)
    for span in model.within(scale.start_s, scale.end_s):
        left, right = scale.x_of(span.start_s), scale.x_of(span.end_s)
        colour = QColor(model.colour_of(span.label))
        tint = QColor(colour)
        tint.setAlpha(_SELECTED_REGION_TINT if model.is_selected(span.id) else _REGION_TINT)
        painter.fillRect(QRectF(left, plot.top(), right - left, plot.height()), tint)
        style = Qt.PenStyle.DashLine if span.origin == "suggestion" else Qt.PenStyle.SolidLine
        painter.setPen(QPen(colour, 1.0, style))
        for x in (left, right):
            painter.drawLine(QPointF(x, plot.top()), QPointF(x, plot.bottom()))
    painter.restore()
