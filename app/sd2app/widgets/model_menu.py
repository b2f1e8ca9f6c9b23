"""Models to choose from, as a menu, and as a button that says which one is in use."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple, Protocol

from PySide6.QtCore import Qt, SignalInstance
from PySide6.QtGui import QAction, QActionGroup
from PySide6.QtWidgets import QMenu, QToolButton, QWidget

Use = Callable[[Path | None], None]

_LONGEST = 14


class Entry(NamedTuple):
    """A model in the menu."""

    text: str
    tip: str
    path: Path | None


class Face(NamedTuple):
    """Text and tooltip of the button."""

    text: str
    tip: str


class Chooser(Protocol):
    """Models to choose from, as texts."""

    title: str  # of the menu
    role: str  # purpose of a model, for screen readers
    none_tip: str  # effect of using no model

    @property
    def changed(self) -> SignalInstance:
        """Signal that texts or models may have changed."""

    @property
    def path(self) -> Path | None:
        """The model in use."""

    def entries(self) -> Sequence[Entry]:
        """The models as they are on disk now."""

    def face(self) -> Face:
        """Text and tooltip for the model in use."""


class ModelMenu(QMenu):
    """Menu of all known models, and of actions on them."""

    def __init__(
        self, chooser: Chooser, use: Use, below: list[QAction], parent: QWidget | None = None
    ) -> None:
        super().__init__(chooser.title, parent)
        self._chooser = chooser
        self._use = use
        self._below = below
        self._group = QActionGroup(self)
        self.setToolTipsVisible(True)
        self.aboutToShow.connect(self.fill)

    def fill(self) -> None:
        """List the models as they are on disk now."""
        self.clear()
        path = self._chooser.path
        none = self.addAction("No model")
        none.setToolTip(self._chooser.none_tip)
        none.triggered.connect(lambda: self._use(None))
        chosen = [(none, path is None)]
        entries = self._chooser.entries()
        if entries:
            self.addSeparator()
        for entry in entries:
            action = self.addAction(entry.text)
            action.setToolTip(entry.tip)
            action.triggered.connect(lambda _=False, path=entry.path: self._use(path))
            chosen.append((action, entry.path == path))
        for action, checked in chosen:
            action.setCheckable(True)
            action.setActionGroup(self._group)
            action.setChecked(checked)
        self.addSeparator()
        self.addActions(self._below)


class ModelButton(QToolButton):
    """Button that names the model in use and opens the menu of models."""

    def __init__(self, chooser: Chooser, menu: ModelMenu, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._chooser = chooser
        self.setObjectName("model")
        self.setMenu(menu)
        self.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextOnly)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setCursor(Qt.CursorShape.ArrowCursor)
        chooser.changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        text, tip = self._chooser.face()
        if len(text) > _LONGEST:
            text = f"{text[: _LONGEST - 1]}…"
        self.setText(text)
        self.setToolTip(tip)
        self.setAccessibleName(f"{self._chooser.role}: {text}")
        self.updateGeometry()
        parent = self.parentWidget()
        if parent is not None:
            parent.update()
