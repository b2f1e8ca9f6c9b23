"""Painting of spans: boxes on the timeline, tinted parts of maps; narrow ones together."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QImage, QPainter, QPen

from sd2app.labels.arrays import WIDE_PX, SpanColumns
from sd2app.labels.model import LabelsModel
from sd2app.labels.rows import TrackRow
from sd2app.palette import Palette
from sd2app.widgets.time_axis import TimeScale
from sd2app.widgets.time_plot import Overlay
from sd2core.labels.spans import Span

_TINT, _SELECTED_TINT = 64, 136
_NARROW_TINTS = 90, 255
"""Opacities of columns that narrow spans cover hardly and wholly."""
_REGION_TINT, _SELECTED_REGION_TINT = 18, 54
"""Faint: a map's colours are read as levels."""
_EDGES_FROM_PX = 12.0
"""On a map, which lines closer than that would hide."""
_OVERVIEW_TINTS = 130, 255
_TEXT_FROM_PX = 26.0
_INSET_PX = 1.0


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
    """Paint one span in its row: tint, edges in full colour, and label."""
    full = QColor(colour)
    tint = QColor(full)
    tint.setAlpha(_SELECTED_TINT if selected else _TINT)
    if suggestion:
        painter.fillRect(box, QBrush(tint, Qt.BrushStyle.BDiagPattern))
        painter.setPen(QPen(full, 1.0, Qt.PenStyle.DashLine))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(box.adjusted(0.5, 0.5, -0.5, -0.5))
    else:
        painter.fillRect(box, tint)
    if not suggestion:
        painter.fillRect(QRectF(box.left(), box.top(), 2.0, box.height()), full)
        painter.fillRect(QRectF(box.right() - 2.0, box.top(), 2.0, box.height()), full)
    if selected:
        painter.setPen(QPen(QColor(palette.text), 1.0))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(box.adjusted(0.5, 0.5, -0.5, -0.5))
    if box.width() >= _TEXT_FROM_PX:
        room = box.adjusted(6.0, 0.0, -4.0, 0.0)
        metrics = painter.fontMetrics()
        # Half a line is no text.
        if room.height() >= metrics.ascent():
            shown = metrics.elidedText(text, Qt.TextElideMode.ElideRight, int(room.width()))
            if shown != "…":
                painter.setPen(QColor(palette.text))
                painter.drawText(room, Qt.AlignmentFlag.AlignVCenter, shown)


def lane_box(row: TrackRow, lane: int, left: float, right: float) -> QRectF:
    """Return the box of a span in its lane, wide enough to be seen."""
    top, height = row.lane_px(lane)
    inset = _INSET_PX if height > 8 * _INSET_PX else 0.0
    return QRectF(left, top + inset, max(right - left, 2.0), height - 2 * inset)


def paint_spans(
    painter: QPainter,
    plot: QRectF,
    scale: TimeScale,
    model: LabelsModel,
    rows: tuple[TrackRow, ...],
    palette: Palette,
) -> None:
    """Paint all spans in view, each in its lane."""
    columns = columns_in(painter, plot, scale, model)
    arrays = model.arrays
    image = _tinted(columns, arrays.colours, _NARROW_TINTS)
    marked = _marked(columns, palette)
    line = 0
    for row, lanes in zip(rows, arrays.lanes_of_track, strict=True):
        for lane in range(lanes):
            if columns.share[line].any():
                box = lane_box(row, lane, plot.left(), plot.right())
                painter.drawImage(box, image, QRectF(0, line, image.width(), 1))
                for edge in (box.top(), box.bottom() - 1.5):
                    target = QRectF(box.left(), edge, box.width(), 1.5)
                    painter.drawImage(target, marked, QRectF(0, line, marked.width(), 1))
            line += 1
    for number in columns.wide.tolist():
        span = arrays.spans[number]
        row = rows[arrays.tracks[number]]
        left, right = scale.x_of(span.start_s), scale.x_of(span.end_s)
        paint_span(
            painter,
            lane_box(row, int(arrays.lanes[number]), left, right),
            _text(span),
            arrays.colours[arrays.tones[number]],
            palette,
            selected=model.is_selected(span.id),
            suggestion=span.origin == "suggestion",
        )


def _text(span: Span) -> str:
    """Label of a span, after the confidence of a suggestion."""
    if span.origin == "suggestion" and span.confidence is not None:
        return f"{100 * span.confidence:.0f} % {span.label}"
    return span.label


def map_overlay(model: LabelsModel) -> Overlay:
    """Make the overlay of spans on a map."""

    def paint(painter: QPainter, plot: QRectF, scale: TimeScale) -> None:
        paint_regions(painter, plot, scale, model)

    return Overlay(paint, (model.changed, model.selection_changed))


def strip_overlay(model: LabelsModel) -> Overlay:
    """Make the overlay of the spans of all tracks as one line."""

    def paint(painter: QPainter, strip: QRectF, scale: TimeScale) -> None:
        paint_strip(painter, strip, scale, model)

    return Overlay(paint, (model.changed,))


def paint_regions(painter: QPainter, plot: QRectF, scale: TimeScale, model: LabelsModel) -> None:
    """Paint spans on a map: tinted, selected ones more, with edges where wide."""
    columns = columns_in(painter, plot, scale, model, together=True, wide_px=math.inf)
    arrays = model.arrays
    tints = np.where(columns.selected, _SELECTED_REGION_TINT, _REGION_TINT) * columns.share
    painter.save()
    painter.setClipRect(plot)
    painter.drawImage(plot, _coloured(columns, arrays.colours, tints))
    edges: dict[tuple[int, bool], list[QLineF]] = {}
    for number in columns_in(painter, plot, scale, model).wide.tolist():
        span, tone = arrays.spans[number], int(arrays.tones[number])
        left, right = scale.x_of(span.start_s), scale.x_of(span.end_s)
        if right - left >= _EDGES_FROM_PX:
            lines = edges.setdefault((tone, span.origin == "suggestion"), [])
            lines += [QLineF(x, plot.top(), x, plot.bottom()) for x in (left, right)]
    for (tone, suggested), lines in edges.items():
        style = Qt.PenStyle.DashLine if suggested else Qt.PenStyle.SolidLine
        painter.setPen(QPen(QColor(arrays.colours[tone]), 1.0, style))
        painter.drawLines(lines)
    painter.restore()


def paint_strip(painter: QPainter, strip: QRectF, scale: TimeScale, model: LabelsModel) -> None:
    """Paint all spans of all tracks in one line."""
    columns = columns_in(painter, strip, scale, model, together=True, wide_px=math.inf)
    painter.drawImage(strip, _tinted(columns, model.arrays.colours, _OVERVIEW_TINTS))


def columns_in(
    painter: QPainter,
    plot: QRectF,
    scale: TimeScale,
    model: LabelsModel,
    *,
    together: bool = False,
    wide_px: float = WIDE_PX,
) -> SpanColumns:
    """Compute the spans in view, one column per device pixel."""
    ratio = painter.device().devicePixelRatioF()
    count = max(round(plot.width() * ratio), 1)
    return model.columns(scale.start_s, scale.end_s, count, wide_px * ratio, together=together)


def _tinted(columns: SpanColumns, colours: tuple[str, ...], tints: tuple[int, int]) -> QImage:
    """A line per lane in the colour that covers most, more opaque the more is covered."""
    low, high = tints
    alphas = np.where(columns.share > 0, low + (high - low) * columns.share, 0)
    return _coloured(columns, colours, alphas)


def _coloured(
    columns: SpanColumns, colours: tuple[str, ...], alphas: NDArray[np.floating]
) -> QImage:
    table = np.array([QColor(colour).rgb() & 0xFFFFFF for colour in colours], np.uint32)
    return _image(table[columns.tone] | (alphas.astype(np.uint32) << np.uint32(24)))


def _marked(columns: SpanColumns, palette: Palette) -> QImage:
    """A line per lane that marks selected spans."""
    return _image(np.where(columns.selected, QColor(palette.text).rgb(), 0).astype(np.uint32))


def _image(pixels: NDArray[np.uint32]) -> QImage:
    height, width = pixels.shape
    pixels = np.ascontiguousarray(pixels)
    made = QImage(pixels.data, width, height, 4 * width, QImage.Format.Format_ARGB32)
    return made.copy()
