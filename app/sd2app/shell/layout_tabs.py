"""Tabs at the top of the window, one for each layout."""

from __future__ import annotations

from PySide6.QtWidgets import QTabBar, QWidget

from sd2app.session.display import LAYOUTS, Layouts


class LayoutTabs(QTabBar):
    """A tab for each layout."""

    def __init__(self, layouts: Layouts, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAccessibleName("Layout")
        self.setObjectName("layouts")
        self.setDrawBase(False)
        self.setExpanding(False)
        for place, (name, layout) in enumerate(LAYOUTS.items()):
            self.addTab(name)
            self.setTabToolTip(place, layout.tip)
        self._layouts = layouts
        layouts.changed.connect(self._follow)
        self._follow()
        self.currentChanged.connect(lambda place: layouts.choose(list(LAYOUTS)[place]))

    def _follow(self) -> None:
        self.setCurrentIndex(list(LAYOUTS).index(self._layouts.name))
