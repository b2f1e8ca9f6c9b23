"""Question of what becomes of a training when the window closes."""

from __future__ import annotations

from PySide6.QtWidgets import QCheckBox, QMessageBox, QWidget

from sd2app.training.model import TrainingModel


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
