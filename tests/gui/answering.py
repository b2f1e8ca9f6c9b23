"""Dialogs and context menus, answered by the tests."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QPoint, Qt, QTimer
from PySide6.QtGui import QContextMenuEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QDialog, QMenu, QMessageBox, QPushButton, QWidget


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


def press_when_ready(kind: type[QDialog], text: str) -> None:
    """Have the next dialog of this kind ended by a button, as soon as it can be pressed."""

    def press(dialog: QDialog) -> None:
        named = (one for one in dialog.findChildren(QPushButton) if one.text() == text)
        button = next(named)
        if button.isEnabled():
            QTest.mouseClick(button, Qt.MouseButton.LeftButton)
        else:
            QTimer.singleShot(20, lambda: press(dialog))

    once_asked(kind, press)


def menu_at(view: QWidget, place: QPoint) -> QMenu:
    """Context menu that a right click on a widget brings up."""
    QTest.mouseClick(view, Qt.MouseButton.RightButton, pos=place)
    # Which follows a click in a window of the system, and not always in one of a test.
    reason = QContextMenuEvent.Reason.Mouse
    QApplication.sendEvent(view, QContextMenuEvent(reason, place, view.mapToGlobal(place)))
    return view.findChildren(QMenu, options=Qt.FindChildOption.FindDirectChildrenOnly)[-1]


def texts_of(menu: QMenu) -> list[str]:
    """Entries of a menu, without letters and lines."""
    return [one.text().replace("&", "") for one in menu.actions() if not one.isSeparator()]


def pick(menu: QMenu, *texts: str) -> None:
    """Choose an entry of a menu, or of a menu in it, and close the menu."""
    within = menu
    for text in texts:
        action = next(one for one in within.actions() if one.text().replace("&", "") == text)
        within = action.menu()
    action.trigger()
    menu.close()
