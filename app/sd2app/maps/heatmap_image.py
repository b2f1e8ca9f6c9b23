"""Picture of a Doppler map, the base of the widgets that show it, and the overview of all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QImage, QMouseEvent, QPainter, QPen

from sd2app.maps.difference import DifferenceModel
from sd2app.maps.track_mouse import TimePlot
from sd2app.session.display import HeatmapLevels
from sd2app.session.maps import MapModel, colours_of
from sd2app.session.session import Session
from sd2app.widgets.canvas import (
    AT_RIGHT,
    Overlay,
    clipped,
    faint,
    image_of,
    lookup_table,
    uncertain_table,
)
from sd2app.widgets.time_axis import GUTTER_PX, TimeScale, paint_cursor
from sd2core.figures.colours import rgb

_NOBODY = "no person"


@dataclass(frozen=True, eq=False)
class Columns:
    """Frames of a map that share a pixel column."""

    track: MapModel
    filled: NDArray[np.bool_]  # (columns,): True with a frame
    begin: int  # frames in view, half-open
    end: int
    starts: NDArray[np.int64]  # first frame of every filled column, counted from begin

    @classmethod
    def of(cls, track: MapModel, start_s: float, stop_s: float, columns: int) -> Columns:
        """Columns of the time range in view."""
        assert track.map is not None
        timebase = track.map.timebase
        from_s, to_s = start_s - track.offset_s, stop_s - track.offset_s
        edges_s = from_s + (to_s - from_s) * np.arange(columns + 1) / columns
        # First frame of every column, and one past the last: −1 before the map, the number of
        # frames behind it.
        frames = np.searchsorted(timebase.times_s, edges_s + 1e-9, side="right") - 1
        frames[edges_s >= timebase.end_s] = len(timebase)
        first = frames[:-1]
        filled = (first >= 0) & (first < len(timebase))
        left_s = from_s + (stop_s - start_s) * np.arange(columns) / columns
        # Of a column that a gap ends in, the frames after it are shown.
        later = frames[1:] > first + 1
        filled[filled] = later[filled] | (
            left_s[filled] - timebase.times_s[first[filled]] < timebase.longest_s
        )
        if not filled.any():
            return cls(track, filled, 0, 0, np.zeros(0, np.int64))
        begin, end = int(first[filled][0]), int(frames[1:][filled][-1])
        end = min(max(end, int(first[filled][-1]) + 1), len(timebase))
        return cls(track, filled, begin, end, first[filled] - begin)

    def shown(self) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """Values of every column (bins, columns), and which columns have computed ones.

        Where several frames share a column the strongest value is shown, so that a
        short gesture does not vanish when zoomed out.
        """
        covered, filled = self.track.covered, self.filled.copy()
        if covered is not None:
            filled[filled] = covered[self.starts + self.begin]
        values = self._strongest(self.track.values[:, self.begin : self.end])
        values[:, ~filled] = 0.0  # what is not computed yet is no number
        return values, filled

    def by_part(self) -> dict[str, NDArray[np.float32]]:
        """Values of every column, (bins, columns), of each part of the body that is shown."""
        return {
            part: self._strongest(values[:, self.begin : self.end])
            for part, values in self.track.split.items()
        }

    def uncertain(self, levels: HeatmapLevels) -> NDArray[np.bool_] | None:
        """Mask of uncertain cells, bool (bins, columns); None where that is not known.

        Of several frames that share a column the one that is shown decides.
        """
        uncertain = self.track.uncertain(levels, self.begin, self.end)
        if uncertain is None:
            return None
        values = self.track.values[:, self.begin : self.end]
        known = self._strongest(np.where(uncertain, np.float32(-1.0), values))
        unknown = self._strongest(np.where(uncertain, values, np.float32(-1.0)))
        return self.filled & (unknown >= np.maximum(known, 0.0))

    def _strongest(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """The largest of every column's frames, (bins, columns), of (bins, end - begin)."""
        strongest = np.zeros((len(values), len(self.filled)), np.float32)
        if values.shape[1] > self.starts.size:
            strongest[:, self.filled] = np.maximum.reduceat(values, self.starts, axis=1)
        else:
            strongest[:, self.filled] = values[:, self.starts]
        return strongest


def heatmap_image(
    track: MapModel,
    levels: HeatmapLevels,
    start_s: float,
    stop_s: float,
    columns: int,
    background: int,
) -> QImage:
    """One pixel per column and bin, fastest approach on top; uncertain cells without colour."""
    view = Columns.of(track, start_s, stop_s, columns)
    values, filled = view.shown()
    shade, table = track.shade(values, levels), lookup_table(levels.colour_map)
    numbers = (shade * 255.0).astype(np.uint8)
    parts = view.by_part()
    colours = _mixed(parts, shade, int(table[0])) if len(parts) > 1 else table[numbers]
    uncertain = view.uncertain(levels)
    if uncertain is not None:
        colours = np.where(uncertain, uncertain_table(levels.colour_map)[numbers], colours)
    colours[:, ~filled] = background
    return image_of(colours[::-1], QImage.Format.Format_RGB32)


def _mixed(
    parts: Mapping[str, NDArray[np.float32]], shade: NDArray[np.float32], nothing: int
) -> NDArray[np.uint32]:
    """Colours (bins, columns) of parts, mixed by their shares, as bright as all are together."""
    values = np.stack([*parts.values()])  # (parts, bins, columns)
    share = values / np.maximum(values.sum(axis=0), np.finfo(np.float32).tiny)
    own = np.stack([rgb(colour) for colour in colours_of(parts).values()]).astype(np.float32)
    ground = np.array([nothing >> 16 & 255, nothing >> 8 & 255, nothing & 255], np.float32)
    mix = np.tensordot(share, own, (0, 0))  # (bins, columns, 3)
    shaded = ground + shade[..., None] * (mix - ground)
    red, green, blue = np.moveaxis(shaded, 2, 0).astype(np.uint32)
    return np.uint32(255 << 24) | red << 16 | green << 8 | blue


def difference_image(
    difference: DifferenceModel,
    levels: HeatmapLevels,
    start_s: float,
    stop_s: float,
    columns: int,
    table: NDArray[np.uint32],
    background: int,
) -> QImage:
    """The difference of what is shown of two maps, in signed colours (255,), zero in the middle.

    Where several frames share a column, of the strongest of each, as the maps show them.
    """
    (denoised, has_denoised), (real, has_real) = (
        Columns.of(track, start_s, stop_s, columns).shown()
        for track in (difference.denoised, difference.real)
    )
    shades = difference.shades(denoised, real, levels)
    colours = table[127 + np.rint(127.0 * shades).astype(np.int16)]
    colours[:, ~(has_denoised & has_real)] = background
    return image_of(colours[::-1], QImage.Format.Format_RGB32)


class MapWidget(TimePlot):
    """Shows a map, whose picture is kept until map, stretch, levels, theme or size change."""

    BOTTOM_PX = 4

    def __init__(self, track: MapModel, session: Session, overlays: Sequence[Overlay] = ()) -> None:
        super().__init__(session, overlays)
        self.track = track  # the map that is shown
        self.setMouseTracking(True)
        for signal in (track.changed, self._display.levels_changed):
            signal.connect(self.redraw)

    def paint_map(self, painter: QPainter, plot: QRectF, start_s: float, end_s: float) -> None:
        """The map from ``start_s`` to ``end_s``, one column per device pixel."""
        columns = max(round(plot.width() * self.devicePixelRatioF()), 1)
        painter.drawImage(plot, self.make_image(start_s, end_s, columns))

    def make_image(self, start_s: float, end_s: float, columns: int) -> QImage:
        """Image of the time window, one pixel per column and bin."""
        background = QColor(self._display.palette.well).rgb()
        return heatmap_image(self.track, self._display.levels, start_s, end_s, columns, background)

    def paint_gaps(self, painter: QPainter, plot: QRectF, scale: TimeScale) -> None:
        """Hatch the frames without a person."""
        colours = self._display.palette
        with clipped(painter, plot):
            for start_s, end_s in self.track.gaps_s:
                left, right = scale.x_of(start_s), scale.x_of(end_s)
                # The narrowest is still seen.
                box = QRectF(left, plot.top(), max(right - left, 1.0), plot.height())
                if not box.intersects(plot):
                    continue
                painter.fillRect(box, QColor(colours.well))
                painter.fillRect(box, QBrush(QColor(colours.hatch), Qt.BrushStyle.FDiagPattern))
                self._name_gap(painter, box & plot)

    def _name_gap(self, painter: QPainter, box: QRectF) -> None:
        size = painter.fontMetrics().size(Qt.TextFlag.TextSingleLine, _NOBODY)
        if box.width() < size.width() + 24 or box.height() < 2 * size.height():
            return
        label = QRectF(0, 0, size.width() + 12, size.height() + 6)
        label.moveCenter(box.center())
        painter.fillRect(label, QColor(self._display.palette.well))
        painter.setPen(QColor(self._display.palette.muted))
        painter.drawText(label, Qt.AlignmentFlag.AlignCenter, _NOBODY)


_EDGE_PX = 6
_LABELS_PX = 4.0


class Overview(MapWidget):
    """The whole recording; drag the frame to pan, its edges to zoom."""

    TOP_PX = 2

    def __init__(self, session: Session, overlays: Sequence[Overlay] = ()) -> None:
        super().__init__(session.maps.synthetic, session, overlays)
        self.setFixedHeight(20)
        self._span.changed.connect(self.redraw)

    def set_track(self, track: MapModel) -> None:
        """Show another track."""
        self.track.changed.disconnect(self.redraw)
        self.track = track
        track.changed.connect(self.redraw)
        self.redraw()

    @property
    def scale(self) -> TimeScale:
        """Time axis of this widget: always everything."""
        return TimeScale(*self._span.extent_s, self.width())

    def paint(self, painter: QPainter) -> None:
        """Small map, spans, frame around the time window, cursor."""
        colours, scale, plot = self._display.palette, self.scale, self.plot_rect()
        self.paint_kept(painter, self._paint_all)
        strip = QRectF(plot.left(), plot.top(), plot.width(), _LABELS_PX)
        for overlay in self._overlays:
            overlay.paint(painter, strip, scale)
        left, right = scale.x_of(self._span.start_s), scale.x_of(self._span.end_s)
        veil = faint(colours.panel, 150)
        painter.fillRect(QRectF(plot.left(), plot.top(), left - plot.left(), plot.height()), veil)
        painter.fillRect(QRectF(right, plot.top(), plot.right() - right, plot.height()), veil)
        painter.setPen(QPen(QColor(colours.accent), 2))
        painter.drawRoundedRect(
            QRectF(left, plot.top(), right - left, plot.height()).adjusted(0, 1, 0, -1), 2, 2
        )
        paint_cursor(painter, plot, scale.x_of(self._playback.time_s))

    def _paint_all(self, painter: QPainter) -> None:
        """Paint the parts that do not move."""
        colours, plot = self._display.palette, self.plot_rect()
        painter.fillRect(self.rect(), QColor(colours.panel))
        painter.setPen(QColor(colours.muted))
        painter.drawText(QRectF(0, plot.top(), GUTTER_PX - 8, plot.height()), AT_RIGHT, "All")
        if self.track.map is not None:
            self.paint_map(painter, plot, *self._span.extent_s)
            self.paint_gaps(painter, plot, self.scale)

    def _handle_at(self, x: float) -> str:
        scale = self.scale
        left, right = scale.x_of(self._span.start_s), scale.x_of(self._span.end_s)
        if abs(x - left) <= _EDGE_PX:
            return "left"
        if abs(x - right) <= _EDGE_PX:
            return "right"
        return "pan" if left < x < right else "centre"

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Start to drag the frame or an edge; elsewhere seek."""
        if event.button() != Qt.MouseButton.LeftButton:
            return
        x = event.position().x()
        handle = self._handle_at(x)
        if handle == "centre":
            middle = 0.5 * (self._span.start_s + self._span.end_s)
            self._span.pan(self.scale.time_of(x) - middle)
            handle = "pan"
        if handle == "pan" and self._span.duration_s >= (
            self._span.extent_s[1] - self._span.extent_s[0]
        ):
            handle = "seek"
            self._playback.seek(self.scale.time_of(x))
        self._grab = (handle, x)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag the frame or the edge."""
        x = event.position().x()
        if self._grab is None or not event.buttons():
            edge = self._handle_at(x) in ("left", "right")
            self.setCursor(
                Qt.CursorShape.SizeHorCursor if edge else Qt.CursorShape.PointingHandCursor
            )
            return
        handle, last_x = self._grab
        time_s = self.scale.time_of(x)
        if handle == "seek":
            self._playback.seek(time_s)
        elif handle == "pan":
            self._span.pan((x - last_x) * self.scale.seconds_per_px)
        elif handle == "left":
            self._span.set_span(min(time_s, self._span.end_s - 0.2), self._span.end_s)
        else:
            self._span.set_span(self._span.start_s, max(time_s, self._span.start_s + 0.2))
        self._grab = (handle, x)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let go."""
        self._grab = None
