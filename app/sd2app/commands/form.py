"""Form of any command: a field for each of its options, made from its record."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import MISSING
from functools import partial
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog, QScrollArea, QWidget

from sd2app.commands.model import CommandForms, name_of
from sd2app.feature import Shell
from sd2app.widgets.inputs import CheckBox, Choice, TypedLine
from sd2app.widgets.layouts import STRETCH, column_of, form_of, pane, row_of
from sd2app.widgets.panel import (
    Fold,
    copy_button,
    outlined,
    sentence,
    show_words,
    side_by_side,
    title,
)
from sd2core.files.tables import capitalised
from sd2core.options.records import Option


class CommandForm(QWidget):
    """Choice of a command, its form, and the buttons to start it or to copy it."""

    def __init__(self, forms: CommandForms, shell: Shell, parent: QWidget) -> None:
        super().__init__(parent)
        self._forms, self._shell = forms, shell
        self._shown = ""
        self._refreshers: list[Callable[[], None]] = []
        self._left = set[str]()  # fields that the keyboard was in, and is not any more
        texts = {one.name: one.name for one in forms.commands.values()}
        self._choice = Choice("Command", self, texts, forms.choose)
        self._choice.setMaxVisibleItems(20)
        self._about = sentence("")
        self._area = QScrollArea()
        self._area.setWidgetResizable(True)
        self._area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._problem, self._line = sentence("", "warning"), sentence("", "plain")
        attempt = shell.attempt
        tip = "In the background; the window can be used meanwhile"
        self._start = outlined("Start", tip, partial(attempt, forms.start), self, look="primary")
        self._copy = copy_button(lambda: forms.line, self)
        buttons = side_by_side(self._start, self._copy, spacing_px=6)
        head = row_of(title("Command"), (self._choice, 1), spacing_px=8)
        foot = self._problem, self._line, buttons
        parts = head, self._about, (self._area, 1), *foot
        self.setLayout(column_of(*parts, spacing_px=8, margins_px=0))
        forms.changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Follow the model: another command has another form."""
        forms = self._forms
        if forms.chosen.name != self._shown:
            self._shown = forms.chosen.name
            self._build()
        self._choice.show_value(forms.chosen.name)
        for refresh in self._refreshers:
            refresh()
        problem, missing = forms.problem, forms.missing
        # Nobody is told of a field before having come to it.
        ahead = missing is not None and missing.dest not in self._left
        show_words(self._problem, forms.wrong if ahead else problem)
        show_words(self._line, "" if problem else forms.line)
        reasons = (self._start, problem or forms.busy), (self._copy, problem)
        for button, why_not in reasons:
            button.setEnabled(not why_not)
            button.setToolTip(why_not or button.accessibleDescription())

    def _leave(self, field: str) -> None:
        self._left.add(field)
        self.refresh()

    def _build(self) -> None:
        options = self._forms.options
        summary = self._forms.chosen.summary
        self._about.setText(f"{capitalised(summary)}.")
        self._refreshers = []
        needed = [one for one in options if one.place.argument or one.default is MISSING]
        outputs = [one for one in options if one.name == "out" and one not in needed]
        first = [*needed, *outputs]
        parts: list[QWidget | int] = [self._rows(first)] if first else []
        rest = [one for one in options if one not in first]
        for group in dict.fromkeys(one.group for one in rest):
            rows = self._rows([one for one in rest if one.group == group])
            heading = "More options" if group is None else group.title
            about = (group.text if group is not None else None) or "What is empty is as by default"
            parts += [Fold(capitalised(heading), about, rows, self), rows]
        inside = QWidget()
        inside.setLayout(column_of(*parts, STRETCH, spacing_px=8, margins_px=8))
        self._area.setWidget(inside)
        self._left = set()  # after the one before is gone, whose field may have had the keyboard

    def _rows(self, options: list[Option]) -> QWidget:
        return pane(form_of(*((name_of(one), self._field(one)) for one in options)))

    def _field(self, option: Option) -> QWidget:
        forms, name = self._forms, name_of(option)
        tip = option.sentence
        if option.kind is bool:
            box = CheckBox("", self, lambda on: forms.set_text(option, "yes" if on else ""), tip)
            box.setAccessibleName(name)
            self._refreshers.append(lambda: box.show_checked(bool(forms.text(option))))
            return box
        if option.choices and not option.place.many:
            usual = "" if option.default in (None, MISSING) else f" ({option.default})"
            texts = {"": f"as by default{usual}", **{str(one): str(one) for one in option.choices}}
            choice = Choice(tip, self, texts, partial(forms.set_text, option))
            self._refreshers.append(lambda: choice.show_value(forms.text(option)))
            return choice
        line = TypedLine(name, tip, self)
        line.setPlaceholderText(option.words)
        line.typed.connect(partial(forms.set_text, option))
        line.ended.connect(partial(self._leave, option.dest))
        self._refreshers.append(lambda: line.show_text(forms.text(option)))
        if option.kind is not Path:
            return line
        ask = partial(self._ask, option)
        return pane(row_of((line, 1), outlined("Choose…", tip, ask, self), spacing_px=6))

    def _ask(self, option: Option) -> None:
        """Let the user choose a file; one that is to be written may not exist yet."""
        dialog, heading = self._shell.dialog_parent, name_of(option)
        if option.name == "out" or option.place.endings:
            name, _ = QFileDialog.getSaveFileName(dialog, heading)
        else:
            name, _ = QFileDialog.getOpenFileName(dialog, heading)
        if name and option.place.many:
            name = f"{self._forms.text(option)} {shlex.quote(name)}".strip()
        if name:
            self._forms.set_text(option, name)
