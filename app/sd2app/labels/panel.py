"""Labels panel: the table of spans with its filters, statistics, and the label set."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QObject, Qt
from PySide6.QtGui import QGuiApplication, QIcon, QShowEvent
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QSizePolicy, QWidget

from sd2app.feature import Shell
from sd2app.labels.edits import LabelEdits
from sd2app.labels.label_set_model import LabelSetModel
from sd2app.labels.label_set_page import LabelSetPage
from sd2app.labels.model import LabelsModel
from sd2app.labels.table import SpanTable
from sd2app.labels.table_model import SpanFilter, SpanTableModel
from sd2app.session.playback import PlaybackModel
from sd2app.session.session import Session
from sd2app.widgets.canvas import AT_RIGHT
from sd2app.widgets.icons import swatch_icon
from sd2app.widgets.inputs import Choice, SearchLine
from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import ElidedLabel, InnerPages, outlined
from sd2app.widgets.record_table import Heading, RecordTableModel
from sd2app.widgets.table import RecordTable
from sd2core.labels.statistics import HEADINGS, label_statistics, statistics_rows, statistics_text

_ANY = {"label": "Any label", "track": "Any track"}
_TIPS = (
    "Labels of the set, then any others that spans have",
    "Number of spans",
    "Sum of their lengths; overlapping spans count in full",
    "Mean length",
    "Standard deviation of the lengths (n − 1)",
    "Median length",
    "Shortest length",
    "Longest length",
    "Share of the recording that they cover; overlaps count once",
)


class StatisticsTableModel(RecordTableModel[tuple[str, ...]]):
    """A row per label."""

    def __init__(self, labels: LabelsModel, playback: PlaybackModel, parent: QObject) -> None:
        # Units stand below, so that all columns have room beside each other.
        texts = (text.capitalize().replace("Sd ", "SD ").replace(" ", "\n") for text in HEADINGS)
        headings = [
            Heading(text, tip, number=place > 0)
            for place, (text, tip) in enumerate(zip(texts, _TIPS, strict=True))
        ]
        super().__init__(headings, parent)
        self._labels, self._playback = labels, playback
        labels.changed.connect(self._follow)

    def _refresh(self) -> None:
        base = self._playback.timebase
        self.beginResetModel()
        statistics = label_statistics(self._labels.labels, (base.start_s, base.end_s))
        self.rows = statistics_rows(statistics)
        self.endResetModel()

    def _text(self, record: tuple[str, ...], column: int) -> str:
        return record[column]

    def _icon(self, record: tuple[str, ...], column: int) -> QIcon | None:
        return None if column else swatch_icon(self._labels.labels.label_set.colour_of(record[0]))


class StatisticsPage(QWidget):
    """A row per label; kept up to date while it is shown."""

    def __init__(self, labels: LabelsModel, playback: PlaybackModel, parent: QWidget) -> None:
        super().__init__(parent)
        self._model = StatisticsTableModel(labels, playback, self)
        table = RecordTable("Statistics per label", self)
        table.setModel(self._model)
        table.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        table.setTabKeyNavigation(False)
        header = table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setStyleSheet("QHeaderView::section { padding: 4px 1px 2px 1px; }")
        to_paste, csv = (
            outlined(text, tip, partial(self._copy, separator), self)
            for text, tip, separator in (
                ("Copy table", "To be pasted into a sheet", "\t"),
                ("Copy CSV", "Comma-separated values", ","),
            )
        )
        buttons = row_of(STRETCH, to_paste, csv, spacing_px=6)
        self.setLayout(column_of((table, 1), buttons, spacing_px=6, margins_px=0))

    def _copy(self, separator: str) -> None:
        text = statistics_text(self._model.rows, separator)
        clipboard = QGuiApplication.clipboard()
        clipboard.setText(text)
        if separator == ",":
            # The clipboard's own: data made here would be deleted after Python, with a crash.
            clipboard.mimeData().setData("text/csv", text.encode())


class SpanPage(QWidget):
    """A line of filters above the table; kept up to date while it is shown."""

    def __init__(
        self, model: SpanTableModel, labels: LabelsModel, table: SpanTable, parent: QWidget
    ) -> None:
        super().__init__(parent)
        self._model, self.table = model, table
        self.search = SearchLine("Search label, note, track, person", self)
        self._chosen = {name: Choice(f"Spans of this {name} only", self) for name in _ANY}
        for choice in self._chosen.values():
            choice.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
            choice.setMinimumWidth(84)
            choice.activated.connect(self._filter)
        tip = "Which columns are shown"
        columns = outlined("…", tip, table.columns_menu, self, name="Columns")
        columns.setStyleSheet(
            "QToolButton { padding: 2px 8px; } QToolButton::menu-indicator { image: none; }"
        )
        filters = row_of(
            (self.search, 7), *((one, 4) for one in self._chosen.values()), columns, spacing_px=6
        )
        self.setLayout(column_of(filters, (table, 1), spacing_px=6, margins_px=0))
        self.search.textChanged.connect(self._filter)
        self.search.returnPressed.connect(table.setFocus)
        labels.changed.connect(self._offer)

    def find(self) -> None:
        """Focus the search."""
        self.search.setFocus(Qt.FocusReason.ShortcutFocusReason)
        self.search.selectAll()

    def showEvent(self, event: QShowEvent) -> None:
        """Bring the filters up to date."""
        super().showEvent(event)
        self._offer()

    def _filter(self) -> None:
        chosen = {
            name: choice.currentText() if choice.currentIndex() > 0 else ""
            for name, choice in self._chosen.items()
        }
        self._model.set_filter(SpanFilter(self.search.text(), **chosen))

    def _offer(self) -> None:
        """Update the filters; one on a label or track that is gone is cleared."""
        if self.isVisible():
            for name, choice in self._chosen.items():
                texts = [_ANY[name], *self._model.choices(name)]
                before = choice.currentText()
                choice.offer(texts, texts.index(before) if before in texts else 0)
            self._filter()


_PAGES = (
    ("Spans", "All spans, to be found, sorted and edited"),
    ("Statistics", "How many spans each label has, and how long they are"),
    ("Label set", "Names, keys, colours and classes of the labels"),
)


class LabelsPanel(QWidget):
    """One page at a time; a button for each."""

    def __init__(self, session: Session, edits: LabelEdits, shell: Shell) -> None:
        super().__init__()
        self.setObjectName("page")
        labels = edits.labels
        self.model = model = SpanTableModel(edits, self)
        model.noted.connect(shell.note)
        table = SpanTable(model, edits, session, shell, self)
        self.spans = SpanPage(model, labels, table, self)
        set_model = LabelSetModel(edits, shell.keys, self)
        self._label_set = LabelSetPage(set_model, shell, self)
        self._count = ElidedLabel(self, "muted")
        self._count.setAlignment(AT_RIGHT)
        pages = self.spans, StatisticsPage(labels, edits.playback, self), self._label_set
        self._pages = InnerPages(
            *((*words, page) for words, page in zip(_PAGES, pages, strict=True)),
            beside=self._count,
        )
        self.setLayout(column_of(self._pages, margins_px=(8, 6, 8, 6)))
        for signal in (model.rowsInserted, model.rowsRemoved, labels.changed, self._pages.turned):
            signal.connect(self._show_count)
        self._show_count()

    @property
    def page(self) -> str:
        """Name of the page that is shown."""
        return self._pages.page

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
