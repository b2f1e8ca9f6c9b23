"""Tracks of spans as they are drawn: rows, lanes, boxes, tints of maps, buttons on spans."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QAction, QBrush, QColor, QImage, QKeySequence, QPainter, QPen

from sd2app.labels.model import LabelsModel, Mark, SpanArrays
from sd2app.maps.arrangement import BELOW_PX
from sd2app.palette import Palette
from sd2app.widgets.canvas import AT_RIGHT, Overlay, clipped, faint, image_of
from sd2app.widgets.time_axis import GUTTER_PX, TimeScale
from sd2core.labels.spans import LabelTrack, Span

ROW_PX = 24.0
"""Height of a track whose spans do not overlap."""
_LANE_PX, _HIGHEST_PX = 17.0, 72.0
_GAP_PX = 1.0
_TINT, _SELECTED_TINT = 64, 96
_OPAQUE = 255
_REGION_TINT = 140
_WIDE_PX = 4.0
"""Smallest width of a span with a box of its own."""
_EDGES_FROM_PX = 12.0
"""On a map, which lines closer than that would hide."""
_TEXT_FROM_PX = 26.0
_INSET_PX = 1.0
_CHOSEN_PX = 3.0
_SMALL = 0.82
"""Share of the font size for names that would not fit otherwise."""


@dataclass(frozen=True)
class TrackRow:
    """Row of one track; its lanes share the height."""

    name: str
    top_px: float
    height_px: float
    lanes: int

    def lane_px(self, lane: int) -> tuple[float, float]:
        """Return top and height of a lane."""
        height_px = (self.height_px - 2 * _GAP_PX) / self.lanes
        return self.top_px + _GAP_PX + lane * height_px, height_px

    def lane_at(self, y_px: float) -> int:
        """Return the lane at a height."""
        lane = int((y_px - self.top_px - _GAP_PX) * self.lanes / (self.height_px - 2 * _GAP_PX))
        return min(max(lane, 0), self.lanes - 1)


@dataclass(frozen=True)
class LabelRows:
    """Rows of all tracks, from top to bottom, and the lane of each mark."""

    tracks: tuple[TrackRow, ...]
    mark_lanes: tuple[int, ...]

    @classmethod
    def of(
        cls, tracks: Sequence[LabelTrack], arrays: SpanArrays, marks: Sequence[Mark]
    ) -> LabelRows:
        """Lay out tracks, each as high as its lanes need, up to a limit."""
        counts = list(arrays.lanes_of_track)
        numbers = {track.name: number for number, track in enumerate(tracks)}
        mark_lanes: list[int] = []
        taken: set[tuple[int, int]] = set()
        for mark in marks:
            number = numbers[mark.track]
            lane = 0
            if tracks[number].overlap == "free":
                later = (arrays.tracks == number) & (arrays.ends_s > mark.start_s)
                busy = {*arrays.lanes[later].tolist()}
                while lane in busy or (number, lane) in taken:
                    lane += 1
            taken.add((number, lane))
            counts[number] = max(counts[number], lane + 1)
            mark_lanes.append(lane)
        rows, top_px = [], 0.0
        for track, lanes in zip(tracks, counts, strict=True):
            height_px = ROW_PX if lanes == 1 else min(lanes * _LANE_PX, _HIGHEST_PX)
            rows.append(TrackRow(track.name, top_px, height_px, lanes))
            top_px += height_px
        return cls(tuple(rows), tuple(mark_lanes))

    @property
    def height_px(self) -> float:
        """Height of all tracks, of one at least."""
        last = self.tracks[-1] if self.tracks else TrackRow("", 0.0, ROW_PX, 1)
        return last.top_px + last.height_px

    def row_at(self, y_px: float) -> TrackRow | None:
        """Return the row at a height."""
        rows = (row for row in self.tracks if row.top_px <= y_px < row.top_px + row.height_px)
        return next(rows, None)

    def row_of(self, track: str) -> TrackRow:
        """Return the row of a track; it must exist."""
        return next(row for row in self.tracks if row.name == track)


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
    full, tint = QColor(colour), faint(colour, _SELECTED_TINT if selected else _TINT)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    if suggestion:
        painter.fillRect(box, QBrush(tint, Qt.BrushStyle.BDiagPattern))
        painter.setPen(QPen(full, 1.0, Qt.PenStyle.DashLine))
        painter.drawRect(box.adjusted(0.5, 0.5, -0.5, -0.5))
    else:
        painter.fillRect(box, tint)
        painter.fillRect(QRectF(box.left(), box.top(), 2.0, box.height()), full)
        painter.fillRect(QRectF(box.right() - 2.0, box.top(), 2.0, box.height()), full)
    if selected:
        painter.setPen(QPen(QColor(palette.text), 1.0))
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


def paint_tracks(
    painter: QPainter,
    plot: QRectF,
    scale: TimeScale,
    model: LabelsModel,
    rows: Sequence[TrackRow],
    palette: Palette,
    *,
    foreign: str = "",
) -> None:
    """Paint the rows of tracks with their names, and all spans in view.

    Rows of a ``foreign`` person are hatched, and a single one has the name of that person.
    """
    _paint_names(painter, model, rows, palette, foreign)
    for row in rows:
        well = QRectF(plot.left(), row.top_px + 1, plot.width(), row.height_px - 2)
        painter.fillRect(well, QColor(palette.well))
        if foreign:
            painter.fillRect(well, QBrush(QColor(palette.border), Qt.BrushStyle.FDiagPattern))
    with clipped(painter, plot):
        _paint_spans(painter, plot, scale, model, rows, palette)


def _paint_names(
    painter: QPainter, model: LabelsModel, rows: Sequence[TrackRow], palette: Palette, foreign: str
) -> None:
    room_px = GUTTER_PX - 11
    names = [foreign] if foreign and len(rows) == 1 else [row.name for row in rows]
    painter.save()
    if any(painter.fontMetrics().horizontalAdvance(name) > room_px for name in names):
        font = painter.font()
        font.setPixelSize(round(_SMALL * painter.fontInfo().pixelSize()))
        painter.setFont(font)
    metrics = painter.fontMetrics()
    for name, row in zip(names, rows, strict=True):
        chosen = not foreign and name == model.track and len(rows) > 1
        painter.setPen(QColor(palette.accent if chosen else palette.muted))
        if chosen:
            bar = QRectF(0, row.top_px + 3, _CHOSEN_PX, row.height_px - 6)
            painter.fillRect(bar, QColor(palette.accent))
        room = QRectF(5, row.top_px, room_px, row.height_px)
        whole = metrics.horizontalAdvance(name) <= room_px
        wrapped = metrics.boundingRect(room.toRect(), Qt.TextFlag.TextWordWrap, name)
        if not whole and room.height() >= wrapped.height() and room_px >= wrapped.width():
            painter.drawText(room, AT_RIGHT | Qt.TextFlag.TextWordWrap, name)
        else:  # names of tracks differ at either end
            shown = metrics.elidedText(name, Qt.TextElideMode.ElideMiddle, room_px)
            painter.drawText(room, AT_RIGHT, shown)
    painter.restore()


def _paint_spans(
    painter: QPainter,
    plot: QRectF,
    scale: TimeScale,
    model: LabelsModel,
    rows: Sequence[TrackRow],
    palette: Palette,
) -> None:
    arrays = model.arrays
    numbers, lefts, rights = _in_view(scale, arrays)
    wide = rights - lefts >= _WIDE_PX
    narrow, lines = numbers[~wide], arrays.rows[numbers[~wide]]
    chosen = _selected(model, narrow)
    image = _lines(painter, plot, scale, arrays, narrow, _colours(arrays, narrow, _OPAQUE), lines)
    # A line per lane that marks selected spans.
    text = np.full(int(chosen.sum()), QColor(palette.text).rgb(), np.uint32)
    marked = _lines(painter, plot, scale, arrays, narrow[chosen], text, lines[chosen])
    line = 0
    for row, lanes in zip(rows, arrays.lanes_of_track, strict=True):
        for lane in range(lanes):
            box = lane_box(row, lane, plot.left(), plot.right())
            part = QRectF(0, line, image.width(), 1)
            painter.drawImage(box, image, part)
            for edge in (box.top(), box.bottom() - 1.5):
                painter.drawImage(QRectF(box.left(), edge, box.width(), 1.5), marked, part)
            line += 1
    ends_px = zip(numbers[wide].tolist(), lefts[wide].tolist(), rights[wide].tolist(), strict=True)
    for number, left, right in ends_px:
        span = arrays.spans[number]
        row = rows[arrays.tracks[number]]
        paint_span(
            painter,
            lane_box(row, int(arrays.lanes[number]), left, right),
            text_on(span, arrays),
            arrays.colours[arrays.tones[number]],
            palette,
            selected=span.id in model.selected_ids,
            suggestion=span.origin == "suggestion",
        )


def _in_view(
    scale: TimeScale, arrays: SpanArrays
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Numbers, lefts and rights of the spans in view."""
    numbers = arrays.within(scale.start_s, scale.end_s)
    return numbers, scale.xs_of(arrays.starts_s[numbers]), scale.xs_of(arrays.ends_s[numbers])


def _selected(model: LabelsModel, numbers: NDArray[np.int64]) -> NDArray[np.bool_]:
    return np.isin(model.arrays.ids[numbers], list(model.selected_ids))


def _colours(
    arrays: SpanArrays, numbers: NDArray[np.int64], alphas: int | NDArray[np.int64]
) -> NDArray[np.uint32]:
    table = np.array([QColor(colour).rgb() & 0xFFFFFF for colour in arrays.colours], np.uint32)
    return table[arrays.tones[numbers]] | (np.uint32(alphas) << np.uint32(24))


def _lines(
    painter: QPainter,
    plot: QRectF,
    scale: TimeScale,
    arrays: SpanArrays,
    numbers: NDArray[np.int64],
    colours: NDArray[np.uint32],
    lines: NDArray[np.int64] | None = None,
) -> QImage:
    """Line of device pixels, or one per lane; each span has one of its colour at least."""
    columns = max(round(plot.width() * painter.device().devicePixelRatioF()), 1)
    per_s = columns / (scale.end_s - scale.start_s)
    starts, ends = (one[numbers] - scale.start_s for one in (arrays.starts_s, arrays.ends_s))
    firsts = np.clip(np.floor(per_s * starts), 0, columns - 1).astype(np.int64)
    counts = np.maximum(np.clip(np.ceil(per_s * ends), 0, columns).astype(np.int64) - firsts, 1)
    # Of each span one pixel after the other.
    offsets = firsts - (np.cumsum(counts) - counts) + (0 if lines is None else columns * lines)
    image = np.zeros((1 if lines is None else sum(arrays.lanes_of_track), columns), np.uint32)
    image.ravel()[np.repeat(offsets, counts) + np.arange(counts.sum())] = np.repeat(colours, counts)
    return image_of(image)


def text_on(span: Span, arrays: SpanArrays) -> str:
    """Label and person of a span, after a suggestion's confidence, or an unnamed one's rank."""
    if rank := arrays.ranks.get(span.id):
        return f"#{rank} {span.label}"
    if span.origin == "suggestion" and span.confidence is not None:
        return f"{100 * span.confidence:.0f} % {span.label}"
    return f"{span.label} · {span.person}" if span.person else span.label


def map_overlay(model: LabelsModel) -> Overlay:
    """Make the overlay of spans on a map: a line below it, and edges where they are wide.

    The map itself keeps its colours, which are its values.
    """

    def paint(painter: QPainter, plot: QRectF, scale: TimeScale) -> None:
        arrays = model.arrays
        numbers, lefts, rights = _in_view(scale, arrays)
        tints = np.where(_selected(model, numbers), _OPAQUE, _REGION_TINT)
        below = QRectF(plot.left(), plot.bottom() + 1.0, plot.width(), BELOW_PX - 1.0)
        colours = _colours(arrays, numbers, tints)
        painter.drawImage(below, _lines(painter, plot, scale, arrays, numbers, colours))
        with clipped(painter, plot):
            edges: dict[tuple[int, bool], list[QLineF]] = {}
            wide = rights - lefts >= _EDGES_FROM_PX
            for number, left, right in zip(numbers[wide], lefts[wide], rights[wide], strict=True):
                span, tone = arrays.spans[number], int(arrays.tones[number])
                lines = edges.setdefault((tone, span.origin == "suggestion"), [])
                lines.append(QLineF(left, plot.top(), left, plot.bottom()))
                lines.append(QLineF(right, plot.top(), right, plot.bottom()))
            for (tone, suggested), lines in edges.items():
                style = Qt.PenStyle.DashLine if suggested else Qt.PenStyle.SolidLine
                painter.setPen(QPen(QColor(arrays.colours[tone]), 1.0, style))
                painter.drawLines(lines)

    def legend(start_s: float, end_s: float) -> dict[str, str]:
        colour_of = model.labels.label_set.colour_of
        return {span.label: colour_of(span.label) for span in model.within(start_s, end_s)}

    return Overlay(paint, (model.changed, model.selection_changed), legend)


def strip_overlay(model: LabelsModel) -> Overlay:
    """Make the overlay of the spans of all tracks as one line."""

    def paint(painter: QPainter, strip: QRectF, scale: TimeScale) -> None:
        arrays, numbers = model.arrays, model.arrays.within(scale.start_s, scale.end_s)
        colours = _colours(arrays, numbers, _OPAQUE)
        painter.drawImage(strip, _lines(painter, strip, scale, arrays, numbers, colours))

    return Overlay(paint, (model.changed,))


_WIDTHS_PX, _HEIGHT_PX, _BETWEEN_PX = (30.0, 17.0), 17.0, 2.0
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
            step_px = width_px + _BETWEEN_PX
            corner = self._corner(scale, plot, rows, len(shown) * step_px - _BETWEEN_PX)
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
