"""Inertial sensors: placed on the body, shown below the maps, written to files."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QGuiApplication, QMouseEvent, QPainter, QPen
from PySide6.QtWidgets import QMenu

from sd2app.feature import Action, Feature, Shell, report
from sd2app.imu.model import AXES, ImuModel, place_words, reading_lines, status_parts
from sd2app.manual.help import show_help
from sd2app.maps.arrangement import BELOW_PX, HEADER_PX
from sd2app.maps.track_mouse import TrackMouse
from sd2app.session.session import Session
from sd2app.widgets.canvas import AT_LEFT, AT_RIGHT, Overlay, clipped
from sd2app.widgets.dialogs import ask_new
from sd2app.widgets.time_axis import (
    HANDLE_PX,
    MARGIN_PX,
    paint_handle,
    paint_readout,
    paint_title,
    signed_text,
)
from sd2core.imu.files import SUFFIXES
from sd2core.imu.signals import InertialSignals
from sd2core.mesh.presence import runs

Line = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Pixels and values of the points of a line, (n,) each."""

_SAMPLES_PER_COLUMN = 2.0
"""Beyond as many only the least and the largest of every pixel column are drawn."""
_STEPS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)
_CLOSE = 0.15
"""Share of a lane's extent within which nothing but zero is marked."""
_ROOM = 0.06
"""Room above and below the lines, as a share of their extent."""


def curve_lines(
    times_s: NDArray[np.float64],
    values: NDArray[np.float64],
    start_s: float,
    end_s: float,
    width_px: float,
) -> list[list[Line]]:
    """Lines of every axis of values (N, 3) from ``start_s`` to ``end_s``, and just beyond.

    Pixels count from 0 at ``start_s`` to ``width_px`` at ``end_s``. Nothing is drawn through
    samples that are not known. Where many share a pixel column, the line goes through their
    extremes, so that no peak is lost.
    """
    first = max(int(np.searchsorted(times_s, start_s)) - 1, 0)
    last = min(int(np.searchsorted(times_s, end_s, side="right")) + 1, len(times_s))
    x_px = (times_s[first:last] - start_s) * (width_px / (end_s - start_s))
    values = values[first:last]
    if len(values) > _SAMPLES_PER_COLUMN * width_px:
        column = np.floor(x_px)
        starts = np.flatnonzero(np.diff(column, prepend=column[0] - 1))
        least, largest = (
            extreme.reduceat(values, starts, axis=0) for extreme in (np.fmin, np.fmax)
        )
        values = np.stack([least, largest], axis=1).reshape(-1, values.shape[1])
        x_px = np.repeat(column[starts] + 0.5, 2)
    return [
        [(x_px[start:stop], axis[start:stop]) for start, stop in runs(np.isfinite(axis))]
        for axis in values.T
    ]


def extent(signals: list[InertialSignals], name: str) -> tuple[float, float]:
    """Limits of a lane that holds all values of a quantity, and zero."""
    arrays = [getattr(one, name) for one in signals]
    known = np.concatenate([values[np.isfinite(values)] for values in arrays] or [np.zeros(0)])
    low, high = float(known.min(initial=0.0)), float(known.max(initial=0.0))
    room = _ROOM * (high - low) or 1.0
    if math.isinf(room):  # of a damaged file
        return -1.0, 1.0
    return low - room, high + room


def scale_marks(low: float, high: float) -> tuple[float, ...]:
    """Round numbers near the limits of a lane to be written at its scale, the upper one first.

    Zero in place of one that is close to it.
    """
    near = _CLOSE * (high - low)
    marks = (_rounded_inwards(value) if abs(value) > near else 0.0 for value in (high, low))
    return tuple(dict.fromkeys(marks))


def _rounded_inwards(value: float) -> float:
    """Largest of the usual steps times a power of ten that is not beyond a value."""
    power = 10.0 ** math.floor(math.log10(abs(value)))
    step = max(step for step in _STEPS if step * power <= abs(value) * (1.0 + 1e-9))
    return math.copysign(step * power, value)


_LANE_PX = 40
_GAP_PX = 5
_LEGEND_PX = (16, 5, 12)
"""Length of a line in the legend, room to its name, room to the next."""


LANES = {"acceleration_mps2": "m/s²", "turn_rate_radps": "rad/s"}
"""Quantities with a plot of their own: arrays of the signals, with their units."""


class InertialTrack(TrackMouse):
    """Shows the current sensor, and the real one dashed.

    Click or drag seeks, the wheel zooms, Shift and the wheel pan.
    """

    OFFSET = "imu_offset_s"
    TOP_PX, BOTTOM_PX = HEADER_PX, BELOW_PX

    def __init__(self, session: Session, model: ImuModel, overlays: Sequence[Overlay]) -> None:
        super().__init__(session, overlays)
        self._model = model
        self._extents: dict[str, tuple[float, float]] = {}  # of the lanes, by what they show
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self._span.changed.connect(self.redraw)
        self.follow(self._pointer.changed)
        model.changed.connect(self._follow)
        self._follow()

    def _follow(self) -> None:
        model, signals = self._model, [one for one, *_ in self._curves()]
        self._extents = {name: extent(signals, name) for name in LANES}
        self.setVisible(model.visible)
        lanes_px = len(LANES) * (_LANE_PX + _GAP_PX) - _GAP_PX + BELOW_PX
        self.setFixedHeight(HEADER_PX + (0 if model.folded else lanes_px))
        self.setAccessibleName(f"{self.title}: {' · '.join(status_parts(model))}")
        self.redraw()

    @property
    def title(self) -> str:
        """Title of the track."""
        place = self._model.current
        return "Inertial sensor" + ("" if place is None else f" at {place_words(place)}")

    def lane_rect(self, number: int) -> QRectF:
        """Rectangle of a lane's plot, in pixels."""
        plot = self.plot_rect()
        height = (plot.height() - (len(LANES) - 1) * _GAP_PX) / len(LANES)
        top = plot.top() + number * (height + _GAP_PX)
        return QRectF(plot.left(), top, plot.width(), height)

    @property
    def axis_colours(self) -> tuple[QColor, ...]:
        """Colours of the axes x, y and z."""
        palette = self._display.palette
        return tuple(QColor(one) for one in (palette.axis_x, palette.axis_y, palette.axis_z))

    def _curves(self) -> Iterator[tuple[InertialSignals, float, bool]]:
        """Signals with what their times are shifted by, and if they are of a file."""
        model = self._model
        if model.signals is not None:
            yield model.signals, 0.0, False
        if model.measured is not None:
            yield model.measured, model.shift_s, True

    # --- painting -------------------------------------------------------------------------

    def paint(self, painter: QPainter) -> None:
        """Header and lanes, which are kept, then labels and the cursors over them."""
        self.paint_kept(painter, self._paint_track)
        if self._model.folded:
            return
        self._paint_overlays(painter)
        plot, scale = self.plot_rect(), self.scale
        with clipped(painter, plot):
            self.paint_cursors(painter, plot, QColor(self._display.palette.muted))
        if self.underMouse() and self._pointer.time_s is not None and not self.still:
            time_s = self._pointer.time_s
            if lines := reading_lines(self._model, time_s):
                place = QPointF(scale.x_of(time_s), plot.top())
                paint_readout(painter, plot, place, lines, self._display.palette)
        self.paint_grip(painter)

    def _paint_track(self, painter: QPainter) -> None:
        colours = self._display.palette
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.fillRect(self.rect(), QColor(colours.panel))
        self._paint_header(painter)
        if self._model.folded:
            return
        shown = list(self._curves())
        for number, name in enumerate(LANES):
            self._paint_lane(painter, self.lane_rect(number), name, shown)

    def _paint_header(self, painter: QPainter) -> None:
        colours = self._display.palette
        paint_handle(painter, HEADER_PX, "right" if self._model.folded else "down", colours.muted)
        box = QRectF(HANDLE_PX, 0, self.width() - HANDLE_PX - MARGIN_PX, HEADER_PX)
        left = HANDLE_PX + paint_title(painter, box, self.title, colours.text) + 12
        room = self.width() - 2 * MARGIN_PX - left - self._paint_legend(painter, box, left)
        painter.setPen(QColor(colours.muted))
        metrics, words = painter.fontMetrics(), " · ".join(status_parts(self._model))
        status = metrics.elidedText(words, Qt.TextElideMode.ElideRight, int(max(room, 40)))
        painter.drawText(QRectF(left, 0, self.width(), HEADER_PX), AT_LEFT, status)

    def _paint_legend(self, painter: QPainter, box: QRectF, left: float) -> float:
        """Paint the axes' lines at the right end of the header; returns its width and a gap."""
        if self._model.folded:
            return 0.0
        line_px, to_name_px, apart_px = _LEGEND_PX
        metrics, solid = painter.fontMetrics(), Qt.PenStyle.SolidLine
        entries = [
            (name, colour, solid) for name, colour in zip(AXES, self.axis_colours, strict=True)
        ]
        if self._model.measured is not None and self._model.signals is not None:
            muted = QColor(self._display.palette.muted)
            entries.append((self._model.file_words, muted, Qt.PenStyle.DashLine))
        widths = [line_px + to_name_px + metrics.horizontalAdvance(name) for name, *_ in entries]
        width = float(sum(widths) + apart_px * (len(widths) - 1))
        if self.width() - 2 * MARGIN_PX - left - width < 60:
            return 0.0
        x, middle = box.right() - width, box.center().y()
        for (name, colour, style), entry_px in zip(entries, widths, strict=True):
            painter.setPen(_pen(colour, style))
            painter.drawLine(QPointF(x, middle), QPointF(x + line_px, middle))
            painter.setPen(QColor(self._display.palette.muted))
            painter.drawText(
                QRectF(x + line_px + to_name_px, 0, entry_px, HEADER_PX), AT_LEFT, name
            )
            x += entry_px + apart_px
        return width + apart_px

    def _paint_lane(
        self,
        painter: QPainter,
        plot: QRectF,
        name: str,
        shown: list[tuple[InertialSignals, float, bool]],
    ) -> None:
        colours = self._display.palette
        painter.fillRect(plot, QColor(colours.well))
        low, high = self._extents[name]
        marks = scale_marks(low, high) if shown else ()

        def y_of(value: float) -> float:
            return plot.bottom() - plot.height() * (value - low) / (high - low)

        painter.setPen(QPen(QColor(colours.border), 1))
        painter.drawLine(QPointF(plot.left(), y_of(0.0)), QPointF(plot.right(), y_of(0.0)))
        with clipped(painter, plot):
            for signals, shift_s, of_file in reversed(shown):
                style = Qt.PenStyle.DashLine if of_file else Qt.PenStyle.SolidLine
                curves = curve_lines(
                    signals.times_s,
                    getattr(signals, name),
                    self._span.start_s - shift_s,
                    self._span.end_s - shift_s,
                    plot.width(),
                )
                for colour, lines in zip(self.axis_colours, curves, strict=True):
                    painter.setPen(_pen(colour, style))
                    for x_px, heights in lines:
                        y_px = plot.bottom() - plot.height() * (heights - low) / (high - low)
                        _paint_line(painter, (plot.left() + x_px).tolist(), y_px.tolist())
        self._paint_scale(painter, plot, LANES[name], [(one, y_of(one)) for one in marks])

    def _paint_scale(
        self, painter: QPainter, plot: QRectF, unit: str, marks: list[tuple[float, float]]
    ) -> None:
        """Write some values with their heights in pixels left of a lane, and the unit between."""
        painter.setPen(QPen(QColor(self._display.palette.muted), 1))
        line_px = float(painter.fontMetrics().height())
        half_px = line_px / 2 - 3  # letters are lower than their line
        for _, y in marks:
            painter.drawLine(QPointF(plot.left() - 4, y), QPointF(plot.left(), y))
        middles = [min(max(y, plot.top() + half_px), plot.bottom() - half_px) for _, y in marks]
        texts = [signed_text(value) for value, _ in marks] + [unit]
        middles.append(sum(middles) / len(middles) if len(marks) > 1 else plot.center().y())
        for text, middle in zip(texts, middles, strict=True):
            box = QRectF(0, middle - line_px / 2, plot.left() - 8, line_px)
            painter.drawText(box, AT_RIGHT, text)

    # --- mouse ----------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Start to drag the cursor, the time axis or the alignment; or fold."""
        if event.button() == Qt.MouseButton.LeftButton and self.use_of(event.position()) == "fold":
            self._model.set_folded(not self._model.folded)
        else:
            super().mousePressEvent(event)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Show the whole recording; a double click on the title folds or unfolds."""
        super().mouseDoubleClickEvent(event)
        if event.position().y() < HEADER_PX:
            self.mousePressEvent(event)

    def point_at(self, place: QPointF) -> None:
        """Read the signals under the pointer."""
        if self._model.folded or not self.plot_rect().contains(place):
            self._pointer.leave()
        else:
            self._pointer.point_at(self.scale.time_of(place.x()))

    @property
    def measured_from_s(self) -> float | None:
        """Offset of the real sensor, while it is on screen."""
        shown = self._model.measured is not None and not self._model.folded
        return self._model.offset_s if shown else None

    def use_of(self, place: QPointF) -> str:
        """Use of the left button: the title folds at its left end."""
        if place.y() >= HEADER_PX:
            return super().use_of(place)
        return "fold" if place.x() < HANDLE_PX else ""


def _pen(colour: QColor, style: Qt.PenStyle) -> QPen:
    """Pen of a line: thinner where it is dashed."""
    return QPen(colour, 1.5 if style == Qt.PenStyle.SolidLine else 1.0, style)


def _paint_line(painter: QPainter, x_px: list[float], y_px: list[float]) -> None:
    """Paint a line through points; a point alone is a dot."""
    points = list(map(QPointF, x_px, y_px))
    if len(points) == 1:
        painter.drawPoints(points)
    elif painter.pen().style() == Qt.PenStyle.DashLine:
        painter.drawPolyline(points)
    else:  # fifteen times as fast as a line with corners, where it is wider than a pixel
        painter.drawLines(list(map(QLineF, points[:-1], points[1:])))


_FILES = "Table (*.csv);;OpenSim (*.sto);;NumPy (*.npz)"


class ImuFeature(Feature):
    """Virtual sensors on the body, of which one is shown, and a real one's samples."""

    def __init__(self, session: Session, shell: Shell) -> None:
        self._session, self._shell = session, shell
        self.model = ImuModel(session, session.parent)
        report(shell, self.model)
        self.changing = (self.model.changed, session.placing.changed)
        self.closing = self.working = (self.model,)

    def actions(self) -> Sequence[Action]:
        """Place a sensor, and write what it feels."""
        model, placing = self.model, self._session.placing
        return (
            Action(
                "place_inertial", "Edit", "Place inertial sensor…", ("I",),
                "The next click on the body in the scene fixes a virtual accelerometer and"
                " gyroscope there; Esc cancels",
                placing.toggle, checked=lambda: placing.active, why_not=lambda: model.why_not,
            ),
            Action(
                "export_inertial", "File", "Export inertial signals…", (),
                "Write acceleration and turn rate of the sensor that is shown (.csv, .sto, .npz)",
                self._save, lambda: model.signals is not None,
            ),
        )  # fmt: skip

    def _save(self) -> None:
        window, name = self._shell.dialog_parent, self.model.file_name
        if path := ask_new(window, "Save inertial signals", name, _FILES, ".csv", SUFFIXES):
            self._shell.attempt(lambda: self.model.save(path))

    def track(self, overlays: Sequence[Overlay]) -> InertialTrack:
        """The track below the maps, with what other features draw over it."""
        track = InertialTrack(self._session, self.model, overlays)

        def fill(menu: QMenu, place: QPointF) -> None:
            inside = not self.model.folded and track.plot_rect().contains(place)
            self._fill_menu(menu, track.scale.time_of(place.x()) if inside else None)

        track.menu_parts = (fill,)
        return track

    def _fill_menu(self, menu: QMenu, time_s: float | None) -> None:
        """Fill the menu of the sensors, and of the values at a time."""
        model = self.model
        words = "" if time_s is None else "\t".join(reading_lines(model, time_s))
        copy = menu.addAction("Copy &value", lambda: QGuiApplication.clipboard().setText(words))
        copy.setEnabled(bool(words))
        folded = model.folded
        menu.addAction("&Unfold" if folded else "&Fold", lambda: model.set_folded(not folded))
        menu.addAction("Save signals &as…", self._save).setEnabled(model.signals is not None)
        menu.addSeparator()
        menu.addAction(self._shell.action("place_inertial"))
        menu.addAction(self._shell.action("align_by_hand"))
        for place in model.places:
            if place != model.current or model.signals is None:
                show = menu.addAction(f"Show sensor at {place_words(place)}")
                show.triggered.connect(lambda _, place=place: model.show(place))
        current = model.current
        if current is not None:
            menu.addAction(
                f"&Remove sensor at {place_words(current)}", lambda: model.remove(current)
            )
        if model.file is not None:
            menu.addAction(f"Remove {model.file.name}", model.remove_file)
        menu.addSeparator()
        menu.addAction("&Help on this track", lambda: show_help("Inertial sensor"))
