"""Covers of the window: what is being read, and what dropping files would do."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QObject, QPointF, Qt, Signal
from PySide6.QtGui import QPaintEvent
from PySide6.QtWidgets import QFrame, QLabel, QWidget

from sd2app.background.latest import delayed
from sd2app.feature import Drop
from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import ProgressBar, outlined, say, sentence, title

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


_MAX_DROPS = 2


class DropOverlay(QFrame):
    """A field for each thing that a drop can do, side by side; the one below the pointer does."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setObjectName("drops")
        self._covered = parent
        self.drops: Sequence[Drop] = ()
        self.current = 0
        self.fields = [QLabel(self) for _ in range(_MAX_DROPS)]
        for field in self.fields:
            field.setAlignment(Qt.AlignmentFlag.AlignCenter)
            field.setWordWrap(True)
        self.setLayout(row_of(*((one, 1) for one in self.fields), spacing_px=16, margins_px=16))
        self.hide()

    def offer(self, paths: Sequence[Path], drops: Sequence[Drop]) -> None:
        """Cover the parent with what can be done."""
        self.drops, self.current = drops, 0
        self.setAccessibleName("; ".join(one.text for one in drops))
        names = escape(", ".join(path.name for path in paths))
        for place, field in enumerate(self.fields):
            field.setVisible(place < len(drops))
            if place < len(drops):
                field.setText(f"<big><big>{escape(drops[place].text)}</big></big><p>{names}</p>")
        self.setGeometry(self._covered.rect())
        self.raise_()
        self.show()

    def point(self, at: QPointF) -> None:
        """Choose the field below the pointer, a place of this widget."""
        for place, field in enumerate(self.fields[: len(self.drops)]):
            if field.geometry().contains(at.toPoint()):
                self.current = place
        for place, field in enumerate(self.fields):
            say(field, field.text(), "chosen" if place == self.current else "drop")
