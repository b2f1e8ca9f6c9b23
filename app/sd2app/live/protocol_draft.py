"""A protocol that is made or edited, valid or not yet, and its gestures as rows of a table."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, Qt, Signal

from sd2app.widgets.record_table import Heading, Index, RecordTableModel
from sd2core.errors import Sd2Error
from sd2core.files.tables import capitalised, counted
from sd2core.labels.label_set import GESTURES
from sd2core.live.protocol import (
    PAPER,
    Gesture,
    content_of,
    protocol_of,
    read_protocol,
    write_protocol,
)
from sd2core.options.records import option_named

NAME, INSTRUCTION, CLASS = range(3)
_FIELDS = ("name", "instruction", "gesture_class")
_HEADINGS = tuple(
    Heading(text, option_named(Gesture, name).sentence, editable=True)
    for text, name in zip(("Gesture", "Instruction", "Class"), _FIELDS, strict=True)
)


class ProtocolDraft(QObject):
    """Values of a protocol as they are typed, at first those of a file or of the bundled one."""

    changed = Signal()

    def __init__(self, source: Path | str, parent: QObject) -> None:
        super().__init__(parent)
        self.path: Path | None = None
        self.modified = False
        self._content: dict[str, Any] = {}
        self.open(source)

    def open(self, source: Path | str) -> None:
        """Take over another protocol; raises Sd2Error where it cannot be read."""
        self._content = content_of(read_protocol(source))
        self.path = None if source == PAPER else Path(source)
        self.modified = False
        self.changed.emit()

    def save(self, path: Path) -> None:
        """Write it, if nothing is wrong with it."""
        write_protocol(path, protocol_of(self._content))
        self.path, self.modified = path, False
        self.changed.emit()

    def value(self, name: str) -> Any:
        """Value of a field of :class:`Protocol`; people and gestures are lists."""
        return self._content[name]

    def set(self, name: str, value: Any) -> None:
        """Set a field."""
        if value != self._content[name]:
            self._content[name] = value
            self.modified = True
            self.changed.emit()

    @property
    def problem(self) -> str:
        """Why it cannot be saved, empty if it can."""
        try:
            protocol_of(self._content)
        except Sd2Error as error:
            words = error.found.removeprefix("The protocol: ")
            if at := re.match(r"(people|gestures)\.(\d+)(?:\.(\w+))?", words):
                what = {"people": "person", "gestures": "gesture"}[at[1]]
                which = f"{what} {int(at[2]) + 1}"  # counted from one
                words = (
                    f"{which}: {at[3]}{words[at.end() :]}" if at[3] else which + words[at.end() :]
                )
            return f"{capitalised(words)}."
        return ""

    @property
    def summary(self) -> str:
        """How many takes there are, and how long they take; empty while something is wrong."""
        try:
            protocol = protocol_of(self._content)
        except Sd2Error:
            return ""
        takes = len(protocol.takes)
        take_s = protocol.countdown_s + protocol.take_s
        pauses = takes - len(protocol.people)
        minutes = max(round((takes * take_s + pauses * protocol.pause_s) / 60), 1)
        first = protocol.takes[0].name
        return (
            f"{counted(takes, 'take')}, about {counted(minutes, 'minute')} and the time that"
            f" people take to come; the first is {first}."
        )


class GestureRows(RecordTableModel[Gesture]):
    """A row per gesture of a draft."""

    def __init__(self, draft: ProtocolDraft, parent: QObject) -> None:
        super().__init__(_HEADINGS, parent)
        self._draft = draft
        draft.changed.connect(self._refresh)
        self._refresh()

    def add(self) -> int:
        """Add a gesture with a free name; return its row."""
        names = {one.name for one in self.rows}
        free = (f"gesture-{number}" for number in range(1, len(names) + 2))
        name = next(one for one in free if one not in names)
        self._set([*self.rows, Gesture(name=name, instruction="")])
        return len(self.rows) - 1

    def remove(self, row: int) -> None:
        """Remove a gesture."""
        self._set([*self.rows[:row], *self.rows[row + 1 :]])

    def move(self, row: int, towards: int) -> None:
        """Put a gesture one place up (-1) or down (1)."""
        rows = [*self.rows]
        rows.insert(row + towards, rows.pop(row))
        self._set(rows)

    def setData(self, index: Index, value: Any, role: int = Qt.ItemDataRole.EditRole) -> bool:
        """Take what was typed."""
        rows = [*self.rows]
        fields = vars(rows[index.row()]) | {_FIELDS[index.column()]: str(value).strip()}
        rows[index.row()] = Gesture(**fields)
        self._set(rows)
        return True

    def _set(self, rows: Sequence[Gesture]) -> None:
        self._draft.set("gestures", [dict(vars(one)) for one in rows])

    def _refresh(self) -> None:
        rows = tuple(Gesture(**one) for one in self._draft.value("gestures"))
        if len(rows) != len(self.rows):
            self.beginResetModel()
            self.rows = rows
            self.endResetModel()
        elif rows != self.rows:
            self.rows = rows
            self.dataChanged.emit(self.index(0, 0), self.index(len(rows) - 1, CLASS))

    def _text(self, record: Gesture, column: int) -> str:
        if column != CLASS or record.gesture_class:
            return str(getattr(record, _FIELDS[column]))
        known = GESTURES.find(record.name)
        return known.gesture_class if known else record.name

    def _edited_text(self, record: Gesture, column: int) -> str:
        return str(getattr(record, _FIELDS[column]))
