"""Number boxes, choices and buttons that leave keyboard and wheel to the window."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QSignalBlocker, Qt
from PySide6.QtGui import QAction, QKeyEvent, QWheelEvent
from PySide6.QtWidgets import QComboBox, QDoubleSpinBox, QToolButton, QWidget

from sd2app.widgets.own_keys import claims

_OWN_KEYS = (
    Qt.Key.Key_Up,
    Qt.Key.Key_Down,
    Qt.Key.Key_PageUp,
    Qt.Key.Key_PageDown,
    Qt.Key.Key_Return,
    Qt.Key.Key_Enter,
    Qt.Key.Key_Escape,
)


class NumberBox(QDoubleSpinBox):
    """A number with its unit.

    Return takes what was typed, Escape takes it back; either gives the keyboard
    back to the window, so that Space and Ctrl+Z mean what they mean everywhere.
    The wheel changes it only while it has the keyboard.
    """

    def __init__(
        self,
        low: float,
        high: float,
        suffix: str,
        tip: str,
        *,
        decimals: int = 2,
        step: float = 0.1,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setRange(low, high)
        self.setDecimals(decimals)
        self.setSingleStep(step)
        self.setSuffix(suffix)
        self.setToolTip(tip)
        self.setAccessibleName(tip)
        self.setKeyboardTracking(False)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMinimumWidth(72)
        self._typing = False
        self.lineEdit().textEdited.connect(self._begin_typing)
        self.editingFinished.connect(self._end_typing)

    def show_value(self, value: float) -> None:
        """Follow a model, unless somebody is typing; emits nothing."""
        if self._typing:
            return
        if abs(value - self.value()) >= 0.5 * 10.0 ** -self.decimals():
            with QSignalBlocker(self):
                self.setValue(value)

    def event(self, event: QEvent) -> bool:
        """Keys that step or end the editing do that here."""
        return claims(event, _OWN_KEYS) or super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Return and Escape end the editing."""
        if event.key() == Qt.Key.Key_Escape:
            self._end_typing()
            self.lineEdit().setText(
                self.prefix() + self.textFromValue(self.value()) + self.suffix()
            )
            self.clearFocus()
            return
        super().keyPressEvent(event)
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.clearFocus()

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Scroll what is behind it unless it has the keyboard."""
        if self.hasFocus():
            super().wheelEvent(event)
        else:
            event.ignore()

    def _begin_typing(self, text: str) -> None:
        self._typing = True

    def _end_typing(self) -> None:
        self._typing = False


class Choice(QComboBox):
    """A list to choose from; the wheel and the keyboard belong to the window."""

    def __init__(self, tip: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setToolTip(tip)
        self.setAccessibleName(tip)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Scroll what is behind it."""
        event.ignore()


def action_button(action: QAction, text: str) -> QToolButton:
    """A button for an action; it keeps its short text, the menu has the full one."""
    button = QToolButton()
    button.setText(text)
    button.setToolTip(action.toolTip())
    button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    button.setCheckable(action.isCheckable())
    button.setEnabled(action.isEnabled())
    button.clicked.connect(action.trigger)

    def follow() -> None:
        button.setEnabled(action.isEnabled())
        button.setChecked(action.isChecked())
        button.setToolTip(action.toolTip())

    action.changed.connect(follow)
    return button
