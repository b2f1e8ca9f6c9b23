"""Scroll area of the label timeline, for many tracks."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QFrame, QScrollArea, QScrollBar, QWidget

from sd2app.labels.model import LabelsModel
from sd2app.labels.rows import ROW_PX
from sd2app.labels.timeline import LabelTimeline
from sd2app.widgets.time_axis import MARGIN_PX

_HIGHEST_PX = round(8.5 * ROW_PX)
"""Half a row says that there are more."""


class LabelArea(QScrollArea):
    """Scroll area for many tracks; keeps the track for new spans in view.

    The scroll bar stands in the margin beside the tracks, so the time axis keeps its width.
    """

    def __init__(
        self, timeline: LabelTimeline, labels: LabelsModel, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._timeline, self._labels = timeline, labels
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setWidgetResizable(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setWidget(timeline)
        hidden = self.verticalScrollBar()
        self._bar = QScrollBar(Qt.Orientation.Vertical, self)
        self._bar.setAccessibleName("Scroll the tracks of labels")
        self._bar.valueChanged.connect(hidden.setValue)
        hidden.valueChanged.connect(self._bar.setValue)
        hidden.rangeChanged.connect(self._fit)
        timeline.installEventFilter(self)
        labels.selection_changed.connect(self._show_track)
        self._fit()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Follow the height of the tracks."""
        if watched is self._timeline and event.type() == QEvent.Type.Resize:
            self._fit()
        return super().eventFilter(watched, event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the scroll bar in its place."""
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        needed_px = self._timeline.sizeHint().height()
        self.setFixedHeight(min(needed_px, _HIGHEST_PX))
        hidden = self.verticalScrollBar()
        self._bar.setRange(hidden.minimum(), hidden.maximum())
        self._bar.setPageStep(self.height())
        self._bar.setSingleStep(round(ROW_PX))
        self._bar.setGeometry(self.width() - MARGIN_PX, 0, MARGIN_PX, self.height())
        self._bar.setVisible(needed_px > _HIGHEST_PX)
        self._bar.raise_()

    def _show_track(self) -> None:
        if self._labels.track:
            row = self._timeline.rows.row_of(self._labels.track)
            middle_px = round(row.top_px + row.height_px / 2)
            self.ensureVisible(0, middle_px, 0, round(row.height_px / 2))
