"""The Labels panel: the spans, statistics of them, and the label set."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QVBoxLayout, QWidget

from sd2app.feature import Keys
from sd2app.labels.edits import LabelEdits
from sd2app.labels.label_set_model import LabelSetModel
from sd2app.labels.label_set_page import Asks, LabelSetPage
from sd2app.labels.model import LabelsModel
from sd2app.labels.span_page import SpanPage
from sd2app.labels.statistics import StatisticsTableModel
from sd2app.labels.statistics_page import StatisticsPage
from sd2app.labels.table import SpanTable
from sd2app.labels.table_model import SpanTableModel
from sd2app.session.session import Session
from sd2app.widgets.pages import InnerPage, InnerPages
from sd2app.widgets.panel import ElidedLabel

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
            self._pages.turn_to(0)
            self.spans.find()
            return
        tables = {"Spans": self.spans.table, "Label set": self._label_set.table}
        self._pages.turn_to([name for name, _ in _PAGES].index(page))
        tables[page].setFocus(Qt.FocusReason.ShortcutFocusReason)

    def _show_count(self) -> None:
        self._count.setText(self.model.words if self._pages.shown == 0 else "")
