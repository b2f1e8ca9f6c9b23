"""The label set as the rows of a table that edits it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from PySide6.QtCore import QAbstractTableModel, QModelIndex, QObject, QPersistentModelIndex, Qt

from sd2app.labels.columns import Change
from sd2app.labels.model import LabelsModel
from sd2app.shell.keys.bindings import KeyBindings
from sd2app.widgets.icons import swatch_icon
from sd2app.widgets.key_text import canonical, native
from sd2core.labels.colours import OFFERED, Alike, alike
from sd2core.labels.field_edits import (
    CLASSES,
    add_label,
    move_label,
    new_label,
    remove_label,
    rename_label,
    set_class,
    set_colour,
    set_key,
    set_label_set,
)
from sd2core.labels.label_set import Label, LabelSet

Index = QModelIndex | QPersistentModelIndex

NAME, KEY, COLOUR, CLASS, SPANS = range(5)
HEADINGS = (
    ("Label", "Its name; spans that have it follow"),
    ("Key", "One character that marks with it"),
    ("Colour", "Of its spans; two that look alike are said below"),
    ("Class", "What the classifier is to call it; – is not learnt from"),
    ("Spans", "How many have it"),
)
NO_CLASS = "–"
_COLOURS = {colour: name for name, colour in OFFERED}
_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
_NOWHERE = QModelIndex()


class LabelSetModel(QAbstractTableModel):
    """A row is a label. Every change is one step, and what cannot be is refused in words."""

    def __init__(
        self,
        labels: LabelsModel,
        keys: KeyBindings,
        apply: Callable[[Change], bool],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._labels, self._keys, self._apply = labels, keys, apply
        self._set = labels.labels.label_set
        self._counts: Counter[str] = Counter()
        self._alike: list[Alike] = []
        self._watched = False
        labels.changed.connect(self._follow)

    # --- what is there --------------------------------------------------------------------

    @property
    def label_set(self) -> LabelSet:
        """The labels, in their order."""
        return self._set

    @property
    def warnings(self) -> str:
        """Which labels cannot be told apart by colour; empty where all can."""
        return " ".join(f"{one.words()}." for one in self._alike)

    def spans_of(self, row: int) -> int:
        """How many spans have a label."""
        return self._counts[self._set.labels[row].name]

    def classes(self) -> list[str]:
        """What a label can be to the classifier; the empty one is not learnt from."""
        others = sorted({one.gesture_class for one in self._set.labels}.difference(CLASSES, {""}))
        return ["", *CLASSES, *others]

    def colours(self) -> list[tuple[str, str]]:
        """Colours to choose from, names first: those offered and others in use."""
        others = sorted({one.colour for one in self._set.labels}.difference(_COLOURS))
        return [*OFFERED, *((colour, colour) for colour in others)]

    # --- changing -------------------------------------------------------------------------

    def add(self) -> bool:
        """Add a label with a name, a colour and a key that none has yet."""
        made = new_label(self._set)
        if made.key and self._keys.owner(made.key):
            made = replace(made, key="")
        return self._apply(lambda labels, _: add_label(labels, made))

    def move(self, row: int, towards: int) -> bool:
        """Put a label one place up (-1) or down (1)."""
        name = self._set.labels[row].name
        return self._apply(lambda labels, _: move_label(labels, name, row + towards))

    def remove(self, row: int, instead: str | None = None) -> bool:
        """Remove a label; its spans keep it, or get another one."""
        name = self._set.labels[row].name
        return self._apply(lambda labels, _: remove_label(labels, name, instead))

    def rename_set(self, name: str) -> bool:
        """Call the set something else."""
        named = replace(self._set, name=name.strip())
        return self._apply(lambda labels, _: set_label_set(labels, named))

    def setData(self, index: Index, value: Any, role: int = Qt.ItemDataRole.EditRole) -> bool:
        """Make the edit that was typed; False, with the cell as it was, where it was refused."""
        name, text = self._set.labels[index.row()].name, str(value).strip()
        if text == self.data(index, Qt.ItemDataRole.EditRole):
            return False
        changes: dict[int, Change] = {
            NAME: lambda labels, _: rename_label(labels, name, text),
            KEY: lambda labels, _: set_key(
                labels, name, self._keys.for_label(name, text) if text else ""
            ),
            COLOUR: lambda labels, _: set_colour(labels, name, text.lower()),
            CLASS: lambda labels, _: set_class(labels, name, text),
        }
        return self._apply(changes[index.column()])

    # --- following ------------------------------------------------------------------------

    def set_watched(self, watched: bool) -> None:
        """Follow the labels, or leave that until somebody looks."""
        self._watched = watched
        self._follow()

    def _follow(self) -> None:
        if not self._watched:
            return
        labels = self._labels.labels
        count = len(labels.label_set.labels)
        anew = count != len(self._set.labels)
        if anew:
            self.beginResetModel()
        self._set = labels.label_set
        self._counts = Counter(span.label for span in labels.spans)
        self._alike = alike(self._set.labels)
        if anew:
            self.endResetModel()
        elif count:
            self.dataChanged.emit(self.index(0, 0), self.index(count - 1, SPANS))

    # --- Qt's questions -------------------------------------------------------------------

    def rowCount(self, parent: Index = _NOWHERE) -> int:
        """Labels of the set."""
        return 0 if parent.isValid() else len(self._set.labels)

    def columnCount(self, parent: Index = _NOWHERE) -> int:
        """Name, key, colour, class, and how many spans."""
        return 0 if parent.isValid() else len(HEADINGS)

    def headerData(
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        """Headings."""
        if orientation != Qt.Orientation.Horizontal:
            return None
        if role == Qt.ItemDataRole.TextAlignmentRole:
            return _RIGHT if section == SPANS else _LEFT
        roles = {Qt.ItemDataRole.DisplayRole: 0, Qt.ItemDataRole.ToolTipRole: 1}
        return HEADINGS[section][roles[Qt.ItemDataRole(role)]] if role in roles else None

    def flags(self, index: Index) -> Qt.ItemFlag:
        """What can be typed into."""
        if not index.isValid():
            return Qt.ItemFlag.NoItemFlags
        read = Qt.ItemFlag.ItemIsSelectable | Qt.ItemFlag.ItemIsEnabled
        return read if index.column() == SPANS else read | Qt.ItemFlag.ItemIsEditable

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """A cell."""
        if not index.isValid():
            return None
        label = self._set.labels[index.row()]
        if role == Qt.ItemDataRole.EditRole:
            values = (label.name, label.key, label.colour, label.gesture_class, "")
            return values[index.column()]
        if role == Qt.ItemDataRole.DisplayRole:
            return self._text(label, index.column(), index.row())
        if role == Qt.ItemDataRole.TextAlignmentRole:
            return _RIGHT if index.column() == SPANS else _LEFT
        if role == Qt.ItemDataRole.DecorationRole and index.column() == COLOUR:
            return swatch_icon(label.colour)
        return None

    def _text(self, label: Label, column: int, row: int) -> str:
        if column == COLOUR:
            like = any(label.name in (pair.one, pair.other) for pair in self._alike)
            return _COLOURS.get(label.colour, label.colour) + (" (alike)" if like else "")
        texts = {
            NAME: label.name,
            KEY: native(canonical(label.key)),
            CLASS: label.gesture_class or NO_CLASS,
            SPANS: f"{self.spans_of(row):,}",
        }
        return texts[column]
