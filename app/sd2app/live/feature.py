"""Listening to a radar: dialog, process, and a recording that grows on screen."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QWidget

from sd2app.feature import Action, Feature, Shell
from sd2app.live.bar import LiveBar
from sd2app.live.dialog import ListenDialog
from sd2app.live.model import COMMAND, LiveModel
from sd2app.live.setup import ListenSetup
from sd2app.session.session import Session
from sd2app.widgets.dialogs import Answer, accepted, confirmed


class LiveFeature(Feature):
    """A radar, or a capture that is replayed, as it comes."""

    def __init__(
        self, session: Session, shell: Shell, command: Sequence[str] | None, parent: QObject
    ) -> None:
        self._session, self._shell = session, shell
        self.model = LiveModel(session, parent, command or COMMAND)
        self.model.warned.connect(shell.warn)
        self.changing = (self.model.state_changed,)
        self.closing = (self.model,)

    def actions(self) -> Sequence[Action]:
        """Listen, and stop."""
        model = self.model
        return (
            Action(
                "listen", "File", "Record…", (),
                "Record a camera and a radar together, or a radar alone, with its Doppler map",
                self._ask, lambda: not model.busy,
                why_not=lambda: "A recording is being made already" if model.busy else "",
            ),
        )  # fmt: skip

    def bars(self) -> Sequence[QWidget]:
        """What comes in, and what can be done about it."""
        return (LiveBar(self.model, self._go_on, self._show_again),)

    def _ask(self) -> None:
        window = self._shell.dialog_parent
        setup = ListenSetup(self._session.settings, window)
        listens = accepted(ListenDialog(setup, window)) and not setup.problem
        setup.deleteLater()
        if listens and self._shell.may_discard():
            self.model.start(setup.request())

    def _go_on(self) -> None:
        if self.model.on_screen or self._shell.may_discard():
            self.model.go_on()

    def _show_again(self) -> None:
        if self._shell.may_discard():
            self.model.show()

    def may_close(self) -> bool:
        """Ask whether listening may stop with the window."""
        request = self.model.request
        if not self.model.busy or request is None:
            return True
        words = f"Frames go into {request.folder.name}. What was received so far is kept."
        return confirmed(self._shell.dialog_parent, "Stop recording?", words, Answer.Close)
