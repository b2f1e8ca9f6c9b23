"""Labels panel: the table of spans with its filters, statistics, and the label set."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from PySide6.QtCore import (
    QAbstractItemModel,
    QModelIndex,
    QObject,
    QPersistentModelIndex,
    QPoint,
    Qt,
    QTimer,
    Signal,
)
from PySide6.QtGui import QColor, QGuiApplication, QIcon, QKeyEvent, QShowEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QColorDialog,
    QHeaderView,
    QLineEdit,
    QMenu,
    QSizePolicy,
    QStyleOptionViewItem,
    QWidget,
)

from sd2app.feature import Shell
from sd2app.labels.edits import LabelEdits
from sd2app.labels.label_set_model import KEY, NAME, OTHER, LabelSetModel
from sd2app.labels.model import LabelsModel
from sd2app.labels.table import SpanTable
from sd2app.labels.table_model import SpanFilter, SpanTableModel
from sd2app.session.playback import PlaybackModel
from sd2app.session.session import Session
from sd2app.widgets.canvas import AT_RIGHT
from sd2app.widgets.dialogs import ask_file, ask_new
from sd2app.widgets.icons import swatch_icon
from sd2app.widgets.inputs import Choice, SearchLine, TypedLine
from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import ElidedLabel, InnerPages, outlined, show_words
from sd2app.widgets.record_table import Heading, RecordTableModel
from sd2app.widgets.table import CellTable, FramedCells, ListedEditor, RecordTable
from sd2core.labels.files import read_label_set, write_label_set
from sd2core.labels.label_set import GESTURES
from sd2core.labels.statistics import HEADINGS, label_statistics, statistics_rows, statistics_text

_WIDE = ("a name", "Key", "■ vermilion", "background", "Spans")
_PADDING_PX = 14
_FILES = "Label set (*.json);;All files (*)"


class LabelSetPage(QWidget):
    """The table, warnings about colours, and buttons."""

    def __init__(self, model: LabelSetModel, shell: Shell, parent: QWidget) -> None:
        super().__init__(parent)
        self._model, self._shell = model, shell
        self._name = TypedLine("Name of the label set", "Name of the label set", self)
        self._name.ended.connect(self._rename)
        self.table = table = LabelSetTable(model, self)
        table.removed.connect(self._remove)
        self._warning = ElidedLabel(self, "warning")
        self._add = outlined("Add", "Add a label", self._added, self)
        self._less = outlined("Remove", "Remove the label of the current row", self._remove, self)
        self._up = outlined("Up", "Offer it earlier", lambda: self._move(-1), self)
        self._down = outlined("Down", "Offer it later", lambda: self._move(1), self)
        tip = "Share the set as a file, or take another"
        file = outlined("File", tip, self._file_menu(), self)
        top = row_of((self._name, 1), file, spacing_px=6)
        below = row_of(self._add, self._less, self._up, self._down, STRETCH, spacing_px=6)
        parts = top, (table, 1), self._warning, below
        self.setLayout(column_of(*parts, spacing_px=6, margins_px=0))
        model.modelReset.connect(self._refresh)
        model.dataChanged.connect(self._refresh)
        table.selectionModel().currentRowChanged.connect(self._refresh)
        self._refresh()

    def _file_menu(self) -> QMenu:
        menu = QMenu(self)
        menu.addAction("Import label set…", self._import)
        menu.addAction("Export label set…", self._export)
        menu.addSeparator()
        menu.addAction("Usual label set", lambda: self._model.use(GESTURES))
        return menu

    def _rename(self) -> None:
        name, shown = self._name.text().strip(), self._model.label_set
        if name != shown.name:
            self._model.use(replace(shown, name=name))

    def _import(self) -> None:
        if path := ask_file(self, "Import label set", _FILES):
            self._shell.attempt(lambda: self._model.use(read_label_set(path)))

    def _export(self) -> None:
        shown = self._model.label_set
        start = f"{shown.name or 'labels'}.json".replace("/", "-")
        if path := ask_new(self, "Export label set", start, _FILES, ".json"):
            self._shell.attempt(lambda: write_label_set(path, shown))

    def _added(self) -> None:
        if self._model.add():
            index = self._model.index(self._model.rowCount() - 1, NAME)
            self.table.setCurrentIndex(index)
            self.table.setFocus()
            self.table.edit(index)

    def _move(self, towards: int) -> None:
        index = self.table.currentIndex()
        if self._model.move(index.row(), towards):
            self.table.setCurrentIndex(index.siblingAtRow(index.row() + towards))

    def _remove(self) -> None:
        row = self.table.currentIndex().row()
        if row < 0:
            return
        if self._model.spans_of(row):
            menu = self.menu_to_remove(row)
            menu.exec(self._less.mapToGlobal(QPoint(0, self._less.height())))
        else:
            self._gone(row)

    def menu_to_remove(self, row: int) -> QMenu:
        """Make the menu of choices for the spans of a label to remove."""
        count = self._model.spans_of(row)
        whose = "The span keeps" if count == 1 else f"The {count:,} spans keep"
        menu = QMenu(self)
        menu.addAction(f"{whose} the label, shown in grey", partial(self._gone, row))
        others = menu.addMenu("Give the span another label" if count == 1 else "Give them another")
        for label in self._model.label_set.labels:
            if label != self._model.label_set.labels[row]:
                instead = partial(self._gone, row, label.name)
                others.addAction(swatch_icon(label.colour), label.name, instead)
        return menu

    def _gone(self, row: int, instead: str | None = None) -> None:
        if self._model.remove(row, instead):
            last = self._model.rowCount() - 1
            self.table.setCurrentIndex(self._model.index(min(row, last), NAME))

    def _refresh(self) -> None:
        row, count = self.table.currentIndex().row(), self._model.rowCount()
        self._less.setEnabled(row >= 0)
        self._up.setEnabled(row > 0)
        self._down.setEnabled(0 <= row < count - 1)
        show_words(self._warning, self._model.warnings)
        if not self._name.hasFocus():
            self._name.setText(self._model.label_set.name)


class LabelSetTable(CellTable):
    """A row per label; Delete removes the current one."""

    removed = Signal()

    def __init__(self, model: LabelSetModel, parent: QWidget) -> None:
        super().__init__("Label set", (Qt.Key.Key_Delete, Qt.Key.Key_Backspace), parent)
        self.setModel(model)
        self.setItemDelegate(_LabelSetCells(self))
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        metrics = self.fontMetrics()
        for place, text in enumerate(_WIDE):
            self.setColumnWidth(place, metrics.horizontalAdvance(text) + _PADDING_PX)
        self.horizontalHeader().setStretchLastSection(False)
        self.horizontalHeader().setSectionResizeMode(NAME, QHeaderView.ResizeMode.Stretch)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Remove labels, not spans, with Delete."""
        if event.key() in (Qt.Key.Key_Delete, Qt.Key.Key_Backspace):
            self.removed.emit()
        else:
            super().keyPressEvent(event)


class _LabelSetCells(FramedCells):
    """A key is one character, and any colour can be asked for."""

    def createEditor(
        self, parent: QWidget, option: QStyleOptionViewItem, index: QModelIndex
    ) -> QWidget:
        """Make a list or a line."""
        editor = super().createEditor(parent, option, index)
        if index.column() == KEY and isinstance(editor, QLineEdit):
            editor.setMaxLength(1)
        return editor

    def setModelData(self, editor: QWidget, model: QAbstractItemModel, index: QModelIndex) -> None:
        """Set the value; any other colour is asked for once the list is closed."""
        if isinstance(editor, ListedEditor) and editor.currentData() == OTHER:
            place = QPersistentModelIndex(index)
            QTimer.singleShot(0, lambda: self._ask(place, model))
        else:
            super().setModelData(editor, model, index)

    def _ask(self, place: QPersistentModelIndex, model: QAbstractItemModel) -> None:
        if not place.isValid():
            return
        before, parent = QColor(place.data(Qt.ItemDataRole.EditRole)), self.parent()
        assert isinstance(parent, QWidget)
        colour = QColorDialog.getColor(before, parent.window(), "Colour of the label")
        if colour.isValid() and place.isValid():
            model.setData(place, colour.name())


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
        for signal in (model.layoutChanged, model.dataChanged, self._pages.turned):
            signal.connect(self._show_count)

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
