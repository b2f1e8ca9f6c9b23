"""Picture of a Doppler map: its pixels, and the base of the widgets that show it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QImage, QPainter, QResizeEvent

from sd2app.maps.difference import DifferenceModel
from sd2app.maps.track_mouse import SessionPlot
from sd2app.session.display import HeatmapLevels
from sd2app.session.maps import MapModel
from sd2app.session.session import Session
from sd2app.widgets.canvas import Overlay, clipped, image_of
from sd2app.widgets.colour_maps import lookup_table, uncertain_table
from sd2app.widgets.time_axis import TimeScale

_NOBODY = "no person"


def column_frames(
    times_s: NDArray[np.float64], end_s: float, start_s: float, stop_s: float, columns: int
) -> NDArray[np.int64]:
    """First frame on screen in every pixel column, and one past the last, (columns + 1,).

    A column shows frames ``[edges[k], max(edges[k] + 1, edges[k + 1]))``. Minus
    one marks columns before the first frame, ``len(times_s)`` those past the end.
    """
    edges_s = start_s + (stop_s - start_s) * np.arange(columns + 1) / columns
    frames = np.searchsorted(times_s, edges_s + 1e-9, side="right") - 1
    frames[edges_s >= end_s] = len(times_s)
    return frames


@dataclass(frozen=True, eq=False)
class Columns:
    """Frames of a map that share a pixel column."""

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
        frames = column_frames(timebase.times_s, timebase.end_s, from_s, to_s, columns)
        first = frames[:-1]
        filled = (first >= 0) & (first < len(timebase))
        left_s = from_s + (stop_s - start_s) * np.arange(columns) / columns
        # Of a column that a gap ends in, the frames after it are shown.
        later = frames[1:] > first + 1
        filled[filled] = later[filled] | (
            left_s[filled] - timebase.times_s[first[filled]] < track.longest_s
        )
        if not filled.any():
            return cls(filled, 0, 0, np.zeros(0, np.int64))
        begin, end = int(first[filled][0]), int(frames[1:][filled][-1])
        end = min(max(end, int(first[filled][-1]) + 1), len(timebase))
        return cls(filled, begin, end, first[filled] - begin)

    def strongest(self, values: NDArray[Any]) -> NDArray[Any]:
        """The largest of every column's frames, (bins, filled columns), of (bins, end - begin)."""
        if values.shape[1] > self.starts.size:
            return np.maximum.reduceat(values, self.starts, axis=1)
        return values[:, self.starts]


def shade_columns(
    track: MapModel, levels: HeatmapLevels, start_s: float, stop_s: float, columns: int
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Shades of the time window, shape (bins, columns), and a mask of the filled columns.

    Where several frames share a column the strongest value is shown, so that a
    short gesture does not vanish when zoomed out.
    """
    values, filled = _strongest_columns(track, start_s, stop_s, columns)
    return track.shade(values, levels), filled


def uncertain_columns(
    track: MapModel, levels: HeatmapLevels, start_s: float, stop_s: float, columns: int
) -> NDArray[np.bool_] | None:
    """Mask of uncertain cells, bool (bins, columns); None where that is not known.

    Of several frames that share a column the one that is shown decides.
    """
    assert track.map is not None
    view = Columns.of(track, start_s, stop_s, columns)
    uncertain = track.uncertain(levels, view.begin, view.end)
    if uncertain is None:
        return None
    found = np.zeros((track.map.axis.bins, columns), bool)
    if view.filled.any():
        values = track.values[:, view.begin : view.end]
        known = view.strongest(np.where(uncertain, np.float32(-1.0), values))
        unknown = view.strongest(np.where(uncertain, values, np.float32(-1.0)))
        found[:, view.filled] = unknown >= np.maximum(known, 0.0)
    return found


def heatmap_image(
    track: MapModel,
    levels: HeatmapLevels,
    start_s: float,
    stop_s: float,
    columns: int,
    background: int,
) -> QImage:
    """One pixel per column and bin, fastest approach on top; uncertain cells without colour."""
    shades, filled = shade_columns(track, levels, start_s, stop_s, columns)
    numbers = (shades * 255.0).astype(np.uint8)
    colours = lookup_table(levels.colour_map)[numbers]
    uncertain = uncertain_columns(track, levels, start_s, stop_s, columns)
    if uncertain is not None:
        colours = np.where(uncertain, uncertain_table(levels.colour_map)[numbers], colours)
    colours[:, ~filled] = background
    return image_of(colours[::-1], QImage.Format.Format_RGB32)


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
    (denoised, there), (real, as_well) = (
        _strongest_columns(track, start_s, stop_s, columns)
        for track in (difference.denoised, difference.real)
    )
    shades = difference.shades(denoised, real, levels)
    colours = table[127 + np.rint(127.0 * shades).astype(np.int16)]
    colours[:, ~(there & as_well)] = background
    return image_of(colours[::-1], QImage.Format.Format_RGB32)


def _strongest_columns(
    track: MapModel, start_s: float, stop_s: float, columns: int
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Values of every pixel column (bins, columns), and which columns have some."""
    assert track.map is not None
    view = Columns.of(track, start_s, stop_s, columns)
    values = np.zeros((track.map.axis.bins, columns), np.float32)
    filled = view.filled.copy()
    if filled.any():
        values[:, filled] = view.strongest(track.values[:, view.begin : view.end])
        if track.covered is not None:
            filled[filled] = track.covered[view.starts + view.begin]
    return values, filled


class MapWidget(SessionPlot):
    """Keeps the picture of a map until map, stretch, levels, theme or size change."""

    BOTTOM_PX = 4

    def __init__(self, track: MapModel, session: Session, overlays: Sequence[Overlay] = ()) -> None:
        super().__init__(session, overlays)
        self.track = track  # the map that is shown
        self._image: QImage | None = None
        self.setMouseTracking(True)
        for signal in (track.changed, self._display.levels_changed, self._display.theme_changed):
            signal.connect(self.invalidate)

    def invalidate(self) -> None:
        """Draw the map again, and all that is around it."""
        self._image = None
        self.redraw()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Draw the map again for the new number of columns."""
        self.invalidate()

    def paint_map(self, painter: QPainter, plot: QRectF, start_s: float, end_s: float) -> None:
        """The map from ``start_s`` to ``end_s``, one column per device pixel."""
        if self._image is None:
            columns = max(round(plot.width() * self.devicePixelRatioF()), 1)
            self._image = self.make_image(start_s, end_s, columns)
        painter.drawImage(plot, self._image)

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
