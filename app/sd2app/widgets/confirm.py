"""Questions with two answers."""

from __future__ import annotations

from PySide6.QtWidgets import QMessageBox, QWidget


def may_delete(parent: QWidget, title: str, what: str) -> bool:
    """Whether something may be deleted; Escape and Return keep it."""
    buttons = QMessageBox.StandardButton
    either = buttons.Discard | buttons.Cancel
    answer = QMessageBox.question(parent, title, what, either, buttons.Cancel)
    return bool(answer == buttons.Discard)
