"""Commands of the terminal as forms of the window."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QObject

from sd2app.commands.model import CommandForms
from sd2app.commands.refining import MeshRefining
from sd2app.commands.window import CommandWindow
from sd2app.feature import Action, Feature, Shell, report
from sd2app.session.session import Session


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
                self._refine, lambda: not self.refining.why_not,
                why_not=lambda: self.refining.why_not,
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
