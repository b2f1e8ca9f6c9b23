"""Page of the label set: its labels with name, key, colour and class."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from PySide6.QtCore import (
    QAbstractItemModel,
    QModelIndex,
    QPersistentModelIndex,
    QPoint,
    Qt,
    QTimer,
    Signal,
)
from PySide6.QtGui import QColor, QKeyEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QColorDialog,
    QHeaderView,
    QLineEdit,
    QMenu,
    QStyleOptionViewItem,
    QWidget,
)

from sd2app.feature import Shell
from sd2app.labels.label_set_model import CLASS, COLOUR, KEY, NAME, NO_CLASS, LabelSetModel
from sd2app.widgets.dialogs import ask_file, ask_new
from sd2app.widgets.icons import swatch_icon
from sd2app.widgets.inputs import TypedLine
from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import ElidedLabel, outlined, show_words
from sd2app.widgets.table import CellTable, Choosable, FramedCells, ListedEditor
from sd2core.labels.files import read_label_set, write_label_set
from sd2core.labels.label_set import GESTURES

_WIDE = ("a name", "Key", "■ vermilion", "background", "Spans")
_PADDING_PX = 14
_OTHER = "other"
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
        self.setItemDelegate(_LabelSetCells(model, self))
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
    """Lists for colours and classes, lines for names and keys."""

    def __init__(self, model: LabelSetModel, parent: QWidget) -> None:
        super().__init__(parent)
        self._model = model

    def createEditor(
        self, parent: QWidget, option: QStyleOptionViewItem, index: QModelIndex
    ) -> QWidget:
        """Make a list or a line."""
        if index.column() == CLASS:
            choices = [Choosable(one or NO_CLASS, one) for one in self._model.classes()]
            return self.listed(choices, "Class", parent)
        if index.column() == COLOUR:
            choices = [
                Choosable(name, one, swatch_icon(one)) for name, one in self._model.colours()
            ]
            return self.listed([*choices, Choosable("Other…", _OTHER)], "Colour", parent)
        line = super().createEditor(parent, option, index)
        if index.column() == KEY and isinstance(line, QLineEdit):
            line.setMaxLength(1)
        line.setAccessibleName("Key" if index.column() == KEY else "Name of the label")
        return line

    def setModelData(self, editor: QWidget, model: QAbstractItemModel, index: QModelIndex) -> None:
        """Set the value; any other colour is asked for once the list is closed."""
        if isinstance(editor, ListedEditor) and editor.currentData() == _OTHER:
            place = QPersistentModelIndex(index)
            QTimer.singleShot(0, lambda: self._ask(place))
        else:
            super().setModelData(editor, model, index)

    def _ask(self, place: QPersistentModelIndex) -> None:
        if not place.isValid():
            return
        before, parent = QColor(place.data(Qt.ItemDataRole.EditRole)), self.parent()
        assert isinstance(parent, QWidget)
        colour = QColorDialog.getColor(before, parent.window(), "Colour of the label")
        if colour.isValid() and place.isValid():
            self._model.setData(place, colour.name())
