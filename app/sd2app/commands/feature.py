"""Commands of the terminal as forms of the window."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from dataclasses import MISSING
from functools import partial
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtGui import QFontDatabase
from PySide6.QtWidgets import QFileDialog, QPlainTextEdit, QScrollArea, QWidget

from sd2app.commands.model import AnyCommandRun, CommandForms, MeshRefining, name_of
from sd2app.feature import Action, Feature, Shell, report
from sd2app.manual.help import help_button
from sd2app.session.session import Session
from sd2app.widgets.dialogs import Dialog, take_room
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
from sd2app.widgets.run_panel import Button, RunPanel, RunView, RunWords
from sd2app.widgets.run_text import PHASES
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


class CommandRunView(RunView[AnyCommandRun]):
    """Progress of a command, and what it printed."""

    def __init__(self, forms: CommandForms, refining: MeshRefining, shell: Shell) -> None:
        words = RunWords(
            lambda run: f"sd2 {run.about.get('what', '')} · {PHASES[run.phase]}",
            lambda run: "",
            what="command",
            stop_tip="End it now",
        )
        tip = "Put the smooth mesh in the place of the one that is open; undo takes it back"
        take = Button(
            "take", "Take the mesh", tip, lambda: forms.run and refining.take(forms.run),
            refining.can_take,
        )  # fmt: skip
        super().__init__(forms, shell, words, (take,))
        self._printed = QPlainTextEdit()
        self._printed.setReadOnly(True)
        self._printed.setAccessibleName("What the command printed")
        self._printed.setFont(QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont))
        self.add((self._printed, 1))
        refining.document.changed.connect(self.refresh)

    def show_made(self, run: AnyCommandRun) -> None:
        """Show what it printed."""
        if self._printed.toPlainText() != (run.facts or ""):
            self._printed.setPlainText(run.facts or "")


class CommandWindow(Dialog):
    """A form, or the run in view; the rest of the program can be used meanwhile."""

    def __init__(
        self, forms: CommandForms, refining: MeshRefining, shell: Shell, parent: QWidget
    ) -> None:
        super().__init__("Any command", parent)
        form, run = CommandForm(forms, shell, self), CommandRunView(forms, refining, shell)
        tip, guide = "Commands that were started here", help_button("Any command", self)
        runs = RunPanel(forms, form, run, tip, new="New command", guide=guide)
        self.setLayout(column_of((runs, 1), margins_px=(8, 8, 8, 10)))
        take_room(self, 640, 680)


class CommandsFeature(Feature):
    """Window in which any command is set up, started and followed."""

    def __init__(self, session: Session, shell: Shell) -> None:
        self._session, self._shell = session, shell
        self.forms = CommandForms(session.settings, session.parent)
        self.refining = MeshRefining(session, self.forms)
        report(shell, self.forms)
        self.closing, self.running = (self.forms,), (self.forms,)  # runs go on
        self._window: CommandWindow | None = None

    def actions(self) -> Sequence[Action]:
        """The window of commands, and one of them for the mesh that is open."""
        return (
            Action(
                "refine_mesh", "File", "Make the mesh smooth…", (),
                "Take the jitter of another program's mesh away, and say how well its velocities"
                " are known (sd2 refine)",
                self._refine, why_not=lambda: self.refining.why_not,
            ),
            Action(
                "any_command", "File", "Any command…", (),
                "Any command of sd2 as a form, in the background or copied for a terminal",
                self.show,
            ),
        )  # fmt: skip

    def show(self) -> None:
        """Bring up the form of the command that was chosen last."""
        self.forms.opened = next(iter(self._session.document.paths), None)
        if self._window is None:
            shell = self._shell
            self._window = CommandWindow(self.forms, self.refining, shell, shell.dialog_parent)
        self._window.show()
        self._window.raise_()
        self._window.activateWindow()

    def _refine(self) -> None:
        self.refining.fill()
        self.show()

    def close(self) -> None:
        """Close the window; what was started goes on."""
        if self._window is not None:
            self._window.close()
        super().close()
