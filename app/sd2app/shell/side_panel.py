"""Panels that share one place, one tab each."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QScrollArea, QTabWidget, QWidget


@runtime_checkable
class Paged(Protocol):
    """Panel of several pages."""

    def turn_to(self, page: str) -> None:
        """Show a page by its name."""


class SidePanel(QTabWidget):
    """Tabs by name; what does not fit is scrolled."""

    def __init__(self, pages: dict[str, QWidget], parent: QWidget | None = None) -> None:
        super().__init__(parent)
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
