"""Form of a protocol: people, gestures, order, seconds and consent, as a file of its own."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, QSignalBlocker, Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QDialogButtonBox,
    QHeaderView,
    QLabel,
    QLayout,
    QMessageBox,
    QPlainTextEdit,
    QWidget,
)

from sd2app.manual.help import with_help
from sd2app.widgets.dialogs import Answer, Dialog, accepting, ask_file, ask_new, confirmed
from sd2app.widgets.inputs import Choice, NumberBox, TypedLine, option_box
from sd2app.widgets.layouts import STRETCH, column_of, form_of, row_of
from sd2app.widgets.panel import outlined, say, sentence
from sd2app.widgets.record_table import Heading, Index, RecordTableModel
from sd2app.widgets.table import ROW_PX, CellTable, FramedCells
from sd2core.errors import Sd2Error
from sd2core.files.tables import capitalised, counted
from sd2core.labels.label_set import GESTURES
from sd2core.live.protocol import (
    PAPER,
    Gesture,
    Protocol,
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
        if rows != self.rows:
            self.show_rows(rows)

    def _text(self, record: Gesture, column: int) -> str:
        if column != CLASS or record.gesture_class:
            return str(getattr(record, _FIELDS[column]))
        known = GESTURES.find(record.name)
        return known.gesture_class if known else record.name

    def _edited_text(self, record: Gesture, column: int) -> str:
        return str(getattr(record, _FIELDS[column]))


TOML = "Protocol of a session (*.toml);;All files (*)"
_CHOICES = {
    "fixed": "as listed",
    "random": "at random",
    "keep": "kept",
    "blur": "head covered once a body was fitted",
    "drop": "deleted once a body was fitted",
}
"""Words of the values of options; others are shown as they are."""
_ROWS_SHOWN, _LINES_SHOWN = 5, 5


class ProtocolDialog(Dialog):
    """A view of :class:`ProtocolDraft`; accepted once it was saved."""

    def __init__(self, draft: ProtocolDraft, parent: QWidget) -> None:
        super().__init__("Protocol", parent)
        self._draft = draft
        self._refreshers: list[Callable[[], None]] = []
        self._rows = GestureRows(draft, self)
        self._table = _table(self._rows, self)
        self._less = outlined("Remove", "Remove the gesture of the current row", self._remove, self)
        self._up = outlined("Up", "Put it earlier", lambda: self._move(-1), self)
        self._down = outlined("Down", "Put it later", lambda: self._move(1), self)
        add = outlined("Add", "Add a gesture", self._add, self)
        self._table.selectionModel().currentRowChanged.connect(self._refresh)
        self._message = sentence("")
        buttons, self._save = accepting(self, "Save…")
        other = QDialogButtonBox.ButtonRole.ResetRole
        buttons.addButton("Open…", other).clicked.connect(self._open)
        buttons.addButton("The paper's", other).clicked.connect(lambda: self._take(PAPER))
        self._seed = self._number("seed", "")
        form = form_of(
            ("Title", self._line("title", str, str.strip)),
            ("People", self._line("people", ", ".join, _names)),
            ("Gestures", column_of(
                (self._table, 1),
                row_of(add, self._less, self._up, self._down, STRETCH, spacing_px=6),
                spacing_px=6,
            )),
            ("Rounds", self._row(self._number("repetitions", ""), "gestures",
                                 self._choice("order"), "by seed", self._seed)),
            ("Times", self._row("stand still", self._number("countdown_s", " s", 1), "move",
                                  self._number("take_s", " s", 1), "rest",
                                  self._number("pause_s", " s", 1))),
            ("Reaction", self._row(self._number("reaction_s", " s", 2, 0.05),
                                   "after the prompt, at the earliest")),
            ("Video", self._row(self._choice("video"))),
            ("Consent", self._text("consent")),
            gaps_px=(16, 10),
        )  # fmt: skip
        foot = with_help("Protocol", buttons)
        self.setLayout(column_of((form, 1), self._message, foot, spacing_px=16, margins_px=16))
        draft.changed.connect(self._refresh)
        self._refresh()
        self.resize(720, self.minimumSizeHint().height() + 40)

    # --- fields ---------------------------------------------------------------------------

    def _line(
        self, name: str, written: Callable[..., str], read: Callable[[str], object]
    ) -> TypedLine:
        line = TypedLine(name.capitalize(), option_named(Protocol, name).sentence, self)
        line.typed.connect(lambda text: self._draft.set(name, read(text)))

        def refresh() -> None:
            value = self._draft.value(name)
            if read(line.text()) != value:  # a comma that was just typed stays
                line.show_text(written(value))

        self._refreshers.append(refresh)
        return line

    def _number(self, name: str, suffix: str, decimals: int = 0, step: float = 0) -> NumberBox:
        box = option_box(Protocol, name, suffix, decimals=decimals, step=step or 1)
        kind = option_named(Protocol, name).kind
        box.valueChanged.connect(lambda value: self._draft.set(name, kind(value)))
        self._refreshers.append(lambda: box.show_value(self._draft.value(name)))
        return box

    def _choice(self, name: str) -> Choice:
        option = option_named(Protocol, name)
        texts = {one: _CHOICES.get(one, one) for one in option.choices}
        choice = Choice(option.sentence, self, texts, partial(self._draft.set, name))
        self._refreshers.append(lambda: choice.show_value(self._draft.value(name)))
        return choice

    def _text(self, name: str) -> QPlainTextEdit:
        tip = option_named(Protocol, name).sentence
        text = QPlainTextEdit(self)
        text.setToolTip(tip)
        text.setAccessibleName(tip)
        text.setTabChangesFocus(True)
        text.setMinimumHeight(_LINES_SHOWN * text.fontMetrics().lineSpacing() + 12)
        text.textChanged.connect(lambda: self._draft.set(name, text.toPlainText()))

        def refresh() -> None:
            if text.toPlainText() != self._draft.value(name):
                with QSignalBlocker(text):
                    text.setPlainText(self._draft.value(name))

        self._refreshers.append(refresh)
        return text

    def _row(self, *parts: QWidget | str) -> QLayout:
        made = (QLabel(one, self) if isinstance(one, str) else one for one in parts)
        return row_of(*made, STRETCH, spacing_px=8)

    # --- what the buttons do --------------------------------------------------------------

    def _add(self) -> None:
        index = self._rows.index(self._rows.add(), NAME)
        self._table.setCurrentIndex(index)
        self._table.setFocus()
        self._table.edit(index)

    def _remove(self) -> None:
        row = self._table.currentIndex().row()
        self._rows.remove(row)
        self._table.setCurrentIndex(self._rows.index(min(row, self._rows.rowCount() - 1), NAME))

    def _move(self, towards: int) -> None:
        index = self._table.currentIndex()
        self._rows.move(index.row(), towards)
        self._table.setCurrentIndex(index.siblingAtRow(index.row() + towards))

    def _open(self) -> None:
        if path := ask_file(self, "Open protocol", TOML, str(self._draft.path or "")):
            self._take(path)

    def _take(self, source: Path | str) -> None:
        if self._may_discard():
            self._attempt(lambda: self._draft.open(source))

    def accept(self) -> None:
        """Save it under a name, and end."""
        start = str(self._draft.path or f"{_file_name(self._draft.value('title'))}.toml")
        path = ask_new(self, "Save protocol", start, TOML, ".toml")
        if path and self._attempt(lambda: self._draft.save(path)):
            super().accept()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Let Return take what was typed, and end nothing."""
        if event.key() not in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            super().keyPressEvent(event)

    def reject(self) -> None:
        """End without saving."""
        if self._may_discard():
            super().reject()

    def _may_discard(self) -> bool:
        words = "What was changed in the protocol is lost."
        return not self._draft.modified or confirmed(
            self, "Discard changes?", words, Answer.Discard, usual=Answer.Cancel
        )

    def _attempt(self, work: Callable[[], object]) -> bool:
        try:
            work()
        except (Sd2Error, OSError) as error:
            QMessageBox.warning(self, "Protocol", str(error))
            return False
        return True

    # --- following ------------------------------------------------------------------------

    def _refresh(self) -> None:
        for refresh in self._refreshers:
            refresh()
        draft, row, rows = self._draft, self._table.currentIndex().row(), self._rows.rowCount()
        name = draft.path.name if draft.path else "the paper's"
        self.setWindowTitle(f"Protocol: {name}{' (changed)' if draft.modified else ''}")
        problem = draft.problem
        say(self._message, problem or draft.summary, "warning" if problem else "muted")
        self._seed.setEnabled(draft.value("order") == "random")
        self._save.setEnabled(not problem)
        self._less.setEnabled(row >= 0)
        self._up.setEnabled(row > 0)
        self._down.setEnabled(0 <= row < rows - 1)


def _table(rows: GestureRows, parent: QWidget) -> CellTable:
    table = CellTable("Gestures", parent=parent)
    table.setModel(rows)
    table.setItemDelegate(FramedCells(table))
    table.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
    table.setMinimumHeight((_ROWS_SHOWN + 1) * ROW_PX + 8)
    header = table.horizontalHeader()
    header.setStretchLastSection(False)
    header.setSectionResizeMode(INSTRUCTION, QHeaderView.ResizeMode.Stretch)
    wide = {NAME: "right-to-left-again", CLASS: "horizontally"}
    for column, text in wide.items():
        table.setColumnWidth(column, table.fontMetrics().horizontalAdvance(text) + 16)
    table.setTextElideMode(Qt.TextElideMode.ElideRight)
    return table


def _names(text: str) -> list[str]:
    """Names that stand after one another, with commas or spaces between."""
    return [one for one in re.split(r"[,;\s]+", text) if one]


def _file_name(title: str) -> str:
    return re.sub(r"[^\w-]+", "-", title.lower()).strip("-") or "protocol"
