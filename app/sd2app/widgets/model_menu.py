"""Models to choose from, as a menu, a button that says which is in use, and a page of facts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape
from itertools import starmap
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from PySide6.QtCore import Qt, SignalInstance
from PySide6.QtGui import QActionGroup
from PySide6.QtWidgets import QLabel, QMenu, QTextBrowser, QToolButton, QWidget

from sd2app.feature import Shell
from sd2app.widgets.dialogs import Dialog, ask_file, closing
from sd2app.widgets.layouts import column_of
from sd2app.widgets.model_page import ModelPage, model_title
from sd2app.widgets.panel import side_by_side, title

_LONGEST = 14


class Chosen(Protocol):
    """The model in use, and what else there is."""

    @property
    def changed(self) -> SignalInstance:
        """Signal that another model is in use, or the same one differently."""

    @property
    def path(self) -> Path | None:
        """File of the model that is in use or being loaded."""

    @property
    def card(self) -> Any:
        """Card of the model in use; None until it is loaded."""

    @property
    def problem(self) -> str:
        """Reason why it cannot be used; empty where it can."""

    def available(self) -> Sequence[Any]:
        """Cards of the models that can be chosen, as they are on disk now."""

    def use(self, path: Path | None) -> None:
        """Use another model, or none; raises Sd2Error."""


class Words(NamedTuple):
    """Texts on models of one kind."""

    title: str  # of the menu
    role: str  # purpose of a model
    none_tip: str  # effect of using no model
    hint: str  # what to choose a model for
    kind: Callable[[Any], str]  # kind of network, by a model's card
    origin: Callable[[Any], str]  # what it learned from, by its card
    opening: str  # title of the dialog that asks for a file
    files: str  # its filter
    page: Callable[[Any], ModelPage]  # facts of a model, by its card


class ModelMenu(QMenu):
    """Menu of all known models, and of actions on them, by their ids."""

    def __init__(self, chosen: Chosen, words: Words, shell: Shell, below: Sequence[str]) -> None:
        super().__init__(words.title, shell.dialog_parent)
        self.chosen, self.words, self._shell = chosen, words, shell
        self._below = [shell.action(name) for name in below]
        self._group = QActionGroup(self)
        self.setToolTipsVisible(True)
        self.aboutToShow.connect(self.fill)

    def fill(self) -> None:
        """List the models as they are on disk now."""
        self.clear()
        words = self.words
        self._add("No model", words.none_tip, None)
        cards = self.chosen.available()
        if cards:
            self.addSeparator()
        for card in cards:
            kind = words.kind(card)
            tip = f"{kind}, {words.origin(card)}\n{card.path}"
            self._add(f"{model_title(card)}\t{kind}", tip, card.path)
        self.addSeparator()
        self.addActions(self._below)

    def _add(self, text: str, tip: str, path: Path | None) -> None:
        action = self.addAction(text, lambda: self.use(path))
        action.setToolTip(tip)
        action.setCheckable(True)
        action.setActionGroup(self._group)
        action.setChecked(self.chosen.path == path)

    def use(self, path: Path | None) -> None:
        """Use a model file, or none."""
        self._shell.attempt(lambda: self.chosen.use(path))

    def open_file(self) -> None:
        """Let the user choose a model file, and use it."""
        start, words = str(self.chosen.path or ""), self.words
        if path := ask_file(self._shell.dialog_parent, words.opening, words.files, start):
            self.use(path)

    def show_card(self) -> None:
        """Show the facts about the model in use."""
        if self.chosen.card is not None:
            ModelCardDialog(self.words.page(self.chosen.card), self._shell.dialog_parent).exec()


class ModelButton(QToolButton):
    """Button that names the model in use and opens the menu of models."""

    def __init__(self, menu: ModelMenu) -> None:
        super().__init__()
        self._chosen, self._words = menu.chosen, menu.words
        self.setObjectName("model")
        self.setMenu(menu)
        self.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextOnly)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.setCursor(Qt.CursorShape.ArrowCursor)
        menu.chosen.changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        text, tip = self._face()
        if len(text) > _LONGEST:
            text = f"{text[: _LONGEST - 1]}…"
        self.setText(text)
        self.setToolTip(tip)
        self.setAccessibleName(f"{self._words.role}: {text}")
        self.updateGeometry()
        parent = self.parentWidget()
        if parent is not None:
            parent.update()

    def _face(self) -> tuple[str, str]:
        """Text and tooltip for the model in use."""
        chosen, words = self._chosen, self._words
        card, path = chosen.card, chosen.path
        if chosen.problem:
            return f"{words.role} not usable", chosen.problem
        if card is not None:
            title = model_title(card)
            return title, f"{title}: {words.kind(card)}, {words.origin(card)}"
        if path is not None:
            return "Loading…", str(path)
        return f"No {words.role.lower()}", words.hint


class ModelCardDialog(Dialog):
    """Dialog of facts from the header of a model file, which is not loaded for it."""

    def __init__(self, page: ModelPage, parent: QWidget) -> None:
        super().__init__(f"Model: {page.title}", parent)
        head = [title(page.title)]
        if page.simulated:
            badge = QLabel("simulated data only", self)
            badge.setObjectName("badge")
            badge.setToolTip("No real radar was there when this model learned")
            head.append(badge)
        facts = QTextBrowser(self)
        facts.setAccessibleName("What the model is")
        muted = self.palette().placeholderText().color().name()
        facts.document().setDefaultStyleSheet(f".name {{ color: {muted}; }}")
        facts.setHtml("".join(starmap(_section, (("", page.rows), *page.sections))))
        above = side_by_side(*head, spacing_px=12)
        self.setLayout(column_of(above, (facts, 1), closing(self), spacing_px=12, margins_px=16))
        self.resize(640, 560)


def _section(heading: str, rows: Sequence[tuple[str, str]]) -> str:
    """Rows of a page as HTML; a thousand labels in a form would take more than a second."""
    lines = "".join(
        f'<tr><td class="name" width="28%">{escape(name)}</td><td>{_lines(text)}</td></tr>'
        if name
        else f'<tr><td colspan="2">{_lines(text)}</td></tr>'
        for name, text in rows
    )
    above = f"<h3>{escape(heading)}</h3>" if heading else ""
    return f'{above}<table width="100%" cellpadding="3">{lines}</table>'


def _lines(text: str) -> str:
    return escape(text).replace("\n", "<br>")
