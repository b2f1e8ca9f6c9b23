"""Bar over the window with an error and its remedy, or a remark."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QToolButton, QWidget

from sd2app.widgets.layouts import row_of
from sd2app.widgets.panel import say, sentence


class MessageBar(QFrame):
    """Bar of one message, hidden while there is none."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setObjectName("panel")
        self._text = sentence("")
        close = QToolButton(self)
        close.setText("✕")
        close.setToolTip("Close this message")
        close.setAccessibleName("Close this message")
        close.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        close.clicked.connect(self.hide)
        layout = row_of((self._text, 1), margins_px=(12, 4, 4, 4))
        layout.addWidget(close, 0, Qt.AlignmentFlag.AlignTop)
        self.setLayout(layout)
        self.hide()

    @property
    def text(self) -> str:
        """Message on screen; empty while hidden."""
        return "" if self.isHidden() else self._text.text()

    def warn(self, text: str) -> None:
        """Show a failure; several stand below each other, each once."""
        said = self.text.splitlines() if self._text.objectName() == "warning" else []
        self._say("\n".join(dict.fromkeys([*said, *text.splitlines()])), "warning")

    def note(self, text: str) -> None:
        """Show a remark, unless a failure is shown."""
        if not (self.text and self._text.objectName() == "warning"):
            self._say(text, "muted")

    def _say(self, text: str, role: str) -> None:
        say(self._text, text, role)
        self.show()
