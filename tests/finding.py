"""Widgets as a user, or a screen reader, finds them: by what they say and are called."""

from __future__ import annotations

from typing import TypeVar

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QAbstractButton, QFrame, QLabel, QSplitter, QWidget

W = TypeVar("W", bound=QWidget)


def named(parent: QWidget, name: str, kind: type[W] = QWidget) -> W:
    """The widget in another whose accessible name begins so."""
    (found,) = (one for one in parent.findChildren(kind) if one.accessibleName().startswith(name))
    return found


def button_of(parent: QWidget, text: str) -> QAbstractButton:
    """The button in a widget with a text, whichever letter of it is underlined."""
    buttons = parent.findChildren(QAbstractButton)
    (found,) = (one for one in buttons if one.text().replace("&", "") == text)
    return found


def panel_of(window: QWidget, name: str) -> QFrame:
    """The part of the main window with a name such as scene or tracks."""
    return named(window, name.capitalize(), QFrame)


def words_in(parent: QWidget, role: str) -> list[str]:
    """Sentences on screen that are shown in a role, e.g. as a warning."""
    labels = parent.findChildren(QLabel, role)
    return [one.text() for one in labels if one.isVisible()]


def splitter_around(widget: QWidget, direction: Qt.Orientation) -> QSplitter:
    """The nearest splitter of a direction that a widget lies in."""
    around = widget.parentWidget()
    while not (isinstance(around, QSplitter) and around.orientation() == direction):
        around = around.parentWidget()
    return around
