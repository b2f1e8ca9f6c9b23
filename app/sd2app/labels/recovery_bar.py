"""Bar above the window about read-only labels and unsaved labels of earlier sessions."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtWidgets import QFrame, QHBoxLayout, QSizePolicy, QToolButton, QWidget

from sd2app.labels.autosave import LabelAutosave
from sd2app.labels.recovery_dialog import offer_text, waiting_text
from sd2app.session.document import DocumentModel
from sd2app.widgets.panel import outlined, sentence, title

_HEIGHT = 40


class LabelBar(QFrame):
    """Offers what the user has to decide about the labels; hidden when there is nothing.

    ``restore`` takes over the labels offered, ``recover`` opens the list for all recordings.
    """

    def __init__(
        self,
        session: LabelAutosave,
        document: DocumentModel,
        restore: Callable[[], None],
        recover: Callable[[], None],
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setObjectName("panel")
        self.setAccessibleName("State of the labels")
        self.setMinimumHeight(_HEIGHT)
        self._session, self._document = session, document
        self._title, self._text = title(""), sentence("")
        self._buttons: dict[str, QToolButton] = {}
        for name, text, tip, run in (
            ("again", "Try again", "Edit them here, once the other window is closed",
             session.try_again),
            ("restore", "Restore", "Use these labels; one undo takes that back", restore),
            ("decline", "Discard", "Do not offer them again; File → Recover labels… lists them",
             session.decline),
            ("postpone", "Not now", "Offer them again when this recording is opened next",
             session.postpone),
            ("recover", "Recover labels…", "See what is there, and open its recording", recover),
            ("close", "✕", "Close this message", session.dismiss),
        ):  # fmt: skip
            self._buttons[name] = outlined(text, tip, run, self)
        self._buttons["close"].setObjectName("")
        self._buttons["close"].setAccessibleName("Close this message")
        self._lay_out()
        session.changed.connect(self._refresh)
        # What is offered is compared with what is there by now.
        document.undo_stack.indexChanged.connect(self._refresh)
        self._refresh()

    def _lay_out(self) -> None:
        layout = QHBoxLayout(self)
        layout.setContentsMargins(12, 4, 4, 4)
        layout.setSpacing(8)
        layout.addWidget(self._title)
        layout.addWidget(self._text, 1)
        self._text.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        for button in self._buttons.values():
            layout.addWidget(button)

    @property
    def text(self) -> str:
        """Text shown, empty while hidden."""
        return "" if self.isHidden() else f"{self._title.text()}: {self._text.text()}"

    def _refresh(self) -> None:
        session, offer = self._session, self._session.offer
        if session.read_only:
            said = "Labels are read-only", f"{session.refusal}."
            shown = {"again"}
        elif offer is not None:
            said = "Labels were not saved", offer_text(offer, self._document.labels)
            shown = {"restore", "decline", "postpone"}
        elif session.notes:
            said, shown = ("Labels", ""), {"close"}
        else:
            said = "Labels were not saved", waiting_text(session.waiting)
            shown = {"recover", "close"}
        self._title.setText(said[0])
        self._text.setText("\n".join(filter(None, (said[1], *session.notes))))
        for name, button in self._buttons.items():
            button.setVisible(name in shown)
        self.setVisible(bool(self._text.text()))
