"""Panels that share one place, one tab each, and the room that each of them gets."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from PySide6.QtCore import QObject, Qt
from PySide6.QtWidgets import QScrollArea, QSplitter, QTabWidget, QWidget

from sd2app.settings import Settings

_SHOWN = "panel/shown"


@runtime_checkable
class Paged(Protocol):
    """Panel of several pages."""

    def turn_to(self, page: str) -> None:
        """Show a page by its name."""


class SidePanel(QTabWidget):
    """Tabs by name; what does not fit is scrolled."""

    def __init__(self, pages: dict[str, QWidget]) -> None:
        super().__init__()
        self.setDocumentMode(True)
        self.tabBar().setDrawBase(False)
        self.tabBar().setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self._names = list(pages)
        self._pages = dict(pages)
        for name, page in pages.items():
            self.addTab(_scrolled(page), name)

    @property
    def shown(self) -> str:
        """Name of the panel in front."""
        return self._names[self.currentIndex()]

    def set_mark(self, name: str, mark: str) -> None:
        """Say a word about a panel beside its name, or none."""
        index = self._names.index(name)
        text = f"{name} · {mark}" if mark else name
        if text != self.tabText(index):
            self.setTabText(index, text)

    def bring_up(self, name: str, page: str = "") -> None:
        """Show a panel, and a page of one that has several."""
        self.setCurrentIndex(self._names.index(name))
        if page:
            shown = self._pages[name]
            assert isinstance(shown, Paged)
            shown.turn_to(page)


def _scrolled(widget: QWidget) -> QScrollArea:
    scroll = QScrollArea()
    scroll.setWidget(widget)
    scroll.setWidgetResizable(True)
    scroll.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    bar = scroll.verticalScrollBar().sizeHint().width()
    scroll.setMinimumWidth(widget.minimumSizeHint().width() + bar)
    return scroll


class PageWidths(QObject):
    """Remembers which panel is in front, and how wide the last part of a splitter is for it.

    The panels are in that part; the one before gives or takes. ``usual`` has the widths in pixels
    of the panels with a width of their own, until the user chooses another.
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
