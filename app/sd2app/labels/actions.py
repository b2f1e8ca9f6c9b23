"""Menus of labels that follow a model, and actions that wait while edits are refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QMenu, QWidget

from sd2app.feature import Action
from sd2app.labels.edits import LabelEdits
from sd2app.widgets.icons import swatch_icon
from sd2app.widgets.key_text import canonical, native
from sd2core.labels.label_set import Label, LabelSet


def editing(edits: LabelEdits, *rows: Action) -> tuple[Action, ...]:
    """Actions that change labels: disabled, with the reason, while edits are refused."""

    def why_not(question: Callable[[], str] | None) -> Callable[[], str]:
        return lambda: edits.refusal or (question() if question is not None else "")

    return tuple(replace(row, why_not=why_not(row.why_not)) for row in rows)


class LabelActions:
    """Action per label: its key marks, or relabels selected spans while paused without marks."""

    def __init__(
        self, edits: LabelEdits, use: Callable[[str], None], menu: QMenu, window: QWidget
    ) -> None:
        self._edits, self._use, self._menu, self._window = edits, use, menu, window
        self._first = menu.addSeparator()
        self._actions: list[QAction] = []
        self._shown: LabelSet | None = None
        edits.labels.choices_changed.connect(self._follow)
        self._follow()

    def refresh(self) -> None:
        """Disable the actions while edits are refused."""
        refusal = self._edits.refusal
        labels = self._shown.labels if self._shown is not None else ()
        for action, label in zip(self._actions, labels, strict=True):
            action.setEnabled(not refusal)
            action.setToolTip(refusal or _tip(label))

    def _follow(self) -> None:
        offered = self._edits.labels.labels.label_set
        if offered == self._shown:
            return
        self._shown = offered
        for action in self._actions:
            self._menu.removeAction(action)
            action.deleteLater()
        self._actions = [self._made(label) for label in offered.labels]
        self._menu.insertActions(self._first, self._actions)
        self.refresh()

    def _made(self, label: Label) -> QAction:
        action = QAction(swatch_icon(label.colour), label.name, self._window)
        if label.key:
            action.setShortcut(QKeySequence(canonical(label.key)))
        action.setAutoRepeat(False)
        action.triggered.connect(lambda _=False: self._use(label.name))
        return action


def _tip(label: Label) -> str:
    keys = f" ({native(canonical(label.key))})" if label.key else ""
    return (
        "Begin a span with this frame, or end the one that has begun; with a span selected,"
        f" give it this label{keys}"
    )
