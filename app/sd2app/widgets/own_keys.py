"""Fields that keep some keys for themselves, whatever these do elsewhere in the window."""

from __future__ import annotations

from collections.abc import Collection

from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent

_PLAIN = (
    Qt.KeyboardModifier.NoModifier,
    Qt.KeyboardModifier.ShiftModifier,
    Qt.KeyboardModifier.KeypadModifier,
)


def claims(event: QEvent, keys: Collection[Qt.Key] | None = None) -> bool:
    """Take a plain key, any or one of these, before it is taken for that of an action.

    To be asked first in ``event()``; True when the event is settled.
    """
    if (
        event.type() == QEvent.Type.ShortcutOverride
        and isinstance(event, QKeyEvent)
        and event.modifiers() in _PLAIN
        and (keys is None or event.key() in keys)
    ):
        event.accept()
        return True
    return False
