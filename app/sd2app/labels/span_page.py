"""The spans of the recording: search, filters, and the table."""

from __future__ import annotations

from PySide6.QtCore import QSignalBlocker, Qt
from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import (
    QHBoxLayout,
    QSizePolicy,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from sd2app.labels.columns import COLUMNS
from sd2app.labels.model import LabelsModel
from sd2app.labels.table import SpanTable
from sd2app.labels.table_model import SpanFilter, SpanTableModel
from sd2app.widgets.inputs import Choice, SearchLine
from sd2app.widgets.panel import outlined

_ANY = {"label": "Any label", "track": "Any track"}
_LISTED = {one.id: one for one in COLUMNS if one.listed is not None}


class SpanPage(QWidget):
    """A line of filters above the table; kept up to date while it is shown."""

    def __init__(
        self,
        model: SpanTableModel,
        labels: LabelsModel,
        table: SpanTable,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._model, self.table = model, table
        self.search = SearchLine("Search label, note, track", self)
        self._chosen = {name: Choice(f"Spans of this {name} only", self) for name in _ANY}
        row = QHBoxLayout()
        row.setSpacing(6)
        row.addWidget(self.search, 5)
        for choice in self._chosen.values():
            choice.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
            choice.setMinimumWidth(48)
            choice.activated.connect(self._filter)
            row.addWidget(choice, 4)
        columns = outlined("…", "Which columns are shown", None, self)
        columns.setAccessibleName("Columns")
        columns.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        columns.setStyleSheet("QToolButton::menu-indicator { image: none; }")
        columns.setMenu(table.columns_menu)
        row.addWidget(columns)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(6)
        layout.addLayout(row)
        layout.addWidget(table, 1)
        self.search.textChanged.connect(self._filter)
        self.search.returnPressed.connect(table.setFocus)
        labels.changed.connect(self._offer)

    def find(self) -> None:
        """Focus the search."""
        self.search.setFocus(Qt.FocusReason.ShortcutFocusReason)
        self.search.selectAll()

    def showEvent(self, event: QShowEvent) -> None:
        """Follow the labels."""
        super().showEvent(event)
        self._offer()
        self._model.set_watched(True)
        self.table.mirror()

    def hideEvent(self, event: QHideEvent) -> None:
        """Stop following the labels."""
        super().hideEvent(event)
        self._model.set_watched(False)

    def _filter(self) -> None:
        chosen = {
            name: choice.currentText() if choice.currentIndex() > 0 else ""
            for name, choice in self._chosen.items()
        }
        self._model.set_filter(SpanFilter(self.search.text(), **chosen))

    def _offer(self) -> None:
        """Update the filters; one on a label or track that is gone is cleared."""
        if not self.isVisible():
            return
        for name, choice in self._chosen.items():
            texts = [_ANY[name], *self._model.choices(_LISTED[name])]
            if texts == [choice.itemText(place) for place in range(choice.count())]:
                continue
            before = choice.currentText()
            with QSignalBlocker(choice):
                choice.clear()
                choice.addItems(texts)
                choice.setCurrentIndex(max(choice.findText(before), 0))
        self._filter()
