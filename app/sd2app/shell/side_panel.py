"""Panels that share the column at the side: an icon for each, one open at a time."""

from __future__ import annotations

from functools import partial
from typing import Protocol, runtime_checkable

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtGui import QColor, QKeyEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QFrame, QScrollArea, QSplitter, QStackedWidget, QToolButton, QWidget

from sd2app.manual.help import HELP, help_button
from sd2app.settings import Settings
from sd2app.widgets.icons import draw_panel_icon, draw_ring
from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import outlined, title

_SHOWN, _FOLDED = "panel/shown", "panel/folded"
_RAIL_PX, _BUTTON_PX, _ICON_PX = 44, 36, 20
_MAX_SHARE = 0.42
"""Share of the window that a panel with a width of its own takes before the user says so."""
_ANY_WIDTH_PX = (1 << 24) - 1  # Qt's largest
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

    def __init__(self, pages: dict[str, QWidget]) -> None:
        super().__init__()
        self._names = list(pages)
        self._pages = dict(pages)
        self._stack = QStackedWidget(self)
        self._title = title("", "Open panel")
        tip = "Fold the panel away"
        fold = outlined("»", tip, lambda: self.set_folded(True), self, name=tip, look="")
        self._icons = [RailButton(name, self) for name in pages]
        for place, (icon, page) in enumerate(zip(self._icons, pages.values(), strict=True)):
            icon.clicked.connect(partial(self._click, place))
            icon.stepped.connect(self._step)
            self._stack.addWidget(_scrolled(page))
        # Elsewhere in the window its key opens the first page.
        guide = help_button(self._topic, self, key="")
        head = row_of((self._title, 1), guide, fold, spacing_px=2, margins_px=(8, 4, 4, 0))
        self._open = QWidget(self)
        self._open.setLayout(column_of(head, (self._stack, 1), spacing_px=2, margins_px=0))
        rail = QFrame(self)
        rail.setObjectName("rail")
        rail.setFixedWidth(_RAIL_PX)
        rail.setLayout(column_of(*self._icons, STRETCH, spacing_px=4, margins_px=(4, 4, 3, 4)))
        self.setLayout(row_of((self._open, 1), rail, spacing_px=0, margins_px=0))
        self._turn(0)

    @property
    def shown(self) -> str:
        """Name of the panel in front."""
        return self._names[self._stack.currentIndex()]

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

    def set_mark(self, name: str, mark: str, share: float | None = None) -> None:
        """Say a word about a panel with its name, and show how much is done as a ring."""
        self._icons[self._names.index(name)].set_mark(mark, share)

    def bring_up(self, name: str, page: str = "") -> None:
        """Show a panel, and a page of one that has several."""
        self.set_folded(False)
        self._turn(self._names.index(name))
        if page:
            shown = self._pages[name]
            assert isinstance(shown, Paged)
            shown.turn_to(page)

    def button(self, name: str) -> RailButton:
        """Icon of a panel."""
        return self._icons[self._names.index(name)]

    def _topic(self) -> str:
        """What help is about: the page of a panel where that has help of its own."""
        panel = self._pages[self.shown]
        page = panel.page if isinstance(panel, Paged) else ""
        return page if page in HELP else self.shown

    def _click(self, place: int) -> None:
        if place == self._stack.currentIndex():
            self.set_folded(not self.folded)
        else:
            self.bring_up(self._names[place])

    def _step(self, by: int) -> None:
        """Open the panel whose icon is above or below, with the keyboard on that icon."""
        place = min(max(self._stack.currentIndex() + by, 0), len(self._names) - 1)
        self.bring_up(self._names[place])
        self._icons[place].setFocus(Qt.FocusReason.TabFocusReason)

    def _turn(self, place: int) -> None:
        self._stack.setCurrentIndex(place)
        self._title.setText(self._names[place])
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
        self.setFixedSize(_BUTTON_PX, _BUTTON_PX)
        self.name = name
        self.mark = ""
        self.share: float | None = None
        self._say()

    def set_mark(self, mark: str, share: float | None) -> None:
        """Say how far what is being done is; nothing is being done without a word."""
        if (mark, share) != (self.mark, self.share):
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
            if self.mark:
                ground = QColor(text)
                ground.setAlpha(50)
                draw_ring(painter, self.rect(), self.share, palette.highlight().color(), ground)
            painter.translate((self.width() - _ICON_PX) / 2, (self.height() - _ICON_PX) / 2)
            draw_panel_icon(painter, self.name, colour)


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
    """Remembers which panel is open, if any, and how wide the last part of a splitter is for it.

    The panels are in that part; the one before gives or takes. ``usual`` has the widths in pixels
    of the panels with a width of their own, until the user chooses another.
    """

    def __init__(
        self, splitter: QSplitter, side: SidePanel, usual: dict[str, int], settings: Settings
    ) -> None:
        super().__init__(side)
        self._splitter, self._side, self._settings = splitter, side, settings
        self._usual = usual
        self._otherwise_px = splitter.sizes()[-1]
        side.bring_up(settings.stored(_SHOWN, side.shown))
        side.set_folded(settings.flag(_FOLDED, False))
        self._shown = side.shown
        self._widen()
        side.turned.connect(self._turn)
        side.folded_changed.connect(self._widen)
        splitter.splitterMoved.connect(self._remember)

    def remember(self) -> None:
        """Keep which panel is open, or that none is."""
        self._settings.set_value(_SHOWN, self._shown)
        self._settings.set_value(_FOLDED, self._side.folded)

    def _remember(self) -> None:
        wide_px = self._splitter.sizes()[-1]
        if wide_px and not self._side.folded:  # none while nothing is open
            self._settings.set_value(self._name(self._shown), wide_px)

    def _turn(self) -> None:
        if self._shown not in self._usual:
            # A wide panel's width counts where a hand chose it: a small window may have cut it.
            self._remember()
        before, self._shown = self._shown, self._side.shown
        if self._name(before) != self._name(self._shown):
            self._widen()

    def _widen(self) -> None:
        """Give the open panel the width that the user chose, or its usual one."""
        *others, beside, now_px = self._splitter.sizes()
        all_px = sum(others) + beside + now_px
        usual_px = self._usual.get(self._shown, 0)
        usual_px = max(min(usual_px, round(_MAX_SHARE * all_px)), self._otherwise_px)
        wide_px = self._settings.stored(self._name(self._shown), usual_px)
        part = self._splitter.widget(self._splitter.count() - 1)
        assert part is not None
        part.setMaximumWidth(_ANY_WIDTH_PX)
        if self._side.folded:
            wide_px = _RAIL_PX + 2  # with the frame's pixel on either side
            part.setMaximumWidth(wide_px)
        self._splitter.setSizes([*others, beside + now_px - wide_px, wide_px])

    def _name(self, shown: str) -> str:
        return f"panel/width/{shown if shown in self._usual else ''}"
