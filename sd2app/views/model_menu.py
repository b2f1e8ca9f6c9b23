"""The models that can denoise, as a menu, and as the button beside the denoised map."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QActionGroup
from PySide6.QtWidgets import QMenu, QToolButton, QWidget

from sd2app.models.denoise import DenoiseModel
from sd2app.models.denoise_words import kind_words, model_title, origin_words

Use = Callable[[Path | None], None]

_LONGEST = 32


class ModelMenu(QMenu):
    """None, every model that is known, and below them what else can be done with one."""

    def __init__(
        self, denoise: DenoiseModel, use: Use, below: list[QAction], parent: QWidget | None = None
    ) -> None:
        super().__init__("Denoise with", parent)
        self._denoise = denoise
        self._use = use
        self._below = below
        self._group = QActionGroup(self)
        self.setToolTipsVisible(True)
        self.aboutToShow.connect(self.fill)

    def fill(self) -> None:
        """List the models as they are on disk now."""
        self.clear()
        path = self._denoise.path
        none = self.addAction("No model")
        none.setToolTip("Show no denoised map for this recording")
        none.triggered.connect(lambda: self._use(None))
        chosen = [(none, path is None)]
        cards = self._denoise.available()
        if cards:
            self.addSeparator()
        for card in cards:
            action = self.addAction(f"{model_title(card)}\t{kind_words(card)}")
            action.setToolTip(f"{kind_words(card)}, {origin_words(card)}\n{card.path}")
            action.triggered.connect(lambda _=False, path=card.path: self._use(path))
            chosen.append((action, card.path == path))
        for action, checked in chosen:
            action.setCheckable(True)
            action.setActionGroup(self._group)
            action.setChecked(checked)
        self.addSeparator()
        self.addActions(self._below)


class ModelButton(QToolButton):
    """Says which model is in use; a click lists the others."""

    def __init__(
        self, denoise: DenoiseModel, menu: ModelMenu, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._denoise = denoise
        self.setObjectName("model")
        self.setMenu(menu)
        self.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextOnly)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setCursor(Qt.CursorShape.ArrowCursor)
        denoise.changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        card, path = self._denoise.card, self._denoise.path
        if self._denoise.problem:
            text, tip = "Denoiser not usable", self._denoise.problem
        elif card is not None:
            text = model_title(card)
            tip = f"{text}: {kind_words(card)}, {origin_words(card)}"
        elif path is not None and self._denoise.busy:
            text, tip = f"Loading {path.stem}…", str(path)
        else:
            text, tip = "No denoiser", "Choose a model that denoises this map"
        if len(text) > _LONGEST:
            text = f"{text[: _LONGEST - 1]}…"
        self.setText(text)
        self.setToolTip(tip)
        self.setAccessibleName(f"Denoiser: {text}")
        self.updateGeometry()
        if self.parentWidget() is not None:
            self.parentWidget().update()
