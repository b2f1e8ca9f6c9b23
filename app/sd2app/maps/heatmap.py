"""A Doppler map on the shared time axis: velocity up, time to the right."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPoint, QPointF, QRect, QRectF, QSize, Qt
from PySide6.QtGui import QBrush, QColor, QPainter, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from sd2app.maps.arrangement import BELOW_PX, HEADER_PX
from sd2app.maps.heatmap_image import MapWidget
from sd2app.maps.readout import body_range_m, reading_lines
from sd2app.maps.track_mouse import TrackMouse, offset_text
from sd2app.session.maps import UNCERTAIN_SHARE, MapModel, Reading, colours_of, part_words, title_of
from sd2app.session.session import Session
from sd2app.widgets.canvas import AT_LEFT, AT_RIGHT, Overlay, clipped, image_of, lookup_table
from sd2app.widgets.time_axis import (
    HANDLE_PX,
    MARGIN_PX,
    paint_handle,
    paint_readout,
    paint_title,
    signed_text,
    ticks,
)
from sd2core.maps import DopplerMap

BinMarks = tuple[QColor, QColor, Sequence[tuple[Sequence[int], Qt.BrushStyle]]]
"""Colour of zero, colour of hatching, and bins without information with their hatching."""


_SCALE_PX, _TIMES_PX = 72, 44
"""Room that a picture has more, for the scale of its colours and for its times and legend."""

_UNCERTAIN = f"±{100 * UNCERTAIN_SHARE:.0f} % or worse"

Velocity = TypeVar("Velocity", float, NDArray[np.float64])


def y_of(plot: QRectF, velocity_mps: Velocity, v_max_mps: float) -> Velocity:
    """Pixels of velocities on the axis of a map, upwards."""
    return plot.top() + plot.height() * (v_max_mps - velocity_mps) / (2.0 * v_max_mps)


def velocity_labels(
    v_max_mps: float, height_px: float, line_px: float
) -> list[tuple[float, float]]:
    """Velocities written at the axis of a map, and how far below its top their middles are.

    Labels at the ends are moved inwards, and there are only as many as do not overprint.
    """
    most = int(height_px / (1.8 * line_px))
    end_px = line_px / 2 - 2
    return [
        (
            velocity,
            min(
                max(height_px * (0.5 - velocity / (2.0 * v_max_mps)), end_px),
                max(height_px - end_px, end_px),
            ),
        )
        for velocity in (ticks(-v_max_mps, v_max_mps, most) if most >= 2 else (0.0,))
    ]


def paint_velocity_labels(
    painter: QPainter, plot: QRectF, labels: Sequence[tuple[float, float]]
) -> None:
    """Write :func:`velocity_labels` left of a plot, and their unit between the last two."""
    line_px = painter.fontMetrics().height()
    written = [(signed_text(velocity), beside_px) for velocity, beside_px in labels]
    lowest_px = sorted(beside_px for _, beside_px in labels)[-2:]
    if lowest_px[-1] - lowest_px[0] >= 1.8 * line_px:
        written.append(("m/s", 0.5 * sum(lowest_px)))
    for text, beside_px in written:
        room = QRectF(0, plot.top() + beside_px - line_px / 2, plot.left() - 8, line_px)
        painter.drawText(room, AT_RIGHT, text)


class HeatmapView(TrackMouse, MapWidget):
    """Shows one track; click or drag seeks, wheel zooms, Shift+wheel pans.

    One that is ``alignable`` was measured, and has an offset in time.
    """

    OFFSET = "radar_offset_s"
    TOP_PX, BOTTOM_PX = HEADER_PX, BELOW_PX
    USUAL_PX = 640, HEADER_PX + 160  # room for 32 bins of 5 pixels

    def __init__(
        self,
        track: MapModel,
        session: Session,
        overlays: Sequence[Overlay] = (),
        *,
        alignable: bool = False,
    ) -> None:
        super().__init__(track, session, overlays)
        self.setAccessibleName(f"{track.title} map")
        self.alignable = alignable
        self.folded = self.enlarged = False
        self.hint = ""
        self._button: QWidget | None = None
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self._room_px = 0
        self._span.changed.connect(self.redraw)
        track.status_changed.connect(self.redraw)
        self.follow(self._pointer.changed)

    def set_state(self, *, folded: bool, enlarged: bool) -> None:
        """Show the title alone, or that this map stands for all."""
        if (folded, enlarged) != (self.folded, self.enlarged):
            self.folded, self.enlarged = folded, enlarged
            self.redraw()

    def set_hint(self, hint: str) -> None:
        """Text shown while there is no map."""
        if hint != self.hint:
            self.hint = hint
            self.redraw()

    def set_button(self, button: QWidget) -> None:
        """Put a button beside the title."""
        self._button = button
        button.setParent(self)
        self.redraw()

    def title(self) -> str:
        """Title of the map, with the part of the body that is shown alone, if it is one."""
        return self.track.title if len(self.track.parts) > 1 else title_of(self.track)

    def bin_marks(self) -> BinMarks:
        """Look of bins without information."""
        return (
            QColor.fromRgb(int(lookup_table(self._display.levels.colour_map)[0])),
            QColor(255, 255, 255, 80),
            (
                (self._map.null_bins, Qt.BrushStyle.BDiagPattern),
                (self._map.unseen_bins, Qt.BrushStyle.DiagCrossPattern),
            ),
        )

    @property
    def _map(self) -> DopplerMap:
        """The map, where there is one."""
        assert self.track.map is not None
        return self.track.map

    def y_of(self, velocity_mps: float) -> float:
        """Pixel of a velocity."""
        return y_of(self.plot_rect(), velocity_mps, self._map.axis.v_max_mps)

    def velocity_of(self, y_px: float) -> float:
        """Velocity of a pixel."""
        plot, v_max = self.plot_rect(), self._map.axis.v_max_mps
        return v_max - 2.0 * v_max * (y_px - plot.top()) / plot.height()

    # --- painting -------------------------------------------------------------------------

    def paint(self, painter: QPainter) -> None:
        """Header, map, marked bins and axis, all kept, then labels and the cursors over them."""
        if self._button_px != self._room_px:
            self._kept.clear()
        self.paint_kept(painter, self._paint_map)
        if self.track.map is not None and not self.folded:
            self._paint_overlays(painter)
            self._paint_cursors(painter, self.plot_rect())
            self.paint_grip(painter)

    def _paint_map(self, painter: QPainter) -> None:
        colours = self._display.palette
        painter.fillRect(self.rect(), QColor(colours.panel))
        muted, centre = QColor(colours.muted), Qt.AlignmentFlag.AlignCenter
        if self.track.map is None and not self.track.awaited:
            painter.setPen(muted)
            painter.drawText(self.rect(), centre, self.hint)
            return
        self._paint_header(painter)
        if self.folded:
            return
        plot = self.plot_rect()
        if self.track.map is None:
            painter.fillRect(plot, QColor(colours.well))
            painter.setPen(muted)
            painter.drawText(plot, centre, "This map is being made…")
            return
        self.paint_map(painter, plot, *self._span.span_s)
        self._paint_marked_bins(painter, plot)
        self.paint_gaps(painter, plot, self.scale)
        self._paint_axis(painter, plot)

    def _paint_header(self, painter: QPainter) -> None:
        colours = self._display.palette
        # An enlarged map has an arrow back.
        to: Literal["down", "right", "left"] = "right" if self.folded else "down"
        if not self.still:
            paint_handle(painter, HEADER_PX, "left" if self.enlarged else to, colours.muted)
        box = QRectF(HANDLE_PX, 0, self.width() - HANDLE_PX - 8, HEADER_PX)
        left = HANDLE_PX + paint_title(painter, box, self.title(), colours.text) + 12
        painter.setPen(QColor(colours.muted))
        left += 0 if self.still else self._place_button(left)
        left += self._paint_parts(painter, left)
        metrics, words = painter.fontMetrics(), self.status()
        taken_px = left + metrics.horizontalAdvance(words)
        room = self.width() - 16 - left - self._paint_corner(painter, box, taken_px)
        status = metrics.elidedText(words, Qt.TextElideMode.ElideRight, int(max(room - 16, 40)))
        painter.drawText(QRectF(left, 0, self.width(), HEADER_PX), AT_LEFT, status)

    def _paint_parts(self, painter: QPainter, left: int) -> int:
        """Paint the names of several parts of the body in their colours; returns their width."""
        parts = self.track.parts if len(self.track.parts) > 1 else ()
        words = [part_words(part) for part in parts]
        widths = [painter.fontMetrics().horizontalAdvance(one) + 25 for one in words]
        if left + sum(widths) > self.width() - 8:  # the swatches alone
            words, widths = [""] * len(parts), [13] * len(parts)
        x = left
        for colour, word, width in zip(colours_of(parts).values(), words, widths, strict=True):
            painter.fillRect(x, HEADER_PX // 2 - 4, 9, 9, QColor(colour))
            painter.drawText(QRectF(x + 13, 0, width, HEADER_PX), AT_LEFT, word)
            x += width
        return x - left

    @property
    def _button_px(self) -> int:
        """Room that the button wants."""
        if self._button is None or self._button.isHidden():
            return 0
        return self._button.sizeHint().width() + 4

    def _place_button(self, left: int) -> int:
        """Room that the button takes."""
        self._room_px = self._button_px
        if self._room_px:
            assert self._button is not None
            size = self._button.sizeHint()
            height = min(size.height(), HEADER_PX - 2)
            width = max(min(size.width(), self.width() - left - MARGIN_PX), height)
            self._button.setGeometry(left - 4, (HEADER_PX - height) // 2, width, height)
        return self._room_px

    def _paint_corner(self, painter: QPainter, box: QRectF, left: float) -> float:
        """Paint the right end of the header; returns its width."""
        text = "approaching +  /  receding −   m/s"
        width = painter.fontMetrics().horizontalAdvance(text)
        if self.width() - 32 - left - width <= 0:
            return 0.0
        painter.drawText(box, AT_RIGHT, text)
        return width

    def status(self) -> str:
        """Carrier and quality of the map, and the reason where nothing shows."""
        strongest_db, lowest_db = self.track.strongest_db, self._display.levels.low_db
        carrier_hz = None if self.track.map is None else self.track.map.carrier_hz
        parts = ["" if carrier_hz is None else f"{1e-9 * carrier_hz:.4g} GHz", self.track.status]
        if self.alignable and self.track.offset_s:
            parts.append(offset_text(self.track.offset_s))
        if gaps_s := self.track.gaps_s:
            parts.append(f"no person in {sum(end - start for start, end in gaps_s):.2f} s")
        if self.track.uncertainty is not None:
            named = {"gray": "grey"}.get(self._uncertain_colour, "amber")
            parts.append(f"{named}: {_UNCERTAIN}")
        if self.track.by_hand and self.track.map is not None:
            value = f"{self.track.reference:.3g} {self.track.map.unit}".rstrip()
            parts.append(f"0 dB set to {value}")
        if self.track.covered is None and -math.inf < strongest_db < lowest_db:
            level = f"{strongest_db:.0f}".replace("-", "−")
            parts.append(f"strongest bin {level} dB, below the scale: R sets 0 dB here")
        return " · ".join(filter(None, parts))

    @property
    def _uncertain_colour(self) -> str:
        """Colour of uncertain cells, for a legend."""
        return "#e0a030" if self._display.levels.colour_map == "gray" else "gray"

    def _paint_marked_bins(self, painter: QPainter, plot: QRectF) -> None:
        edges_px = y_of(plot, self._map.axis.edges_mps, self._map.axis.v_max_mps).tolist()
        stretches = [
            (self.scale.x_of(start_s), self.scale.x_of(end_s))
            for start_s, end_s in self.track.covered_s
        ]
        nothing, hatch, marked = self.bin_marks()
        with clipped(painter, plot):
            painter.setPen(Qt.PenStyle.NoPen)
            for bins, pattern in marked:
                for index in bins:
                    top, bottom = edges_px[index + 1], edges_px[index]
                    for left, right in stretches:
                        band = QRectF(left, top, right - left, bottom - top)
                        painter.fillRect(band, nothing)
                        painter.fillRect(band, QBrush(hatch, pattern))

    def _paint_axis(self, painter: QPainter, plot: QRectF) -> None:
        colours, v_max = self._display.palette, self._map.axis.v_max_mps
        painter.setPen(QPen(QColor(colours.border), 1))
        painter.drawRect(plot.adjusted(-0.5, -0.5, 0.5, 0.5))
        painter.setPen(QPen(QColor(colours.muted), 1))
        labels = velocity_labels(v_max, plot.height(), painter.fontMetrics().height())
        for velocity, _ in labels:
            y = y_of(plot, velocity, v_max)
            painter.drawLine(QPointF(plot.left() - 4, y), QPointF(plot.left(), y))
        paint_velocity_labels(painter, plot, labels)

    def _paint_cursors(self, painter: QPainter, plot: QRectF) -> None:
        faint = QColor(255, 255, 255, 120)
        with clipped(painter, plot):
            if self._pointer.velocity_mps is not None and not self.still:
                painter.setPen(QPen(faint, 1, Qt.PenStyle.DotLine))
                y = self.y_of(self._pointer.velocity_mps)
                painter.drawLine(QPointF(plot.left(), y), QPointF(plot.right(), y))
            self.paint_cursors(painter, plot, faint)
        if self.underMouse() and self._pointer.reading is not None and not self.still:
            reading = self._pointer.reading
            place = QPointF(self.scale.x_of(reading.time_s), self.y_of(reading.velocity_mps))
            paint_readout(painter, plot, place, reading_lines(reading), self._display.palette)

    # --- pictures -------------------------------------------------------------------------

    def picture_size(self) -> QSize:
        """Size with the time axis and the colours' scale."""
        return self.size() + QSize(_SCALE_PX, _TIMES_PX)

    def paint_picture(self, painter: QPainter) -> None:
        """Map with the axis of time below, the scale of its colours, and what is drawn over it."""
        colours, plot = self._display.palette, self.plot_rect()
        painter.fillRect(QRect(QPoint(), self.picture_size()), QColor(colours.panel))
        super().paint_picture(painter)
        if self.track.map is None or self.folded:
            return
        painter.setPen(QColor(colours.muted))
        line_px = painter.fontMetrics().height()
        top = plot.bottom() + BELOW_PX
        for time_s in ticks(*self._span.span_s, max(int(plot.width() / 80), 1)):
            x = self.scale.x_of(time_s)
            painter.drawLine(QPointF(x, top), QPointF(x, top + 4))
            box = QRectF(x - 40, top + 4, 80, line_px)
            painter.drawText(box, Qt.AlignmentFlag.AlignCenter, f"{time_s:g} s")
        table, low, high, unit = self.colour_scale()
        bar = QRectF(plot.right() + 16, plot.top(), 12, plot.height())
        painter.drawImage(bar, image_of(table[::-1, None]))
        painter.drawRect(bar)
        for value in ticks(low, high, max(int(plot.height() / (2 * line_px)), 1)):
            y = bar.bottom() - bar.height() * (value - low) / (high - low)
            middle = min(max(y, bar.top() + line_px / 2), bar.bottom() - line_px / 2)
            box = QRectF(bar.right() + 4, middle - line_px / 2, _SCALE_PX, line_px)
            painter.drawText(box, AT_LEFT, f"{value:g} {unit}".replace("-", "−"))
        self._paint_legend(painter, QPointF(plot.left(), top + 4 + line_px))

    def colour_scale(self) -> tuple[NDArray[np.uint32], float, float, str]:
        """Colours from the lowest on, the values of the first and the last, and their unit."""
        levels = self._display.levels
        return lookup_table(levels.colour_map), *levels.ends

    def _paint_legend(self, painter: QPainter, place: QPointF) -> None:
        """Name what lies over the map, as far as there is room."""
        metrics, x = painter.fontMetrics(), place.x()
        entries = {} if self.track.uncertainty is None else {_UNCERTAIN: self._uncertain_colour}
        for overlay in self._overlays:
            entries.update(overlay.legend(*self._span.span_s))
        for name, colour in entries.items():
            width = metrics.horizontalAdvance(name)
            if x + 16 + width > self.width() + _SCALE_PX:
                return
            painter.fillRect(QRectF(x, place.y() + 5, 10, 8), QColor(colour))
            painter.drawText(QRectF(x + 16, place.y(), width, metrics.height()), AT_LEFT, name)
            x += width + 32

    # --- mouse ----------------------------------------------------------------------------

    @property
    def measured_from_s(self) -> float | None:
        """Offset of a map that was measured, while it is on screen."""
        shown = self.alignable and self.track.map is not None and not self.folded
        return self.track.offset_s if shown else None

    def _cell_at(self, position: QPointF) -> tuple[float, float] | None:
        """Time and velocity at a pixel, None beside the map."""
        if self.track.map is None or self.folded or not self.plot_rect().contains(position):
            return None
        return self.scale.time_of(position.x()), self.velocity_of(position.y())

    def reading_at(self, position: QPointF) -> Reading | None:
        """Cell at a pixel, None where there is none."""
        cell = self._cell_at(position)
        return None if cell is None else self.read(*cell)

    def point_at(self, position: QPointF) -> None:
        """Read the cell under the pointer."""
        if (cell := self._cell_at(position)) is None:
            self._pointer.leave()
        else:
            self._pointer.point_at(*cell, self.read(*cell))

    def read(self, time_s: float, velocity_mps: float) -> Reading | None:
        """Cell at a time and velocity, with the range of the body that was synthesised from."""
        reading = self.track.read(time_s, velocity_mps)
        if reading is None or self.track is not self._session.maps.synthetic:
            return reading
        return replace(reading, range_m=body_range_m(self._session, time_s))
