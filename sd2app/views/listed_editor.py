"""Editors in the cells of a table; what is typed there is nobody else's."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QIcon, QKeyEvent
from PySide6.QtWidgets import QComboBox, QWidget

_ELSEWHERE = (
    Qt.KeyboardModifier.ControlModifier
    | Qt.KeyboardModifier.AltModifier
    | Qt.KeyboardModifier.MetaModifier
)


class ListedEditor(QComboBox):
    """A list in a cell. Letters choose from it, and fire no action of the window."""

    def __init__(
        self, choices: Sequence[tuple[QIcon | None, str]], name: str, parent: QWidget
    ) -> None:
        super().__init__(parent)
        self.setAccessibleName(name)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        for icon, text in choices:
            if icon is None:
                self.addItem(text)
            else:
                self.addItem(icon, text)

    def event(self, event: QEvent) -> bool:
        """Claim plain keys before they are taken for those of actions."""
        if (
            event.type() == QEvent.Type.ShortcutOverride
            and isinstance(event, QKeyEvent)
            and not event.modifiers() & _ELSEWHERE
        ):
            event.accept()
            return True
        return super().event(event)
