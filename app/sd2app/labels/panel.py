"""The Labels panel: the spans, statistics of them, and the label set."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QVBoxLayout, QWidget

from sd2app.labels.label_set_model import LabelSetModel
from sd2app.labels.label_set_page import Asks, LabelSetPage
from sd2app.labels.span_page import SpanPage
from sd2app.labels.statistics import StatisticsTableModel
from sd2app.labels.statistics_page import StatisticsPage
from sd2app.labels.table import SpanTable
from sd2app.labels.table_model import SpanTableModel
from sd2app.widgets.pages import InnerPage, InnerPages
from sd2app.widgets.panel import ElidedLabel

if TYPE_CHECKING:
    from sd2app.shell.menus import ActionSet
    from sd2app.shell.wiring import Context

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
        context: Context,
        actions: ActionSet,
        asks: Asks,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setObjectName("page")
        c = context
        self.model = model = SpanTableModel(c.labels, c.playback, c.label_edits.apply, self)
        table = SpanTable(model, c.labels, c.label_edits, c.playback, c.span, c.settings, self)
        table.set_menu([actions[name] for name in _MENU])
        self.spans = SpanPage(model, c.labels, table, self)
        statistics = StatisticsPage(StatisticsTableModel(c.labels, c.playback, self), self)
        set_model = LabelSetModel(c.labels, c.keys, c.label_edits.apply, self)
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
            c.labels.changed,
            self._pages.turned,
        ):
            signal.connect(self._show_count)
        self._show_count()

    def show_spans(self) -> None:
        """Show the spans, with the keyboard in their table."""
        self._pages.turn_to(0)
        self.spans.table.setFocus(Qt.FocusReason.ShortcutFocusReason)

    def find(self) -> None:
        """Show the spans, with the keyboard in the search."""
        self._pages.turn_to(0)
        self.spans.find()

    def show_label_set(self) -> None:
        """Show the label set, with the keyboard in its table."""
        self._pages.turn_to(2)
        self._label_set.table.setFocus(Qt.FocusReason.ShortcutFocusReason)

    def _show_count(self) -> None:
        self._count.setText(self.model.words if self._pages.shown == 0 else "")
