"""The table of actions as Qt actions of one window, with its menus."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QMenu

from sd2app.labels.label_keys import LabelActions
from sd2app.labels.menus import ReactionMenu, TrackMenu
from sd2app.shell.actions import ACTIONS, Action
from sd2app.widgets.icons import transport_icon
from sd2app.widgets.key_text import native

if TYPE_CHECKING:
    from sd2app.shell.window import MainWindow

_SUBMENUS = {"Tracks": "Labels"}
_MENUS = ("File", "Edit", "View", "Play", "Labels", "Model", "Help")


class ActionSet:
    """Makes the actions, keeps them enabled and checked as the models say."""

    def __init__(self, window: MainWindow) -> None:
        self._window = window
        self._context = window.context
        self._actions: dict[str, QAction] = {}
        for row in ACTIONS:
            action = QAction(row.text, window)
            action.setCheckable(row.checked is not None)
            action.triggered.connect(lambda _=False, run=row.run: run(window))
            self._actions[row.id] = action
        self._context.keys.changed.connect(self._follow_keys)
        self._follow_keys()

    def __getitem__(self, name: str) -> QAction:
        return self._actions[name]

    def fill_menu_bar(self, models: QMenu, classifiers: QMenu) -> QMenu:
        """Make the menus; returns the one for recent files, which the window fills.

        ``models`` and ``classifiers`` are put into the menu of models.
        """
        bar = self._window.menuBar()
        menus = {name: bar.addMenu(f"&{name}") for name in _MENUS}
        for menu in menus.values():
            menu.setToolTipsVisible(True)
        self.labels = LabelActions(self._window, menus["Labels"])
        recent = QMenu("Open recent", menus["File"])
        menus["Model"].addMenu(models)
        for row in ACTIONS:
            if row.menu not in menus:
                menus[row.menu] = self._submenu(row.menu, menus[_SUBMENUS[row.menu]])
            if row.separator_before:
                menus[row.menu].addSeparator()
            if row.id == "open_classifier":
                menus["Model"].addSeparator()
                menus["Model"].addMenu(classifiers)
            menus[row.menu].addAction(self._actions[row.id])
            if row.id == "open_folder":
                menus["File"].addMenu(recent)
            if row.id == "carve_marks":
                ask = self._window.track_dialogs.reaction
                self.reaction = ReactionMenu(self._context.reaction, ask, menus["Labels"])
                menus["Labels"].addMenu(self.reaction)
        return recent

    def _submenu(self, name: str, above: QMenu) -> QMenu:
        made = above.addMenu(name)
        made.setToolTipsVisible(True)
        self.tracks = TrackMenu(made, self._context.labels)
        return made

    def refresh(self) -> None:
        """Follow the models."""
        refusal = self._context.label_edits.refusal
        self.labels.refresh(refusal)
        for row in ACTIONS:
            action = self._actions[row.id]
            refused = refusal if row.edits_labels else ""
            action.setEnabled(row.enabled(self._context) and not refused)
            if row.edits_labels or row.why_not is not None:
                why_not = row.why_not(self._context) if row.why_not is not None else ""
                action.setToolTip(refused or why_not or self._tip(row))
            if row.checked is not None:
                action.setChecked(row.checked(self._context))
        stack = self._context.document.undo_stack
        self._actions["undo"].setText(f"Undo {stack.undoText().lower()}".rstrip())
        self._actions["redo"].setText(f"Redo {stack.redoText().lower()}".rstrip())
        playing = self._context.playback.playing
        if playing != (self._actions["play"].text() == "Pause"):
            self._actions["play"].setText("Pause" if playing else "Play")
            self._set_icon("play", "pause" if playing else "play")

    def refresh_one(self, name: str) -> None:
        """Follow the models with one action, which changes with every frame."""
        row = next(row for row in ACTIONS if row.id == name)
        self._actions[name].setEnabled(row.enabled(self._context))

    def restyle(self) -> None:
        """Draw the icons in the colour of the theme."""
        for row in ACTIONS:
            if row.icon:
                self._set_icon(row.id, row.icon)
        if self._context.playback.playing:
            self._set_icon("play", "pause")

    def _set_icon(self, name: str, icon: str) -> None:
        self._actions[name].setIcon(transport_icon(icon, self._context.display.palette.text))

    def _follow_keys(self) -> None:
        keys = self._context.keys
        # Keys that change hands are nobody's in between.
        for action in self._actions.values():
            action.setShortcuts([])
        for name, action in self._actions.items():
            action.setShortcuts([QKeySequence(key) for key in keys.keys_of(name)])
        for row in ACTIONS:
            self._actions[row.id].setToolTip(self._tip(row))

    def _tip(self, row: Action) -> str:
        keys = ", ".join(map(native, self._context.keys.keys_of(row.id)))
        return f"{row.tip} ({keys})" if keys else row.tip
