"""The labels of the label set as actions with their own keys, first in the menu of labels."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QMenu, QWidget

from sd2app.labels.model import LabelsModel
from sd2app.widgets.icons import swatch_icon
from sd2app.widgets.key_text import canonical, native
from sd2core.labels.label_set import Label, LabelSet


class LabelActions:
    """A key marks; paused and with nothing begun, it gives what is selected another label."""

    def __init__(
        self, labels: LabelsModel, use: Callable[[str], None], menu: QMenu, window: QWidget
    ) -> None:
        self._labels, self._use, self._menu, self._window = labels, use, menu, window
        self._first = menu.addSeparator()
        self._actions: list[QAction] = []
        self._shown: LabelSet | None = None
        labels.changed.connect(self._follow)
        self._follow()

    def refresh(self, refusal: str) -> None:
        """Disable the actions where ``refusal`` says why labels cannot be edited."""
        labels = self._shown.labels if self._shown is not None else ()
        for action, label in zip(self._actions, labels, strict=True):
            action.setEnabled(not refusal)
            action.setToolTip(refusal or _tip(label))

    def _follow(self) -> None:
        offered = self._labels.labels.label_set
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


def _tip(label: Label) -> str:
    keys = f" ({native(canonical(label.key))})" if label.key else ""
    return (
        "Begin a span with this frame, or end the one that has begun; with a span selected,"
        f" give it this label{keys}"
    )
