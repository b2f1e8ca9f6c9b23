"""Dialogs of the Train panel: pairs, runs, and what becomes of one when the window closes."""

from __future__ import annotations

from PySide6.QtWidgets import QCheckBox, QMessageBox

from sd2app.feature import Shell
from sd2app.session.document import DocumentModel
from sd2app.training.model import TrainingModel
from sd2app.widgets.dialogs import ask_folder


class TrainingDialogs:
    """Dialogs, followed by calls of the model."""

    def __init__(self, shell: Shell, training: TrainingModel, document: DocumentModel) -> None:
        self.shell, self._training, self._document = shell, training, document
        self._parent = shell.dialog_parent

    def ask_store(self) -> None:
        """Let the user choose a store of pairs."""
        if path := ask_folder(self._parent, "Folder of pairs to learn from"):
            self._training.setup.add(path)

    @property
    def why_not_this(self) -> str:
        """Reason why no pairs can be made of the open recording; empty where they can."""
        recording = self._document.recording
        if self._training.pair_maker.out is not None:
            return "Pairs are being made"
        if recording is None or recording.mesh is None or recording.radar is None:
            return "It takes a recording with a mesh and a radar capture"
        return "Save the recording first" if self._document.modified else ""

    def make_of_this(self) -> None:
        """Make pairs of the open recording."""
        recording = self._document.recording
        if recording is not None:
            self.shell.attempt(lambda: self._training.make_pairs(recording.folder))

    def ask_recordings(self) -> None:
        """Let the user choose recordings to make pairs of."""
        if path := ask_folder(self._parent, "A recording, or a folder of some"):
            self.shell.attempt(lambda: self._training.make_pairs(path))

    def open_run(self) -> None:
        """Let the user choose a run in another folder, such as one started in a terminal."""
        if path := ask_folder(self._parent, "Folder of a run"):
            self.shell.attempt(lambda: self._training.open_run(path))

    def may_leave(self) -> bool:
        """True if the window may close; decides on a run under way."""
        training = self._training
        run = training.to_be_left()
        if run is None or run.phase in ("stopping", "cancelling"):
            return True  # it ends by itself
        if training.closing == "ask":
            return self._ask_what_becomes(training, run.folder.path.name)
        if training.closing == "stop":
            training.tell("stop")
        return True

    def _ask_what_becomes(self, training: TrainingModel, name: str) -> bool:
        box = QMessageBox(self._parent)
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
