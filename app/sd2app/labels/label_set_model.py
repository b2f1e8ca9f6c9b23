"""The label set as the rows of a table that edits it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from PySide6.QtCore import QObject, Qt
from PySide6.QtGui import QIcon

from sd2app.feature import Keys
from sd2app.labels.edits import LabelEdits
from sd2app.widgets.icons import swatch_icon
from sd2app.widgets.record_table import Choosable, Heading, Index, RecordTableModel
from sd2app.widgets.text import canonical, native
from sd2core.labels.colours import OFFERED, Alike, alike
from sd2core.labels.edits import Edit, Edits
from sd2core.labels.field_edits import (
    CLASSES,
    add_label,
    change_label,
    move_label,
    new_label,
    remove_label,
    set_label_set,
)
from sd2core.labels.label_set import Label, LabelSet

NAME, KEY, COLOUR, CLASS, SPANS = range(5)
HEADINGS = (
    Heading("Label", "Name; renaming it also renames it on its spans", editable=True),
    Heading("Key", "Character that marks with it", editable=True),
    Heading(
        "Colour", "Colour of its spans; colours that look alike are noted below", editable=True
    ),
    Heading("Class", "Class that the classifier learns for it; – for none", editable=True),
    Heading("Spans", "Number of spans with this label", number=True),
)
_FIELDS = ("name", "key", "colour", "gesture_class")
NO_CLASS, OTHER = "–", "other"
_COLOURS = {colour: name for name, colour in OFFERED}


class LabelSetModel(RecordTableModel[Label]):
    """A row per label. Every change is one step; an invalid one is refused with a reason."""

    def __init__(self, edits: LabelEdits, keys: Keys, parent: QObject | None = None) -> None:
        super().__init__(HEADINGS, parent)
        self._labels, self._apply, self._keys = edits.labels, edits.apply, keys
        self.rows = self.label_set.labels
        self._counts: Counter[str] = Counter()
        self._alike: tuple[Alike, ...] = ()
        self._labels.changed.connect(self._follow)

    @property
    def warnings(self) -> str:
        """Sentences on labels whose colours look alike; empty without any."""
        return " ".join(f"{one.words()}." for one in self._alike)

    @property
    def label_set(self) -> LabelSet:
        """The set that is edited."""
        return self._labels.labels.label_set

    def spans_of(self, row: int) -> int:
        """Return the number of spans with a label."""
        return self._counts[self.label_set.labels[row].name]

    def choices_at(self, index: Index) -> Sequence[Choosable]:
        """Classes that a label can have, or colours: the palette, others in use, any other."""
        used = {str(getattr(one, _FIELDS[index.column()])) for one in self.rows}
        if index.column() == CLASS:
            named = ["", *CLASSES, *sorted(used.difference(CLASSES, {""}))]
            return [Choosable(one or NO_CLASS, one) for one in named]
        if index.column() == COLOUR:
            others = ((colour, colour) for colour in sorted(used.difference(_COLOURS)))
            offered = [Choosable(name, one, swatch_icon(one)) for name, one in (*OFFERED, *others)]
            return [*offered, Choosable("Other…", OTHER)]
        return ()

    def add(self) -> bool:
        """Add a label with a name, a colour and a key not yet in use."""
        made = new_label(self.label_set)
        if made.key and self._keys.owner(made.key):
            made = replace(made, key="")
        return self._apply(lambda now: add_label(now.labels, made))

    def move(self, row: int, towards: int) -> bool:
        """Put a label one place up (-1) or down (1)."""
        name = self.label_set.labels[row].name
        return self._apply(lambda now: move_label(now.labels, name, row + towards))

    def remove(self, row: int, instead: str | None = None) -> bool:
        """Remove a label; its spans keep it, or get another one."""
        name = self.label_set.labels[row].name
        return self._apply(lambda now: remove_label(now.labels, name, instead))

    def use(self, label_set: LabelSet) -> bool:
        """Use another label set."""
        return self._apply(lambda now: set_label_set(now.labels, label_set))

    def setData(self, index: Index, value: Any, role: int = Qt.ItemDataRole.EditRole) -> bool:
        """Make the edit typed; False, with the cell unchanged, where it was refused."""
        name, text = self.label_set.labels[index.row()].name, str(value).strip()
        if text == self.data(index, Qt.ItemDataRole.EditRole):
            return False
        field = _FIELDS[index.column()]

        def change(now: Edits) -> Edit:
            given = self._keys.for_label(name, text) if field == "key" and text else text
            given = text.lower() if field == "colour" else given
            return change_label(now.labels, name, **{field: given})

        return self._apply(change)

    def _refresh(self) -> None:
        labels = self._labels.labels
        self._counts = Counter(span.label for span in labels.spans)
        self._alike = alike(labels.label_set.labels)
        self.show_rows(labels.label_set.labels)

    def _text(self, record: Label, column: int) -> str:
        if column == COLOUR:
            like = any(record.name in (pair.one, pair.other) for pair in self._alike)
            return _COLOURS.get(record.colour, record.colour) + (" (alike)" if like else "")
        texts = {
            NAME: record.name,
            KEY: native(canonical(record.key)),
            CLASS: record.gesture_class or NO_CLASS,
            SPANS: f"{self._counts[record.name]:,}",
        }
        return texts[column]

    def _edited_text(self, record: Label, column: int) -> str:
        return "" if column == SPANS else str(getattr(record, _FIELDS[column]))

    def _icon(self, record: Label, column: int) -> QIcon | None:
        return swatch_icon(record.colour) if column == COLOUR else None
