"""Read-only timeline of another person's labels, with marks where the two differ."""

from __future__ import annotations

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter
from PySide6.QtWidgets import QSizePolicy

from sd2app.agreement.model import AgreementModel
from sd2app.labels.painting import LabelRows, paint_tracks
from sd2app.maps.track_mouse import TimePlot
from sd2app.session.session import Session
from sd2app.widgets.canvas import clipped
from sd2app.widgets.time_axis import GUTTER_PX, paint_cursor

_MARKS_PX = 7.0


class OtherTimeline(TimePlot):
    """Hatched rows, as they cannot be edited; a line over them marks differences.

    A click goes to that time.
    """

    def __init__(self, session: Session, model: AgreementModel) -> None:
        super().__init__(session)
        self._model = model
        self._rows = LabelRows((), ())
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        model.changed.connect(self._follow)
        self.follow(session.span.changed)
        self._follow()

    def sizeHint(self) -> QSize:
        """Return the height of the tracks and the marks over them."""
        return QSize(640, round(_MARKS_PX + self._rows.height_px))

    def _follow(self) -> None:
        model, other = self._model, self._model.other
        self._rows = LabelRows.of(other.labels.tracks, other.arrays, ())
        self.setVisible(model.active)
        self.setFixedHeight(self.sizeHint().height())
        self.setAccessibleName(f"Labels of {model.name}, read-only")
        self.setToolTip(f"Labels of {model.name}; the line over them marks what differs")
        self.update()

    # --- painting -------------------------------------------------------------------------

    def paint(self, painter: QPainter) -> None:
        """Paint marks, names, spans and the cursor."""
        palette, scale, whole = self._session.display.palette, self.scale, self.plot_rect()
        painter.fillRect(self.rect(), QColor(palette.panel))
        with clipped(painter, whole):
            for one in self._model.disagreements:
                if one.end_s > scale.start_s and one.start_s < scale.end_s:
                    left, right = scale.x_of(one.start_s), scale.x_of(one.end_s)
                    mark = QRectF(left, 2.0, max(right - left, 2.0), _MARKS_PX - 3.0)
                    painter.fillRect(mark, QColor(palette.warning))
        painter.translate(0.0, _MARKS_PX)
        plot = QRectF(GUTTER_PX, 0, whole.width(), self._rows.height_px)
        other, rows = self._model.other, self._rows.tracks
        paint_tracks(painter, plot, scale, other, rows, palette, foreign=self._model.name)
        painter.translate(0.0, -_MARKS_PX)
        paint_cursor(painter, whole, scale.x_of(self._session.playback.time_s))

    # --- the hand -------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Go to a time."""
        if event.button() == Qt.MouseButton.LeftButton and event.position().x() >= GUTTER_PX:
            self._session.playback.seek(self.scale.time_of(event.position().x()))
