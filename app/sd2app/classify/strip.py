"""Strip under the maps: class probabilities over time, and the class on screen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QBrush, QColor, QFont, QFontMetrics, QImage, QPainter
from PySide6.QtWidgets import QSizePolicy, QWidget

from sd2app.classify.model import ClassifyModel, ago_text, delay_text, reading_text
from sd2app.classify.track import ClassReading
from sd2app.labels.model import LabelsModel
from sd2app.maps.heatmap_image import Columns
from sd2app.maps.track_mouse import SeekingPlot, ZoomedPlot
from sd2app.session.display import DisplayModel
from sd2app.session.session import Session
from sd2app.widgets.canvas import AT_RIGHT, Canvas, clipped, faint, image_of
from sd2app.widgets.inputs import Choice
from sd2app.widgets.layouts import column_of, row_of
from sd2app.widgets.model_menu import ModelButton
from sd2app.widgets.panel import ElidedLabel, title
from sd2app.widgets.time_axis import GUTTER_PX, MARGIN_PX, paint_cursor

_PLOT_PX = 30
_BAR_PX = (28, 8)
_GAP_PX = 10
_LEAST_PX = 60
_FAINT = 90
"""Opacity of probabilities that are not of the current map."""


class ClassStrip(QWidget):
    """A line with model, map and read-out over the probabilities, stacked."""

    def __init__(
        self, session: Session, classify: ClassifyModel, labels: LabelsModel, button: ModelButton
    ) -> None:
        super().__init__()
        self._classify = classify
        self._source = Choice("The map that the classifier looks at", self)
        self._source.activated.connect(lambda at: classify.set_source(classify.sources[at]))
        self._status = ElidedLabel(self, "muted")
        self.readout = ClassReadout(session.display, classify, labels)
        line = row_of(
            title("Classifier"), button, self._source, (self._status, 1), self.readout,
            spacing_px=8, margins_px=(8, 2, MARGIN_PX, 2),
        )  # fmt: skip
        plot = ClassPlot(session, classify, labels)
        self.setLayout(column_of(line, plot, spacing_px=0, margins_px=0))
        classify.changed.connect(self._refresh)
        classify.moved.connect(self._say)
        self._refresh()

    def _refresh(self) -> None:
        model = self._classify
        self.setVisible(model.visible)
        titles = [f"on {track.title.lower()}" for track in model.sources]
        place = model.sources.index(model.source) if model.source in model.sources else -1
        self._source.offer(titles, place)
        self._source.setVisible(bool(titles))
        self._say()

    def _say(self) -> None:
        model = self._classify
        if model.problem:
            self._status.setText(model.problem)
        elif model.loading or model.track.card is None:
            self._status.setText("Loading the classifier…")
        else:
            card = model.track.card
            late = delay_text(card) if card.delay_frames else ""
            other = "It has learned from other maps than this"
            self._status.setText(late if model.knows_source else other)


class ClassReadout(Canvas):
    """A bar for every class, and the most probable one in words; grey while it is not current.

    Where there is no room for the bars there are the words alone.
    """

    def __init__(self, display: DisplayModel, classify: ClassifyModel, labels: LabelsModel) -> None:
        super().__init__()
        self._classify, self._labels, self._display = classify, labels, display
        self._shown: ClassReading | None = None
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)
        self._resize()
        for signal in (classify.moved, display.theme_changed):
            signal.connect(self._follow)
        classify.changed.connect(self._resize)

    @property
    def text(self) -> str:
        """The class of the frame on screen, and how sure it is; nothing where none is current."""
        reading = self._shown
        return reading_text(reading) if reading is not None and reading.current else ""

    def _resize(self) -> None:
        metrics, card = self.fontMetrics(), self._classify.card
        names = card.classes if card is not None else ()
        bold = QFont(self.font())
        bold.setBold(True)
        ago = f", {ago_text(card.delay_s)}" if card is not None and card.delay_frames else ""
        longest = ["no person", *(f"{name} 100 %{ago}" for name in names)]
        words = max(map(QFontMetrics(bold).horizontalAdvance, longest))
        bars = sum(metrics.horizontalAdvance(name) for name in names)
        self._bars_px = bars + len(names) * (_BAR_PX[0] + 4 + _GAP_PX)
        self._words_px = words + 8
        self.setFixedHeight(metrics.height() + 4)
        self.updateGeometry()
        self._follow()

    def sizeHint(self) -> QSize:
        """Size with room for all bars."""
        return QSize(self._bars_px + self._words_px, self.fontMetrics().height() + 4)

    def minimumSizeHint(self) -> QSize:
        """Size with room for the beginning of the text."""
        return QSize(min(self._words_px, _LEAST_PX), self.fontMetrics().height() + 4)

    def _follow(self) -> None:
        self._shown = self._classify.reading
        self.setAccessibleName(f"Gesture: {self.text or 'not known'}")
        self.update()

    def paint(self, painter: QPainter) -> None:
        """Paint bars with their names, then the text."""
        reading, palette = self._shown, self._display.palette
        if reading is None:
            return
        if self.width() >= self._bars_px + self._words_px:
            self._paint_bars(painter, reading)
        font = painter.font()
        font.setBold(reading.current)
        painter.setFont(font)
        painter.setPen(QColor(palette.text if reading.current else palette.muted))
        text = reading_text(reading) if reading.current else "…"
        shown = painter.fontMetrics().elidedText(text, Qt.TextElideMode.ElideRight, self.width())
        painter.drawText(self.rect(), AT_RIGHT, shown)

    def _paint_bars(self, painter: QPainter, reading: ClassReading) -> None:
        palette, offered = self._display.palette, self._labels.labels.label_set
        metrics, centre = painter.fontMetrics(), self.height() / 2
        x = float(self.width() - self._bars_px - self._words_px)
        for name, share in zip(reading.classes, reading.shares, strict=True):
            width = metrics.horizontalAdvance(name)
            painter.setPen(QColor(palette.muted))
            room = QRectF(x, 0, width + 1, self.height())
            painter.drawText(room, Qt.AlignmentFlag.AlignVCenter, name)
            x += width + 4
            box = QRectF(x, centre - _BAR_PX[1] / 2, *_BAR_PX)
            painter.fillRect(box, QColor(palette.well))
            box.setWidth(share * box.width())
            alpha = 255 if reading.current else _FAINT
            painter.fillRect(box, faint(offered.colour_of(name), alpha))
            x += _BAR_PX[0] + _GAP_PX


class ClassPlot(ZoomedPlot, SeekingPlot):
    """Probabilities over time, stacked: the background at the bottom. Click or drag seeks."""

    TOP_PX, BOTTOM_PX = 1, 3

    def __init__(self, session: Session, classify: ClassifyModel, labels: LabelsModel) -> None:
        super().__init__(session)
        self._classify, self._labels = classify, labels
        self.setFixedHeight(_PLOT_PX)
        self.setAccessibleName("Probability of each gesture over time")
        for signal in (
            classify.track.changed,
            classify.counts_changed,
            classify.changed,
            labels.changed,
            self._span.changed,
        ):
            signal.connect(self.redraw)

    def paint(self, painter: QPainter) -> None:
        """Paint the strip and the cursor."""
        self.paint_kept(painter, self._paint_strip)
        paint_cursor(painter, self.plot_rect(), self.scale.x_of(self._playback.time_s))

    def _paint_strip(self, painter: QPainter) -> None:
        palette, plot = self._display.palette, self.plot_rect()
        painter.fillRect(self.rect(), QColor(palette.panel))
        painter.fillRect(plot, QColor(palette.well))
        painter.setPen(QColor(palette.muted))
        right = Qt.AlignmentFlag.AlignRight
        gutter = QRectF(0, plot.top() - 2, GUTTER_PX - 8, plot.height() + 4)
        painter.drawText(gutter, right | Qt.AlignmentFlag.AlignTop, "1")
        painter.drawText(gutter, right | Qt.AlignmentFlag.AlignBottom, "0")
        track, source = self._classify.track, self._classify.track.source
        if track.card is None or source is None or source.map is None or not track.done.size:
            return
        ratio = painter.device().devicePixelRatioF()
        columns = max(round(plot.width() * ratio), 1)
        in_view = Columns.of(source, self._span.start_s, self._span.end_s, columns)
        frames = np.full(columns, -1, np.int64)
        frames[in_view.filled] = in_view.begin + in_view.starts
        offered = self._labels.labels.label_set
        colours = [QColor(offered.colour_of(name)).rgb() for name in track.card.classes]
        done = track.done if track.current else np.zeros_like(track.done)
        image = stacked_image(track.shares, done, frames, colours, round(plot.height() * ratio))
        painter.drawImage(plot, image)
        with clipped(painter, plot):
            for start_s, end_s in source.gaps_s:
                left, end = self.scale.x_of(start_s), self.scale.x_of(end_s)
                box = QRectF(left, plot.top(), max(end - left, 1.0), plot.height())
                painter.fillRect(box, QColor(palette.well))
                painter.fillRect(box, QBrush(QColor(palette.hatch), Qt.BrushStyle.FDiagPattern))


def stacked_image(
    shares: NDArray[np.float32],
    done: NDArray[np.bool_],
    frames: NDArray[np.int64],
    colours: list[int],
    height: int,
) -> QImage:
    """Columns of stacked shares, the first class at the bottom.

    ``shares``, shape (frames, classes), is NaN where unknown and left clear; frames that are
    not ``done``, shape (frames,), are faint. ``frames`` holds the frame of every column; −1 is
    left clear. ``colours`` holds ``0xAARRGGBB`` of every class.
    """
    known = frames >= 0
    chosen = shares[np.where(known, frames, 0)]  # (columns, classes)
    known &= ~np.isnan(chosen).any(axis=1)
    tops = np.cumsum(np.nan_to_num(chosen), axis=1)  # (columns, classes)
    levels = (np.arange(height)[::-1] + 0.5) / height
    # The class in whose part of the stack a pixel lies.
    index = (levels[:, None, None] > tops[None]).sum(axis=2)
    rgb = np.array(colours, np.uint32) & np.uint32(0xFFFFFF)
    alpha = np.where(done[np.where(known, frames, 0)], 255, _FAINT).astype(np.uint32)
    pixels = rgb[np.minimum(index, len(colours) - 1)] | (alpha << np.uint32(24))[None]
    return image_of(np.where(known[None], pixels, 0).astype(np.uint32))
