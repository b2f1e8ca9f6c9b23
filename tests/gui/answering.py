"""Dialogs that stop everything until they are answered, answered by the tests."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QApplication, QDialog, QMessageBox


def once_asked(kind: type[QDialog], work: Callable[[Any], object]) -> None:
    """Call ``work(dialog)`` as soon as a dialog of this kind is up."""

    def look() -> None:
        dialog = QApplication.activeModalWidget()
        if isinstance(dialog, kind):
            work(dialog)
        else:
            QTimer.singleShot(20, look)

    QTimer.singleShot(20, look)


def answer(qtbot, text: str, asked: list[str] | None = None) -> None:
    """Have the next question answered with the button of this text, and noted in a list."""

    def click(box: QMessageBox) -> None:
        if asked is not None:
            asked.append(box.text())
        found = next(one for one in box.buttons() if one.text().replace("&", "") == text)
        qtbot.mouseClick(found, Qt.MouseButton.LeftButton)

    once_asked(QMessageBox, click)
