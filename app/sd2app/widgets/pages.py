"""Several pages inside a panel: one at a time, a button for each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QButtonGroup, QSizePolicy, QStackedWidget, QWidget

from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import outlined


class InnerPage(NamedTuple):
    """Button text, tooltip and content of a page."""

    name: str
    tip: str
    page: QWidget


class InnerPages(QWidget):
    """Buttons on top, the page below; ``beside`` is put to the right of the buttons."""

    turned = Signal(int)  # number of the page that is shown now

    def __init__(
        self, pages: Sequence[InnerPage], beside: QWidget | None = None, inset_px: int = 0
    ) -> None:
        super().__init__()
        self.names = [page.name for page in pages]
        self._pages = QStackedWidget(self)
        self._pages.currentChanged.connect(self.turned)
        self._buttons = QButtonGroup(self)
        for place, page in enumerate(pages):
            self._pages.addWidget(page.page)
            button = outlined(page.name, page.tip, None, self, look="")
            button.setCheckable(True)
            button.setChecked(place == 0)
            self._buttons.addButton(button, place)
        self._buttons.idClicked.connect(self._pages.setCurrentIndex)
        self._pages.currentChanged.connect(self._give_room)
        self._give_room(0)
        top = row_of(
            *self._buttons.buttons(), STRETCH if beside is None else (beside, 1), spacing_px=6
        )
        top.setContentsMargins(inset_px, 0, inset_px, 0)
        self.setLayout(column_of(top, (self._pages, 1), spacing_px=6, margins_px=0))

    @property
    def shown(self) -> int:
        """Number of the page that is shown."""
        return self._pages.currentIndex()

    @property
    def page(self) -> str:
        """First name of the page that is shown."""
        return self.names[self.shown]

    def turn_to(self, page: str) -> None:
        """Show a page by its first name."""
        place = self.names.index(page)
        self._buttons.button(place).setChecked(True)
        self._pages.setCurrentIndex(place)

    def name_page(self, place: int, name: str) -> None:
        """Rename the button of a page."""
        button = self._buttons.button(place)
        button.setText(name)
        button.setAccessibleName(name)

    def _give_room(self, shown: int) -> None:
        """The page that is shown says how much room is needed, and no other."""
        policy = QSizePolicy.Policy
        for place in range(self._pages.count()):
            kept = policy.Preferred if place == shown else policy.Ignored
            page = self._pages.widget(place)
            assert page is not None
            page.setSizePolicy(policy.Preferred, kept)
            # The arrows lead to the others.
            focus = Qt.FocusPolicy.TabFocus if place == shown else Qt.FocusPolicy.NoFocus
            self._buttons.button(place).setFocusPolicy(focus)


def paged_panel(*pages: InnerPage) -> InnerPages:
    """A panel at the side that has pages of its own."""
    panel = InnerPages(pages, inset_px=8)
    panel.setObjectName("page")
    return panel
