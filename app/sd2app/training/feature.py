"""Training of denoisers in a background process."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QCheckBox, QMessageBox, QWidget

from sd2app.denoise.model import DenoiseModel
from sd2app.feature import Action, Feature, Shell, report
from sd2app.session.session import Session
from sd2app.training.model import COMMAND, TrainingModel
from sd2app.training.panel import TrainingPanel
from sd2app.training.result import ModelAdoption
from sd2core.denoise.files import user_models_folder


def may_leave(training: TrainingModel, parent: QWidget) -> bool:
    """True if the window may close; decides on a run under way."""
    run = training.to_be_left()
    if run is None or run.phase in ("stopping", "cancelling"):
        return True  # it ends by itself
    if training.closing == "ask":
        return _ask_what_becomes(training, run.folder.path.name, parent)
    if training.closing == "stop":
        training.tell("stop")
    return True


def _ask_what_becomes(training: TrainingModel, name: str, parent: QWidget) -> bool:
    box = QMessageBox(parent)
    box.setIcon(QMessageBox.Icon.Question)
    box.setWindowTitle("A training is under way")
    box.setText(f"{name} is being trained.")
    box.setInformativeText(
        "It needs no window: it can go on in the background, and is found again when the"
        " program is started the next time."
    )
    roles = QMessageBox.ButtonRole
    keep = box.addButton("Keep training in the background", roles.AcceptRole)
    stop = box.addButton("Stop and keep the best", roles.AcceptRole)
    discard = box.addButton("Cancel and discard", roles.DestructiveRole)
    stay = box.addButton("Don't close", roles.RejectRole)
    box.setDefaultButton(keep)
    box.setEscapeButton(stay)
    always = QCheckBox("Do so every time, unless it is to be discarded", box)
    box.setCheckBox(always)
    box.exec()
    chosen = box.clickedButton()
    box.deleteLater()
    if chosen is discard:
        training.tell("cancel")
    elif chosen is stop:
        training.tell("stop")
    elif chosen is not keep:
        return False
    if always.isChecked() and chosen is not discard:
        training.set_closing("stop" if chosen is stop else "keep")
    return True


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
