"""The size of the window, which fits its screen."""

from __future__ import annotations

from PySide6.QtCore import QByteArray, QRect, QSize
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QWidget

_SHARE = 0.8
_LEAST_PX = QSize(960, 640)
_OFF_SCREEN_PX = QSize(1280, 800)


def place_on_screen(window: QWidget, remembered: QByteArray | None) -> None:
    """Put a window where it was left or, at first, in the middle; always within its screen."""
    if remembered is not None:
        window.restoreGeometry(remembered)
    if QGuiApplication.platformName() == "offscreen":  # whose screen says nothing
        window.setMinimumSize(_LEAST_PX)
        if remembered is None:
            window.resize(_OFF_SCREEN_PX)
        return
    room = window.screen().availableGeometry()
    window.setMinimumSize(_LEAST_PX.boundedTo(room.size()))
    if not window.isMaximized():
        window.setGeometry(fitting(window.geometry() if remembered is not None else None, room))


def fitting(wanted: QRect | None, room: QRect) -> QRect:
    """A rectangle cut to a screen's room and moved into it; by default 80 % in the middle."""
    if wanted is None:
        place = QRect(room.topLeft(), (room.size() * _SHARE).expandedTo(_LEAST_PX))
        place.setSize(place.size().boundedTo(room.size()))
        place.moveCenter(room.center())
        return place
    place = QRect(wanted.topLeft(), wanted.size().boundedTo(room.size()))
    place.moveLeft(min(max(place.left(), room.left()), room.right() + 1 - place.width()))
    place.moveTop(min(max(place.top(), room.top()), room.bottom() + 1 - place.height()))
    return place
