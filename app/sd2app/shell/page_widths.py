"""Panels at the side that need more room than others get it while they are in front."""

from __future__ import annotations

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QSplitter

from sd2app.settings import Settings
from sd2app.shell.side_panel import SidePanel

_SHOWN = "panel/shown"


class PageWidths(QObject):
    """Remembers which panel is in front, and how wide the last part of a splitter is for it.

    Parameters
    ----------
    splitter : QSplitter
        The panels are in its last part; the part before gives or takes.
    usual : dict
        Width in pixels of the panels that have one of their own, until the user chooses another.
    """

    def __init__(
        self, splitter: QSplitter, side: SidePanel, usual: dict[str, int], settings: Settings
    ) -> None:
        super().__init__(side)
        self._splitter, self._side, self._settings = splitter, side, settings
        self._usual = usual
        side.bring_up(settings.stored(_SHOWN, side.shown))
        self._shown = side.shown
        side.currentChanged.connect(self._turn)
        splitter.splitterMoved.connect(self._remember)

    def remember(self) -> None:
        """Keep which panel is in front."""
        self._settings.set_value(_SHOWN, self._shown)

    def _remember(self) -> None:
        self._settings.set_value(self._name(self._shown), self._splitter.sizes()[-1])

    def _turn(self) -> None:
        if self._shown not in self._usual:
            # A wide panel's width counts where a hand chose it: a small window may have cut it.
            self._remember()
        before, self._shown = self._shown, self._side.shown
        if self._name(before) == self._name(self._shown):
            return
        *others, beside, now_px = self._splitter.sizes()
        usual_px = self._usual.get(self._shown, now_px)
        wide_px = self._settings.stored(self._name(self._shown), usual_px)
        self._splitter.setSizes([*others, beside + now_px - wide_px, wide_px])

    def _name(self, shown: str) -> str:
        return f"panel/width/{shown if shown in self._usual else ''}"
