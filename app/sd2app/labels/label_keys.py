"""The labels of the label set as actions with their own keys, first in the menu of labels."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QMenu

from sd2app.widgets.icons import swatch_icon
from sd2app.widgets.key_text import canonical, native

if TYPE_CHECKING:
    from sd2app.shell.window import MainWindow
    from sd2core.labels.label_set import Label, LabelSet


class LabelActions:
    """A key marks; paused and with nothing begun, it gives what is selected another label."""

    def __init__(self, window: MainWindow, menu: QMenu) -> None:
        self._window, self._menu = window, menu
        self._first = menu.addSeparator()
        self._actions: list[QAction] = []
        self._shown: LabelSet | None = None
        window.context.labels.changed.connect(self._follow)
        self._follow()

    def refresh(self, refusal: str) -> None:
        """Follow whether labels can be edited; ``refusal`` says why not."""
        labels = self._shown.labels if self._shown is not None else ()
        for action, label in zip(self._actions, labels, strict=True):
            action.setEnabled(not refusal)
            action.setToolTip(refusal or _tip(label))

    def _follow(self) -> None:
        offered = self._window.context.labels.labels.label_set
        if offered == self._shown:
            return
        self._shown = offered
        for action in self._actions:
            self._menu.removeAction(action)
            action.deleteLater()
        self._actions = [self._made(label) for label in offered.labels]
        self._menu.insertActions(self._first, self._actions)

    def _made(self, label: Label) -> QAction:
        action = QAction(swatch_icon(label.colour), label.name, self._window)
        if label.key:
            action.setShortcut(QKeySequence(canonical(label.key)))
        action.setToolTip(_tip(label))
        action.setAutoRepeat(False)
        action.triggered.connect(lambda _=False: self._use(label.name))
        return action

    def _use(self, label: str) -> None:
        context = self._window.context
        chosen = context.labels.selected
        if not chosen or context.playback.playing or context.labels.marks:
            context.label_marking.mark(label)
        elif any(span.origin == "suggestion" for span in chosen):
            context.suggestions.accept(label)
        else:
            context.label_edits.relabel(label)


def _tip(label: Label) -> str:
    keys = f" ({native(canonical(label.key))})" if label.key else ""
    return (
        "Begin a span with this frame, or end the one that has begun; with a span selected,"
        f" give it this label{keys}"
    )
