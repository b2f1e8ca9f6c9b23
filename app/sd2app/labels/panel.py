"""Labels panel: the table of spans with its filters, statistics, and the label set."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QSignalBlocker, Qt
from PySide6.QtGui import QAction, QHideEvent, QShowEvent
from PySide6.QtWidgets import (
    QHBoxLayout,
    QSizePolicy,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from sd2app.feature import Keys
from sd2app.labels.columns import COLUMNS
from sd2app.labels.edits import LabelEdits
from sd2app.labels.label_set_model import LabelSetModel
from sd2app.labels.label_set_page import Asks, LabelSetPage
from sd2app.labels.model import LabelsModel
from sd2app.labels.statistics import StatisticsTableModel
from sd2app.labels.statistics_page import StatisticsPage
from sd2app.labels.table import SpanTable
from sd2app.labels.table_model import SpanFilter, SpanTableModel
from sd2app.session.session import Session
from sd2app.widgets.inputs import Choice, SearchLine
from sd2app.widgets.pages import InnerPage, InnerPages
from sd2app.widgets.panel import ElidedLabel, outlined

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


_PAGES = (
    ("Spans", "All spans, to be found, sorted and edited"),
    ("Statistics", "How many spans each label has, and how long they are"),
    ("Label set", "Names, keys, colours and classes of the labels"),
)
_MENU = ("span_starts_here", "span_ends_here", "split_span", "merge_spans", "delete_spans")
"""Actions that the table's own menu has too."""


class LabelsPanel(QWidget):
    """One page at a time; a button for each."""

    def __init__(
        self,
        session: Session,
        labels: LabelsModel,
        edits: LabelEdits,
        keys: Keys,
        action: Callable[[str], QAction],
        asks: Asks,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setObjectName("page")
        s = session
        self.model = model = SpanTableModel(labels, s.playback, edits.apply, self)
        table = SpanTable(model, labels, edits, s.playback, s.span, s.settings, self)
        table.set_menu([action(name) for name in _MENU])
        self.spans = SpanPage(model, labels, table, self)
        statistics = StatisticsPage(StatisticsTableModel(labels, s.playback, self), self)
        set_model = LabelSetModel(labels, keys, edits.apply, self)
        self._label_set = LabelSetPage(set_model, asks, self)
        self._count = ElidedLabel(self)
        self._count.setObjectName("muted")
        self._count.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        pages = (self.spans, statistics, self._label_set)
        self._pages = InnerPages(
            [InnerPage(*words, page) for words, page in zip(_PAGES, pages, strict=True)],
            self._count,
            self,
        )
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 6, 8, 6)
        layout.addWidget(self._pages)
        for signal in (
            model.rowsInserted,
            model.rowsRemoved,
            labels.changed,
            self._pages.turned,
        ):
            signal.connect(self._show_count)
        self._show_count()

    def turn_to(self, page: str) -> None:
        """Show a page, or the search in the spans, with the keyboard there."""
        if page == "Search":
            self._pages.turn_to(_PAGES[0][0])
            self.spans.find()
            return
        tables = {"Spans": self.spans.table, "Label set": self._label_set.table}
        self._pages.turn_to(page)
        tables[page].setFocus(Qt.FocusReason.ShortcutFocusReason)

    def _show_count(self) -> None:
        self._count.setText(self.model.words if self._pages.shown == 0 else "")
