"""Question before a recording is saved that was saved elsewhere since it was opened."""

from __future__ import annotations

from typing import Literal

from PySide6.QtWidgets import QMessageBox, QPushButton, QWidget

from sd2core.recording.divergence import Divergence

Kept = Literal["mine", "theirs", "merge"]

_SAID = (
    "{title} was saved by another window or program since it was opened here: {changes}.\n\n"
    "Merge keeps what both changed, and can be undone. Take theirs gives up what is not saved"
    " here; undo brings it back. Keep mine writes over theirs."
)


def ask_what_is_kept(parent: QWidget, title: str, divergence: Divergence) -> Kept | None:
    """Ask whose changes are kept; None where the user cancels."""
    box = QMessageBox(parent)
    box.setIcon(QMessageBox.Icon.Question)
    box.setWindowTitle("Saved elsewhere as well")
    box.setText(_SAID.format(title=title, changes=", ".join(divergence.changes)))
    roles = QMessageBox.ButtonRole
    offered: dict[QPushButton, Kept] = {
        box.addButton("Merge", roles.AcceptRole): "merge",
        box.addButton("Take theirs", roles.DestructiveRole): "theirs",
        box.addButton("Keep mine", roles.DestructiveRole): "mine",
    }
    box.setDefaultButton(next(iter(offered)))
    box.addButton(QMessageBox.StandardButton.Cancel)
    box.exec()
    pressed = box.clickedButton()
    box.deleteLater()
    return next((kept for button, kept in offered.items() if button is pressed), None)
