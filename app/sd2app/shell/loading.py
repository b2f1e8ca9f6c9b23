"""Covers of the window: what is being read, and what dropping files would do."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QObject, QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QFrame, QWidget

from sd2app.background.latest import delayed
from sd2app.feature import Drop
from sd2app.widgets.canvas import Canvas
from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import ProgressBar, outlined, sentence, title

if TYPE_CHECKING:
    from sd2app.session.document import DocumentModel
    from sd2app.session.session import Session

_BAR_PX = 320
_PATIENCE_MS = 1000
"""Time without a bar."""


class LoadingCover(QFrame):
    """Covers its parent until something is open, or nothing is being read."""

    painted = Signal()

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAutoFillBackground(True)
        self.title, self.part = title("Starting SD² Studio…"), sentence("")
        self.bar = ProgressBar("How much has been read", width_px=_BAR_PX)
        for label in (self.title, self.part):
            label.setAlignment(Qt.AlignmentFlag.AlignCenter)
        bar = row_of(STRETCH, self.bar, STRETCH)
        self.cancel = outlined("Cancel", "Open nothing", None, self)
        cancel = row_of(STRETCH, self.cancel, STRETCH)
        parts = (STRETCH, self.title, self.part, bar, cancel, STRETCH)
        self.setLayout(column_of(*parts, spacing_px=8))
        self.cancel.hide()
        # Room is kept for it, so that nothing jumps.
        policy = self.bar.sizePolicy()
        policy.setRetainSizeWhenHidden(True)
        self.bar.setSizePolicy(policy)
        self.bar.hide()
        self._patience = delayed(self.bar.show, _PATIENCE_MS, self)
        self._patience.start()
        self.bar.show_share(None)
        parent.installEventFilter(self)

    def follow(self, session: Session) -> None:
        """Show from now on what is being read, while there is nothing to show."""
        self.cancel.clicked.connect(
            lambda: session.document.reading and session.jobs.cancel(session.document.reading)
        )
        self.cancel.show()
        session.jobs.changed.connect(lambda: self._refresh(session.document))
        self._refresh(session.document)

    def _refresh(self, document: DocumentModel) -> None:
        reading = document.reading if document.content is None else None
        if reading is None:
            self._patience.stop()
            self.bar.hide()
            self.hide()
            return
        if not self.isVisible():
            self._patience.start()
        self.title.setText(f"{reading.title}…")
        self.part.setText(document.part_read)
        self.bar.show_count(reading.done, reading.total)
        self.raise_()
        self.show()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Say that it is on screen: what it covers is not painted."""
        super().paintEvent(event)
        self.painted.emit()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Stay as large as the parent."""
        if event.type() == QEvent.Type.Resize and isinstance(watched, QWidget):
            self.setGeometry(watched.rect())
        return False


_GAP_PX = 16
_COVER = 235
"""Opacity of what covers the window, of 255."""


class DropOverlay(Canvas):
    """A field for each thing that a drop can do, side by side; the one below the pointer does."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._covered = parent
        self._paths: Sequence[Path] = ()
        self.drops: Sequence[Drop] = ()
        self.current = 0
        self.hide()

    def offer(self, paths: Sequence[Path], drops: Sequence[Drop]) -> None:
        """Cover the parent with what can be done."""
        self._paths, self.drops, self.current = paths, drops, 0
        self.setAccessibleName("; ".join(one.text for one in drops))
        self.setGeometry(self._covered.rect())
        self.raise_()
        self.show()

    def point(self, at: QPointF) -> None:
        """Choose the field below the pointer, a place of this widget."""
        for place in range(len(self.drops)):
            if self.field(place).adjusted(-_GAP_PX, -_GAP_PX, _GAP_PX, _GAP_PX).contains(at):
                self.current = place
        self.update()

    def field(self, place: int) -> QRectF:
        """Rectangle of a field."""
        width = (self.width() - _GAP_PX) / len(self.drops) - _GAP_PX
        left = _GAP_PX + place * (width + _GAP_PX)
        return QRectF(left, _GAP_PX, width, self.height() - 2 * _GAP_PX)

    def paint(self, painter: QPainter) -> None:
        """Paint the fields, the current one in the accent colour."""
        colours = self.palette()
        cover = colours.window().color()
        cover.setAlpha(_COVER)
        painter.fillRect(self.rect(), cover)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        names = ", ".join(path.name for path in self._paths)
        for place, drop in enumerate(self.drops):
            chosen, field = place == self.current, self.field(place)
            edge = colours.highlight().color() if chosen else colours.mid().color()
            tint = QColor(edge)
            tint.setAlpha(40 if chosen else 0)
            painter.setPen(QPen(edge, 3 if chosen else 1, Qt.PenStyle.DashLine))
            painter.setBrush(tint)
            painter.drawRoundedRect(field, 8, 8)
            painter.setPen(colours.windowText().color())
            font = self.font()
            font.setPointSizeF(1.5 * font.pointSizeF())
            painter.setFont(font)
            flags = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
            inner = field.adjusted(24, 24, -24, -24)
            box = painter.boundingRect(inner, int(flags), drop.text)
            painter.drawText(inner, int(flags), drop.text)
            painter.setFont(self.font())
            below = inner.adjusted(0, box.bottom() - inner.top() + 8, 0, 0)
            top = Qt.AlignmentFlag.AlignHCenter | Qt.TextFlag.TextWordWrap
            painter.drawText(below, int(top), names)
