"""Menus of labels whose entries come from models: the tracks, and the reaction time."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtGui import QAction, QActionGroup
from PySide6.QtWidgets import QMenu

from sd2app.labels.model import LabelsModel
from sd2app.labels.reaction import OFFERED_MS, ReactionModel
from sd2core.labels.spans import LabelTrack


class TrackMenu:
    """The tracks first, to choose on which new spans come."""

    def __init__(self, menu: QMenu, labels: LabelsModel) -> None:
        self._menu, self._labels = menu, labels
        self._group = QActionGroup(menu)
        self._first = menu.addSeparator()
        self._shown: tuple[LabelTrack, ...] = ()
        labels.changed.connect(self._follow)
        labels.selection_changed.connect(self._check)
        self._follow()

    def _follow(self) -> None:
        tracks = self._labels.labels.tracks
        if tracks != self._shown:
            self._shown = tracks
            for action in self._group.actions():
                self._group.removeAction(action)
                self._menu.removeAction(action)
                action.deleteLater()
            self._menu.insertActions(self._first, [self._made(track) for track in tracks])
        self._check()

    def _made(self, track: LabelTrack) -> QAction:
        # An ampersand would underline what comes after it.
        action = QAction(track.name.replace("&", "&&"), self._menu)
        action.setCheckable(True)
        action.setToolTip("Spans may overlap" if track.overlap == "free" else "One span at a time")
        action.triggered.connect(lambda _=False: self._labels.set_track(track.name))
        self._group.addAction(action)
        return action

    def _check(self) -> None:
        for action, track in zip(self._group.actions(), self._shown, strict=True):
            action.setChecked(track.name == self._labels.track)


class ReactionMenu(QMenu):
    """By how much marks are put back, and what else it could be."""

    def __init__(self, reaction: ReactionModel, ask: Callable[[], None], parent: QMenu) -> None:
        super().__init__("Reaction time", parent)
        self.setToolTipsVisible(True)
        self._reaction = reaction
        group = QActionGroup(self)
        self._offered = {offered_ms: self._made(offered_ms, group) for offered_ms in OFFERED_MS}
        self._other = self.addAction("Other…")
        self._other.setCheckable(True)
        group.addAction(self._other)
        self._other.triggered.connect(lambda _=False: (ask(), self._follow()))
        reaction.changed.connect(self._follow)
        self._follow()

    def _made(self, offered_ms: int, group: QActionGroup) -> QAction:
        action = self.addAction(f"{offered_ms} ms" if offered_ms else "None")
        action.setCheckable(True)
        action.setToolTip("Marks made while it plays begin and end earlier by so much")
        group.addAction(action)
        action.triggered.connect(lambda _=False: self._reaction.set_reaction_ms(offered_ms))
        return action

    def _follow(self) -> None:
        chosen_ms = self._reaction.reaction_ms
        other = chosen_ms not in self._offered
        self._other.setText(f"Other: {chosen_ms} ms…" if other else "Other…")
        (self._other if other else self._offered[chosen_ms]).setChecked(True)
