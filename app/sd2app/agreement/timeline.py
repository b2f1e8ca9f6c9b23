"""Read-only timeline of another person's labels, with marks where the two differ."""

from __future__ import annotations

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QBrush, QColor, QMouseEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from sd2app.agreement.model import AgreementModel
from sd2app.labels.painting import paint_spans
from sd2app.labels.rows import LabelRows
from sd2app.session.display import DisplayModel
from sd2app.session.playback import PlaybackModel
from sd2app.session.time_window import TimeWindow
from sd2app.widgets.time_axis import GUTTER_PX, MARGIN_PX, TimeScale, paint_cursor

_MARKS_PX = 7.0


class OtherTimeline(QWidget):
    """Hatched rows, as they cannot be edited; a line over them marks differences.

    A click goes to that time.
    """

    def __init__(
        self,
        model: AgreementModel,
        span: TimeWindow,
        playback: PlaybackModel,
        display: DisplayModel,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._model = model
        self._span, self._playback, self._display = span, playback, display
        self._rows = LabelRows((), ())
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        model.changed.connect(self._follow)
        for signal in (span.changed, playback.frame_changed, display.theme_changed):
            signal.connect(self.update)
        self._follow()

    def sizeHint(self) -> QSize:
        """Return the height of the tracks and the marks over them."""
        return QSize(640, round(_MARKS_PX + self._rows.height_px))

    @property
    def scale(self) -> TimeScale:
        """Time axis of this widget."""
        return TimeScale(self._span.start_s, self._span.end_s, self.width())

    def _follow(self) -> None:
        model, other = self._model, self._model.other
        self._rows = LabelRows.of(other.labels.tracks, other.arrays, ())
        self.setVisible(model.active)
        self.setFixedHeight(self.sizeHint().height())
        self.setAccessibleName(f"Labels of {model.name}, read-only")
        self.setToolTip(f"Labels of {model.name}; the line over them marks what differs")
        self.update()

    # --- painting -------------------------------------------------------------------------

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint marks, names, spans and the cursor."""
        with QPainter(self) as painter:
            self._paint(painter)

    def _paint(self, painter: QPainter) -> None:
        palette, scale = self._display.palette, self.scale
        painter.fillRect(self.rect(), QColor(palette.panel))
        width = self.width() - GUTTER_PX - MARGIN_PX
        marks = QRectF(GUTTER_PX, 0, width, _MARKS_PX)
        plot = QRectF(GUTTER_PX, _MARKS_PX, width, self.height() - _MARKS_PX)
        painter.save()
        painter.setClipRect(marks.united(plot))
        for one in self._model.disagreements:
            if one.end_s > scale.start_s and one.start_s < scale.end_s:
                left, right = scale.x_of(one.start_s), scale.x_of(one.end_s)
                mark = QRectF(left, 2.0, max(right - left, 2.0), _MARKS_PX - 3.0)
                painter.fillRect(mark, QColor(palette.warning))
        painter.restore()
        painter.translate(0.0, _MARKS_PX)
        self._paint_rows(painter, plot.translated(0.0, -_MARKS_PX), scale)
        painter.translate(0.0, -_MARKS_PX)
        paint_cursor(painter, marks.united(plot), scale.x_of(self._playback.time_s))

    def _paint_rows(self, painter: QPainter, plot: QRectF, scale: TimeScale) -> None:
        palette = self._display.palette
        for row in self._rows.tracks:
            well = plot.adjusted(0, row.top_px + 1 - plot.top(), 0, 0)
            well.setHeight(row.height_px - 2)
            painter.fillRect(well, QColor(palette.well))
            painter.fillRect(well, QBrush(QColor(palette.border), Qt.BrushStyle.FDiagPattern))
            painter.setPen(QColor(palette.muted))
            room = QRectF(0, row.top_px, GUTTER_PX - 6, row.height_px)
            called = row.name if len(self._rows.tracks) > 1 else self._model.name
            name = painter.fontMetrics().elidedText(
                called, Qt.TextElideMode.ElideRight, int(room.width())
            )
            place = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
            painter.drawText(room, place, name)
        painter.save()
        painter.setClipRect(plot)
        paint_spans(painter, plot, scale, self._model.other, self._rows.tracks, palette)
        painter.restore()

    # --- the hand -------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Go to a time."""
        if event.button() == Qt.MouseButton.LeftButton and event.position().x() >= GUTTER_PX:
            self._playback.seek(self.scale.time_of(event.position().x()))
