"""The Labels panel: the spans, statistics of them, and the label set."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QButtonGroup,
    QHBoxLayout,
    QLabel,
    QStackedWidget,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from sd2app.models.span_table import SpanTableModel
from sd2app.models.statistics_table import StatisticsTableModel
from sd2app.views.panel_parts import outlined
from sd2app.views.span_page import SpanPage
from sd2app.views.span_table import SpanTable
from sd2app.views.statistics_page import StatisticsPage

if TYPE_CHECKING:
    from sd2app.action_set import ActionSet
    from sd2app.context import Context

_TIPS = {
    "Spans": "All spans, to be found, sorted and edited",
    "Statistics": "How many spans each label has, and how long they are",
}
_MENU = ("span_starts_here", "span_ends_here", "split_span", "merge_spans", "delete_spans")
"""Actions that the table's own menu has too."""


class LabelsPanel(QWidget):
    """One page at a time; a button for each."""

    def __init__(self, context: Context, actions: ActionSet, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("page")
        c = context
        self.model = model = SpanTableModel(c.labels, c.playback, c.label_edits.apply, self)
        table = SpanTable(model, c.labels, c.label_edits, c.playback, c.span, c.settings, self)
        table.set_menu([actions[name] for name in _MENU])
        self.spans = SpanPage(model, c.labels, table, self)
        statistics = StatisticsPage(StatisticsTableModel(c.labels, c.playback, self), self)
        self._pages = QStackedWidget(self)
        self._count = QLabel(self)
        self._count.setObjectName("muted")
        row = QHBoxLayout()
        row.setSpacing(6)
        self._buttons = QButtonGroup(self)
        for place, (name, page) in enumerate((("Spans", self.spans), ("Statistics", statistics))):
            self._pages.addWidget(page)
            button = self._button(name)
            self._buttons.addButton(button, place)
            row.addWidget(button)
        self._buttons.idClicked.connect(self._pages.setCurrentIndex)
        row.addStretch(1)
        row.addWidget(self._count)
        columns = outlined("Columns", "Which columns of the spans are shown", None, self)
        columns.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        columns.setMenu(table.columns_menu())
        self._pages.currentChanged.connect(lambda place: columns.setVisible(place == 0))
        row.addWidget(columns)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 6, 8, 6)
        layout.setSpacing(6)
        layout.addLayout(row)
        layout.addWidget(self._pages, 1)
        for signal in (model.rowsInserted, model.rowsRemoved):
            signal.connect(self._show_count)
        self._show_count()

    def show_spans(self) -> None:
        """Show the spans, with the keyboard in their table."""
        self._turn_to(0)
        self.spans.table.setFocus(Qt.FocusReason.ShortcutFocusReason)

    def find(self) -> None:
        """Show the spans, with the keyboard in the search."""
        self._turn_to(0)
        self.spans.find()

    def _turn_to(self, place: int) -> None:
        self._buttons.button(place).setChecked(True)
        self._pages.setCurrentIndex(place)

    def _button(self, name: str) -> QToolButton:
        button = QToolButton(self)
        button.setText(name)
        button.setToolTip(_TIPS[name])
        button.setAccessibleName(name)
        button.setAccessibleDescription(_TIPS[name])
        button.setCheckable(True)
        button.setChecked(name == "Spans")
        button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        return button

    def _show_count(self) -> None:
        self._count.setText(self.model.words)
