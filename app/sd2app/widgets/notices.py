"""Notices that lie over the content, so that what appears by itself moves nothing."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from PySide6.QtCore import QEvent, QObject, QPoint, QRect, Qt, Signal
from PySide6.QtGui import QAccessible, QAccessibleEvent, QCursor
from PySide6.QtWidgets import QFrame, QSizePolicy, QWidget

from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import outlined, say, sentence, show_words, title

_WIDTH_PX, _GAP_PX, _MARGIN_PX = 440, 8, 12
_PLACED_AGAIN = {QEvent.Type.Resize, QEvent.Type.Move, QEvent.Type.Show, QEvent.Type.Hide}


class Notice(QFrame):
    """Words with buttons and a cross, hidden while there is nothing to say.

    ``buttons`` are names with text, tip and what a click does; ``close`` is called by the cross.
    """

    announced = Signal(str)  # words that were not on screen before

    def __init__(
        self,
        name: str,
        buttons: Sequence[tuple[str, str, str, Callable[[], object]]] = (),
        close: Callable[[], object] | None = None,
    ) -> None:
        super().__init__()
        self.setObjectName("notice")
        self.setAccessibleName(name)
        self._words = ("", "")
        self._title, self._text = title("", name), sentence("")
        self._title.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self._text.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.buttons = {id: outlined(text, tip, run, self) for id, text, tip, run in buttons}
        self._close = close
        tip = "Close this message"
        cross = outlined("✕", tip, self._dismiss, self, name=tip, look="")
        words = column_of(self._title, self._text, spacing_px=2, margins_px=(0, 5, 0, 0))
        top = row_of((words, 1), spacing_px=8)
        top.addWidget(cross, 0, Qt.AlignmentFlag.AlignTop)
        parts = [top]
        if self.buttons:
            parts.append(row_of(*self.buttons.values(), STRETCH, spacing_px=8))
        self.setLayout(column_of(*parts, spacing_px=8, margins_px=(12, 4, 4, 8)))
        self.hide()

    @property
    def text(self) -> str:
        """Words on screen, empty while hidden."""
        return "" if self.isHidden() else ": ".join(filter(None, self._words))

    def show_words(self, head: str, text: str, role: str = "muted") -> None:
        """Show words, nothing without them; what the user closed stays closed until it changes."""
        if (head, text) == self._words:
            return
        self._words = (head, text)
        show_words(self._title, head)
        say(self._text, text, role)
        self.setVisible(bool(text))
        if isinstance(stack := self.parentWidget(), NoticeStack):
            stack.place()
        if text:
            QAccessible.updateAccessibility(QAccessibleEvent(self, QAccessible.Event.Alert))
            self.announced.emit(self.text)

    def _dismiss(self) -> None:
        self.hide()
        if self._close is not None:
            self._close()


class NoticeStack(QWidget):
    """Notices below each other in a corner of ``over`` where the pointer is not.

    They lie over ``parent``, in which ``over`` is; where that is hidden they lie over all of it.
    """

    def __init__(self, parent: QWidget, over: QWidget, notices: Sequence[Notice]) -> None:
        super().__init__(parent)
        self._over, self._at = over, (0, 0)
        self.setLayout(column_of(*notices, spacing_px=_GAP_PX, margins_px=0))
        for watched in (parent, over):
            watched.installEventFilter(self)
        self.place()

    def event(self, event: QEvent) -> bool:
        """Take the room that the notices need."""
        done = super().event(event)
        if event.type() == QEvent.Type.LayoutRequest:
            self.place()
        return done

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Stay in the corner."""
        if event.type() in _PLACED_AGAIN:
            self.place()
        return False

    def place(self) -> None:
        """Lie in the corner, or nowhere without a notice."""
        parent, layout = self.parentWidget(), self.layout()
        if parent is None or layout is None:
            return
        appears = self.isHidden()
        if all(notice.isHidden() for notice in self.findChildren(Notice)):
            self.hide()
            return
        room = parent.rect()
        if self._over.isVisible():
            room = QRect(self._over.mapTo(parent, QPoint(0, 0)), self._over.size())
        width_px = min(_WIDTH_PX, room.width() - 2 * _MARGIN_PX)
        layout.activate()
        height_px = layout.totalHeightForWidth(width_px)
        low_px = max(room.bottom() - _MARGIN_PX - height_px, _MARGIN_PX)
        right_px = room.right() - _MARGIN_PX - width_px
        pointer = parent.mapFromGlobal(QCursor.pos())
        if appears or not self.geometry().contains(pointer):
            left_px, high_px = room.left() + _MARGIN_PX, room.top() + _MARGIN_PX
            corners = [(right_px, low_px), (left_px, low_px), (right_px, high_px)]
            size = width_px, height_px
            free = [one for one in corners if not QRect(*one, *size).contains(pointer)]
            self._at = (free or corners)[0]
        self.setGeometry(*self._at, width_px, height_px)
        self.show()
        self.raise_()
