"""Panels that share the column at the side: an icon for each, one open at a time."""

from __future__ import annotations

from functools import partial
from typing import Protocol, runtime_checkable

from PySide6.QtCore import QEvent, QObject, QPoint, QRect, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QAction, QColor, QKeyEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QFrame, QScrollArea, QStackedWidget, QToolButton, QWidget

from sd2app.manual.help import HELP, help_button
from sd2app.widgets.icons import draw_panel_icon, draw_ring
from sd2app.widgets.inputs import action_button
from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import outlined, title

_ICON_PX = 20
_BARE_PX, _WORDED_PX = QSize(36, 36), QSize(65, 46)
"""Sizes of an icon alone, and with its word below it."""
_RAIL_MARGINS_PX = 8
_WORD_PX = 11
_STEPS = {Qt.Key.Key_Up: -1, Qt.Key.Key_Down: 1}


@runtime_checkable
class Paged(Protocol):
    """Panel of several pages."""

    page: str  # name of the one that is shown

    def turn_to(self, page: str) -> None:
        """Show a page by its name."""


class SidePanel(QFrame):
    """Open panel under its title, scrolled where it is high, beside a rail with an icon for each.

    The icon of the open panel folds it away, so that only the rail is left; any icon opens it.
    """

    turned = Signal()
    folded_changed = Signal()

    def __init__(self, pages: dict[str, QWidget], over: QAction) -> None:
        super().__init__()
        self.names = list(pages)
        self._pages = dict(pages)
        self._stack = QStackedWidget(self)
        self._title = title("", "Open panel")
        tip = "Fold the panel away"
        fold = outlined("»", tip, lambda: self.set_folded(True), self, name=tip, look="")
        self._icons = [RailButton(name, self) for name in pages]
        for place, (icon, page) in enumerate(zip(self._icons, pages.values(), strict=True)):
            icon.clicked.connect(partial(self._click, place))
            icon.stepped.connect(self._step)
            self._stack.addWidget(_Scrolled(page))
        # Elsewhere in the window its key opens the first page.
        guide = help_button(self._topic, self, key="")
        self._floating = floating = action_button(over, "Over maps")
        head = row_of(
            (self._title, 1), floating, guide, fold, spacing_px=2, margins_px=(8, 4, 4, 0)
        )
        self._open = QFrame(self)
        self._open.setObjectName("opened")
        self._open.setLayout(column_of(head, (self._stack, 1), spacing_px=2, margins_px=0))
        self._rail = rail = QFrame(self)
        self.set_room(True, True)
        rail.setLayout(column_of(*self._icons, STRETCH, spacing_px=4, margins_px=(4, 4, 3, 4)))
        self.setLayout(row_of((self._open, 1), rail, spacing_px=0, margins_px=0))
        self._turn(0)

    @property
    def shown(self) -> str:
        """Name of the panel in front."""
        return self.names[self._stack.currentIndex()]

    @property
    def folded(self) -> bool:
        """True while only the icons are there."""
        return self._open.isHidden()

    def set_folded(self, folded: bool) -> None:
        """Fold the open panel away, or bring it back."""
        if folded != self.folded:
            self._open.setVisible(not folded)
            self._icons[self._stack.currentIndex()].setChecked(not folded)
            self.folded_changed.emit()

    @property
    def rail_px(self) -> int:
        """Width of the icons, which stand alone while the panel is folded."""
        return self._rail.width()

    def set_room(self, beside: bool, worded: bool) -> None:
        """Offer a place over the maps where one is beside, and words where icons have room."""
        self._floating.setVisible(beside)
        for icon in self._icons:
            icon.set_worded(worded)
        self._rail.setFixedWidth(self._icons[0].width() + _RAIL_MARGINS_PX)

    def bring_up(self, name: str, page: str = "") -> None:
        """Show a panel, and a page of one that has several."""
        self.set_folded(False)
        self._turn(self.names.index(name))
        if page:
            shown = self._pages[name]
            assert isinstance(shown, Paged)
            shown.turn_to(page)

    def button(self, name: str) -> RailButton:
        """Icon of a panel."""
        return self._icons[self.names.index(name)]

    def _topic(self) -> str:
        """Topic of the help: the page of a panel where that has help of its own."""
        panel = self._pages[self.shown]
        page = panel.page if isinstance(panel, Paged) else ""
        return page if page in HELP else self.shown

    def _click(self, place: int) -> None:
        if place == self._stack.currentIndex():
            self.set_folded(not self.folded)
        else:
            self.bring_up(self.names[place])

    def _step(self, by: int) -> None:
        """Open the panel whose icon is above or below, with the keyboard on that icon."""
        place = min(max(self._stack.currentIndex() + by, 0), len(self.names) - 1)
        self.bring_up(self.names[place])
        self._icons[place].setFocus(Qt.FocusReason.TabFocusReason)

    def _turn(self, place: int) -> None:
        self._stack.setCurrentIndex(place)
        self._title.setText(self.names[place])
        for number, button in enumerate(self._icons):
            button.setChecked(number == place and not self.folded)
            # The open panel's icon stands for all of them in the order of the keyboard.
            button.setFocusPolicy(
                Qt.FocusPolicy.TabFocus if number == place else Qt.FocusPolicy.NoFocus
            )
        self.turned.emit()


class RailButton(QToolButton):
    """Icon of a panel, with a ring around it while something is being done there."""

    stepped = Signal(int)  # to the panels above and below, by the arrows

    def __init__(self, name: str, parent: QWidget) -> None:
        super().__init__(parent)
        self.setObjectName("rail")
        self.setCheckable(True)
        self.name = name
        self._worded = False
        self.mark = ""
        self.share: float | None = None
        self._say()

    def set_worded(self, worded: bool) -> None:
        """Write the name below the icon, or show it alone."""
        self._worded = worded
        self.setFixedSize(_WORDED_PX if worded else _BARE_PX)

    def set_mark(self, mark: str, share: float | None) -> None:
        """Say how far what is being done is; nothing is being done without a word."""
        self.mark, self.share = mark, share
        self._say()

    def _say(self) -> None:
        words = f"{self.name} · {self.mark}" if self.mark else self.name
        self.setAccessibleName(words)
        self.setToolTip(words)
        self.update()

    def nextCheckState(self) -> None:
        """Leave it to the panel what is open after a click."""

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Go to the panels above and below with the arrows."""
        if event.key() in _STEPS:
            self.stepped.emit(_STEPS[Qt.Key(event.key())])
        else:
            super().keyPressEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the icon in the colour of the text, and the ring."""
        super().paintEvent(event)
        palette = self.palette()
        with QPainter(self) as painter:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            text = palette.text().color()
            colour = text if self.isChecked() else palette.placeholderText().color()
            place = QRect(QPoint(0, 0), _BARE_PX)
            if self._worded:
                place.moveLeft((self.width() - place.width()) // 2)
                place.moveTop(-4)
                font = self.font()
                font.setPixelSize(_WORD_PX)
                painter.setFont(font)
                painter.setPen(colour)
                painter.drawText(
                    self.rect().adjusted(0, 0, 0, -4),
                    Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignBottom,
                    self.name,
                )
            if self.mark:
                ground = QColor(text)
                ground.setAlpha(50)
                ring = place.adjusted(4, 4, -4, -4) if self._worded else place
                draw_ring(painter, ring, self.share, palette.highlight().color(), ground)
            inset_px = (place.width() - _ICON_PX) // 2
            inset = place.adjusted(inset_px, inset_px, -inset_px, -inset_px)
            draw_panel_icon(painter, QRectF(inset), self.name, colour)


class _Scrolled(QScrollArea):
    """Scrolls a page where it is high, and is as wide as it needs."""

    def __init__(self, page: QWidget) -> None:
        super().__init__()
        self._page = page
        self.setWidget(page)
        self.setWidgetResizable(True)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self._give_room()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Follow what the page needs."""
        if event.type() == QEvent.Type.LayoutRequest:
            self._give_room()
        return super().eventFilter(watched, event)

    def _give_room(self) -> None:
        bar_px = self.verticalScrollBar().sizeHint().width()
        self.setMinimumWidth(self._page.minimumSizeHint().width() + bar_px)
