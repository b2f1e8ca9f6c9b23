"""Commands of the terminal as forms of the window."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QObject
from PySide6.QtGui import QFontDatabase
from PySide6.QtWidgets import QPlainTextEdit, QWidget

from sd2app.commands.form import CommandForm
from sd2app.commands.model import AnyCommandRun, CommandForms
from sd2app.commands.refining import MeshRefining
from sd2app.feature import Action, Feature, Shell, report
from sd2app.manual.help import help_button
from sd2app.session.session import Session
from sd2app.widgets.dialogs import Dialog, take_room
from sd2app.widgets.layouts import column_of
from sd2app.widgets.run_panel import Button, RunPanel, RunView, RunWords
from sd2app.widgets.run_text import PHASES


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

    def __init__(self, session: Session, shell: Shell, parent: QObject) -> None:
        self._session, self._shell = session, shell
        self.forms = CommandForms(session.settings, parent)
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
