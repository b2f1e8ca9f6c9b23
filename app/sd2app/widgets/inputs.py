"""Number boxes, choices, sliders and buttons that leave keyboard and wheel to the window."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

from PySide6.QtCore import QEvent, QPoint, QSignalBlocker, Qt, QTimer, Signal
from PySide6.QtGui import QAction, QFocusEvent, QKeyEvent, QValidator, QWheelEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialog,
    QDoubleSpinBox,
    QLabel,
    QLineEdit,
    QSlider,
    QToolButton,
    QToolTip,
    QWidget,
)

from sd2app.widgets.layouts import row_of
from sd2app.widgets.time_axis import clock_text
from sd2core.errors import Sd2Error
from sd2core.files.number_lists import parse_quantity
from sd2core.options.records import OptionRecord, option_named

_ENDING_KEYS = (Qt.Key.Key_Escape, Qt.Key.Key_Return, Qt.Key.Key_Enter)
_STEP_KEYS = (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_PageUp, Qt.Key.Key_PageDown, *_ENDING_KEYS)

_PLAIN = (
    Qt.KeyboardModifier.NoModifier,
    Qt.KeyboardModifier.ShiftModifier,
    Qt.KeyboardModifier.KeypadModifier,
)
_MANY_DECIMALS = 5
_FAR = 1e5
"""What is without end ends here in a box."""


class NumberBox(QDoubleSpinBox):
    """A number with its unit; other units of its kind are understood, as in ``250cm``.

    Return takes what was typed, Escape takes it back; either gives the keyboard
    back to the window, so that Space and Ctrl+Z mean what they mean everywhere.
    What is no such number, or out of range, is refused with a sentence below the box.
    The wheel changes it only while it has the keyboard.
    """

    refused = Signal(str)  # why what was typed is not taken

    def __init__(
        self,
        low: float,
        high: float,
        suffix: str,
        tip: str,
        *,
        decimals: int = 2,
        step: float = 0.1,
    ) -> None:
        super().__init__()
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
        """Follow a model, unless the user is typing; emits nothing."""
        if self._typing:
            return
        if abs(value - self.value()) >= 0.5 * 10.0 ** -self.decimals():
            with QSignalBlocker(self):
                self.setValue(value)

    def mark(self, marked: bool) -> None:
        """Show the number in the colour of warnings, or as usual."""
        name = "marked" if marked else ""
        if name != self.objectName():
            self.setObjectName(name)
            self.style().unpolish(self)
            self.style().polish(self)

    def textFromValue(self, value: float) -> str:
        """Digits of a number; where there may be many, without zeros at the end."""
        text = super().textFromValue(value)
        return text.rstrip("0").rstrip(".,") if self.decimals() > _MANY_DECIMALS else text

    def valueFromText(self, text: str) -> float:
        """Number that was typed, in the box's unit."""
        if text and text == self.specialValueText():
            return self.minimum()
        # The box puts its own sign and unit around whatever is typed.
        typed = text.removeprefix(self.prefix()).removesuffix(self.suffix())
        return parse_quantity(typed, self.suffix().strip())

    def validate(self, text: str, position: int) -> tuple[QValidator.State, str, int]:
        """Let anything be typed; only a number within the range is taken."""
        kinds = QValidator.State
        kind = kinds.Intermediate if self._refusal(text) else kinds.Acceptable
        return kind, text, position

    def _refusal(self, text: str) -> str:
        """Reason why a text cannot be taken, empty if it can."""
        try:
            value = self.valueFromText(text)
        except Sd2Error as error:
            return str(error)
        low, high = self.minimum(), self.maximum()
        slack = 0.5 * 10.0 ** -self.decimals()
        if low - slack <= value <= high + slack:
            return ""
        ends = (f"{self.textFromValue(end)}{self.suffix()}" for end in (low, high))
        return str(
            Sd2Error(f"“{text.removesuffix(self.suffix())}” is out of range", " to ".join(ends))
        )

    def event(self, event: QEvent) -> bool:
        """Claim the keys that step or end the editing."""
        return claims(event, _STEP_KEYS) or super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """End the editing with Return or Escape."""
        ends = event.key() in _ENDING_KEYS
        if event.key() == Qt.Key.Key_Escape:
            self._end_typing()
            self.lineEdit().setText(
                self.prefix() + self.textFromValue(self.value()) + self.suffix()
            )
        elif ends and (refusal := self._refusal(self.lineEdit().text())):
            self._refuse(refusal)
            return
        else:
            super().keyPressEvent(event)
        if ends:
            self.clearFocus()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Take what was typed, or go back to the number before it and say why."""
        refusal = self._refusal(self.lineEdit().text())
        super().focusOutEvent(event)
        if refusal:
            self._refuse(refusal)

    def _refuse(self, refusal: str) -> None:
        self.refused.emit(refusal)
        place = self.mapToGlobal(QPoint(0, self.height()))
        # Later, since the change of the focus would hide it.
        QTimer.singleShot(0, self, lambda: QToolTip.showText(place, refusal, self))

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


def option_box(
    record: type[OptionRecord], name: str, suffix: str, *, decimals: int = 0, step: float = 1.0
) -> NumberBox:
    """Make the box of an option: its record says the bounds, and what the option is."""
    option = option_named(record, name)
    bounds = option.bounds
    low, high = (min(max(end, -_FAR), _FAR) for end in (bounds.low, bounds.high))
    # What must be above a number begins with the least that the box can show.
    low += bounds.above * 10.0**-decimals
    return NumberBox(low, high, suffix, option.sentence, decimals=decimals, step=step)


class Choice(QComboBox):
    """A list to choose from; the wheel and the keyboard belong to the window.

    ``texts`` are those of the values, in order; ``chosen`` is called with another value.
    """

    def __init__(
        self,
        tip: str,
        parent: QWidget,
        texts: Mapping[Any, str] | None = None,
        chosen: Callable[[Any], object] | None = None,
    ) -> None:
        super().__init__(parent)
        self.setToolTip(tip)
        self.setAccessibleName(tip)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        for value, text in (texts or {}).items():
            self.addItem(text, value)
        if chosen is not None:
            self.currentIndexChanged.connect(lambda place: chosen(self.itemData(place)))

    def show_value(self, value: Any) -> None:
        """Follow a model; emits nothing."""
        with QSignalBlocker(self):
            self.setCurrentIndex(self.findData(value))

    def offer(self, texts: Sequence[str], place: int) -> None:
        """Follow a model: list these texts, with the one at a place chosen; emits nothing."""
        with QSignalBlocker(self):
            if list(texts) != [self.itemText(at) for at in range(self.count())]:
                self.clear()
                self.addItems(list(texts))
            self.setCurrentIndex(place)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Scroll what is behind it."""
        event.ignore()


class CheckBox(QCheckBox):
    """A box to tick; ``chosen`` is called with whether it is."""

    def __init__(
        self, text: str, parent: QWidget, chosen: Callable[[bool], object], tip: str = ""
    ) -> None:
        super().__init__(text, parent)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.setToolTip(tip)
        self.toggled.connect(chosen)

    def show_checked(self, checked: bool) -> None:
        """Follow a model; emits nothing."""
        with QSignalBlocker(self):
            self.setChecked(checked)


def action_button(action: QAction, text: str, *, outlined: bool = False) -> QToolButton:
    """A button for an action; it keeps its short text, the menu has the full one."""
    button = QToolButton()
    button.setObjectName("outlined" if outlined else "")
    button.setAccessibleName(text)
    button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    action.setIconText(text)
    button.setDefaultAction(action)
    return button


def claims(event: QEvent, keys: Collection[Qt.Key] | None = None) -> bool:
    """Claim a plain key, any or one of these, before the window's actions get it.

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


class SearchLine(QLineEdit):
    """Search field; Escape empties it, then closes its dialog or gives the keyboard back."""

    def __init__(self, hint: str, parent: QWidget) -> None:
        super().__init__(parent)
        self.setPlaceholderText(hint)
        self.setAccessibleName(hint)
        self.setToolTip(hint)  # which a narrow panel cuts
        self.setClearButtonEnabled(True)

    def event(self, event: QEvent) -> bool:
        """Claim Escape and Return."""
        return claims(event, _ENDING_KEYS) or super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Empty it, or leave it, with Escape."""
        if event.key() != Qt.Key.Key_Escape:
            super().keyPressEvent(event)
        elif self.text():
            self.clear()
        elif isinstance(self.window(), QDialog):
            event.ignore()
        else:
            self.clearFocus()


class TypedLine(QLineEdit):
    """Reports each change of the typed text; Escape takes it back.

    Return and Escape give the keyboard back to the window.
    """

    typed = Signal(str)
    ended = Signal()  # the keyboard is elsewhere again

    def __init__(self, name: str, tip: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName(name)
        self.setToolTip(tip)
        self._before = ""
        self.textEdited.connect(self.typed)

    def show_text(self, text: str) -> None:
        """Follow a model."""
        if text != self.text():
            self.setText(text)

    def event(self, event: QEvent) -> bool:
        """Claim Escape and Return."""
        return claims(event, _ENDING_KEYS) or super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """End the typing with Return or Escape."""
        if event.key() == Qt.Key.Key_Escape:
            if self.text() != self._before:
                self.setText(self._before)
                self.typed.emit(self._before)
            self.clearFocus()
        elif event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.clearFocus()
        else:
            super().keyPressEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Remember the text before typing."""
        self._before = self.text()
        super().focusInEvent(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Report the end of typing."""
        super().focusOutEvent(event)
        self.ended.emit()


class FrameSlider(QWidget):
    """Follows a model; ``chosen`` is called with another frame, by mouse or arrow keys."""

    def __init__(self, chosen: Callable[[int], object], parent: QWidget) -> None:
        super().__init__(parent)
        self.slider = QSlider(Qt.Orientation.Horizontal, self)
        self.slider.setAccessibleName("Frame")
        self.slider.valueChanged.connect(chosen)
        self._where = QLabel(self)
        self._where.setObjectName("muted")
        width_px = self._where.fontMetrics().horizontalAdvance("00:00.000 · frame 00000")
        self._where.setMinimumWidth(width_px)
        self.setLayout(row_of((self.slider, 1), self._where, margins_px=0))

    def show_frame(self, frame: int, frames: int, time_s: float) -> None:
        """Show which of so many frames is on screen."""
        with QSignalBlocker(self.slider):
            self.slider.setRange(0, max(frames - 1, 0))
            self.slider.setValue(frame)
        self.slider.setEnabled(frames > 1)
        self._where.setText(f"{clock_text(time_s)} · frame {frame}" if frames else "")
