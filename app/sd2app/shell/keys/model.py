"""Actions, labels and what the mouse does, each with its keys, as the rows of a list."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from PySide6.QtCore import Qt
from PySide6.QtGui import QFont

from sd2app.labels.model import LabelsModel
from sd2app.shell.keys.bindings import KeyBindings
from sd2app.widgets.key_text import canonical, native
from sd2app.widgets.record_table import Heading, Index, RecordTableModel
from sd2core.labels.edits import Change
from sd2core.labels.field_edits import change_label

_HEADINGS = (Heading("Menu"), Heading("What it does"), Heading("Keys"))
KEYS = 2


@dataclass(frozen=True)
class KeyRow:
    """One row: an action, a label, or a use of the mouse."""

    menu: str
    text: str
    tip: str
    action: str = ""  # id of the action, if it is one
    label: str = ""  # name of the label, if it is one
    mouse: str = ""  # what the hand does, if it is neither


class KeyListModel(RecordTableModel[KeyRow]):
    """Every row that a search leaves; keys are changed through :class:`KeyBindings`."""

    def __init__(
        self,
        bindings: KeyBindings,
        labels: LabelsModel,
        mouse: Sequence[tuple[str, str]],
        apply: Callable[[Change], bool],
    ) -> None:
        super().__init__(_HEADINGS)
        self._bindings, self._labels, self._mouse, self._apply = bindings, labels, mouse, apply
        self._search = ""
        self.rows = self._listed()
        bindings.changed.connect(self._refresh)

    def set_search(self, text: str) -> None:
        """List rows with all these words in menu, name, tip or keys."""
        self._search = text
        self._refresh()

    def can_change(self, row: int) -> bool:
        """True if keys do it, not the mouse."""
        return not self.rows[row].mouse

    def is_usual(self, row: int) -> bool:
        """True if there is nothing to reset."""
        action = self.rows[row].action
        return not action or self._bindings.is_usual(action)

    def change(self, row: int, key: str, *, besides: bool = False) -> None:
        """Give a row another key, or one besides those it has; Sd2Error if it cannot have it."""
        at = self.rows[row]
        if at.action:
            kept = self._bindings.keys_of(at.action) if besides else ()
            self._bindings.bind(at.action, (*kept, key))
        elif at.label:
            wanted = self._bindings.for_label(at.label, key)
            self._apply(lambda now: change_label(now.labels, at.label, key=wanted))

    def clear(self, row: int) -> None:
        """Take all keys of a row away."""
        at = self.rows[row]
        if at.action:
            self._bindings.bind(at.action, ())
        elif at.label:
            self._apply(lambda now: change_label(now.labels, at.label, key=""))

    def reset(self, row: int) -> None:
        """Give a row its usual keys back; errors are those of :meth:`change`."""
        if action := self.rows[row].action:
            self._bindings.reset(action)

    def _refresh(self) -> None:
        rows = self._listed()
        if rows == self.rows:
            last = self.index(len(rows) - 1, KEYS)
            self.dataChanged.emit(self.index(0, 0), last)
            return
        self.beginResetModel()
        self.rows = rows
        self.endResetModel()

    def _listed(self) -> list[KeyRow]:
        actions = [
            KeyRow(one.menu, one.text, one.tip, action=one.id) for one in self._bindings.actions
        ]
        labels = [
            KeyRow("Labels", f"Mark or relabel: {one.name}", "Begin or end a span", label=one.name)
            for one in self._labels.labels.label_set.labels
        ]
        first = next((k for k, row in enumerate(actions) if row.menu == "Labels"), len(actions))
        mouse = [KeyRow("Mouse", meaning, meaning, mouse=hand) for hand, meaning in self._mouse]
        rows = [*actions[:first], *labels, *actions[first:], *mouse]
        words = self._search.casefold().split()
        return [
            row
            for row in rows
            if all(
                word in f"{row.menu} {row.text} {row.tip} {self.keys_text(row)}".casefold()
                for word in words
            )
        ]

    def keys_text(self, row: KeyRow) -> str:
        """The keys of a row, as they are written on this machine."""
        if row.mouse:
            return row.mouse
        if row.label:
            label = self._labels.labels.label_set.find(row.label)
            return "" if label is None else native(canonical(label.key))
        lent = self._bindings.lent(row.action)
        taken = [f"{native(key)}: now “{label}”" for key, label in lent.items()]
        return ", ".join([*map(native, self._bindings.keys_of(row.action)), *taken])

    def _text(self, record: KeyRow, column: int) -> str:
        return (record.menu, record.text, self.keys_text(record))[column]

    def _tip(self, record: KeyRow, column: int) -> str:
        return record.tip

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """Return text, tip or font of a cell; keys that the user chose are bold."""
        if role == Qt.ItemDataRole.FontRole and index.isValid() and index.column() == KEYS:
            font = QFont()
            font.setBold(not self.is_usual(index.row()))
            return font
        return super().data(index, role)
