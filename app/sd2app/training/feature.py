"""Training of denoisers in a background process."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QWidget

from sd2app.denoise.model import DenoiseModel
from sd2app.feature import Action, Feature, Shell, report
from sd2app.session.session import Session
from sd2app.training.dialogs import may_leave
from sd2app.training.model import COMMAND, TrainingModel
from sd2app.training.panel import TrainingPanel
from sd2app.training.result import ModelAdoption
from sd2core.denoise.files import user_models_folder


class TrainingFeature(Feature):
    """Runs that train denoisers, and the use of what they made."""

    def __init__(
        self,
        session: Session,
        shell: Shell,
        denoise: DenoiseModel,
        command: Sequence[str] | None,
        parent: QObject,
    ) -> None:
        self._session, self._shell = session, shell
        self.model = TrainingModel(session.settings, parent, command or COMMAND)
        self.adoption = ModelAdoption(self.model, denoise, session.maps, user_models_folder, parent)
        report(shell, self.model, self.adoption)
        self.closing, self.running = (self.adoption, self.model), (self.model,)  # runs go on

    def actions(self) -> Sequence[Action]:
        """The panel."""
        return (
            Action(
                "show_train", "View", "Train panel", ("Shift+T",),
                "Train a denoiser in the background, watch it, and use it",
                lambda: self._shell.bring_up("Train", "Denoiser"),
            ),
        )  # fmt: skip

    def panel(self) -> QWidget:
        """Page of the Train panel."""
        s = self._session
        return TrainingPanel(self.model, self.adoption, s.display, s.document, self._shell)

    def may_close(self) -> bool:
        """Ask what becomes of a run under way."""
        return may_leave(self.model, self._shell.dialog_parent)
