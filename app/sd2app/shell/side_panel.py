"""Panels that share the column at the side: an icon for each, one open at a time."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import Protocol, runtime_checkable

from PySide6.QtCore import QEvent, QObject, QPoint, QRect, QRectF, QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QAction, QColor, QKeyEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QFrame, QScrollArea, QSplitter, QStackedWidget, QToolButton, QWidget

from sd2app.manual.help import HELP, help_button
from sd2app.session.display import Layouts
from sd2app.settings import Settings
from sd2app.widgets.icons import draw_panel_icon, draw_ring
from sd2app.widgets.inputs import action_button
from sd2app.widgets.layouts import ANY_WIDTH_PX, STRETCH, column_of, row_of
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


_USUAL_PX = {"Labels": 560}
"""Widths of panels with one of their own, until the user chooses another: of the table of spans."""
_SHOWN, _FOLDED = "panel", "folded"
_MAX_SHARE = 0.44
"""Share of the window that a panel with a width of its own takes before the user says so."""
_EDGES_PX = 2
_BESIDE_FROM_PX, _WORDED_FROM_PX = 1100, 1200
"""Widths of the window that have room for a panel beside the maps, and for words at its icons."""
_PLACED_AGAIN = {QEvent.Type.Resize, QEvent.Type.Move, QEvent.Type.Show, QEvent.Type.LayoutRequest}


class SideDock(QObject):
    """Lays the frame of the panels over the last part of a splitter, and remembers its widths.

    That part is as wide as the open panel where it stands beside the rest, and as its icons where
    it is folded or lies over the rest.

    Parameters
    ----------
    frame : QWidget
        Holds the panels; a child of a widget around the splitter.
    splitter : QSplitter
    side : SidePanel
    settings : Settings
    layouts : Layouts
        Remember which panel is open, if any, and where it stands.
    """

    def __init__(
        self,
        frame: QWidget,
        splitter: QSplitter,
        side: SidePanel,
        settings: Settings,
        layouts: Layouts,
    ) -> None:
        super().__init__(side)
        room = splitter.widget(splitter.count() - 1)
        assert room is not None
        self._frame, self._splitter, self._room, self._side = frame, splitter, room, side
        self._settings, self._layouts = settings, layouts
        self._otherwise_px = splitter.sizes()[-1]
        self._shown = side.shown
        self._fits: tuple[bool, bool] | None = None
        self._bars: tuple[QWidget, ...] = ()
        side.turned.connect(self._turn)
        side.folded_changed.connect(self._widen)
        layouts.panes_changed.connect(self._widen)
        splitter.splitterMoved.connect(self._remember)
        for watched in (room, splitter, frame):
            watched.installEventFilter(self)

    def restore(self) -> None:
        """Open the panel that the layout had, or none."""
        layouts = self._layouts
        shown = layouts.kept(_SHOWN, layouts.usual.panel)
        with QSignalBlocker(self._side):  # widths are to stay what was chosen
            self._side.bring_up(shown if shown in self._side.names else layouts.usual.panel)
            self._side.set_folded(layouts.kept(_FOLDED, layouts.usual.folded))
        self._shown = self._side.shown
        self._widen()

    def remember(self) -> None:
        """Keep for the layout which panel is open, or that none is."""
        self._layouts.keep(_SHOWN, self._shown)
        self._layouts.keep(_FOLDED, self._side.folded)

    def keep_clear(self, bars: Iterable[QWidget]) -> None:
        """Let these bars end where the panel lies over them."""
        self._bars = tuple(bars)
        for bar in self._bars:
            bar.installEventFilter(self)

    @property
    def _beside(self) -> bool:
        """True while the room of the splitter is the panel's; a narrow window has none beside."""
        over = self._layouts.shows("over") or self._splitter.width() < _BESIDE_FROM_PX
        return not self._side.folded and not over

    def _remember(self) -> None:
        wide_px = self._splitter.sizes()[-1]
        if wide_px and self._beside:  # none while nothing is open
            self._settings.set_value(self._name(self._shown), wide_px)

    def _turn(self) -> None:
        if self._shown not in _USUAL_PX:
            # A wide panel's width counts where a hand chose it: a small window may have cut it.
            self._remember()
        before, self._shown = self._shown, self._side.shown
        if self._name(before) != self._name(self._shown):
            self._widen()

    @property
    def _wide_px(self) -> int:
        """Width of the open panel that the user chose, or its usual one, for its content."""
        usual_px = min(_USUAL_PX.get(self._shown, 0), round(_MAX_SHARE * self._splitter.width()))
        usual_px = max(usual_px, self._otherwise_px)
        chosen_px = self._settings.stored(self._name(self._shown), usual_px)
        return max(chosen_px, self._frame.minimumSizeHint().width())

    def _fit(self) -> None:
        """Let icons have their words, and the panel its room, where the window is wide."""
        wide_px = self._splitter.width()
        fits = wide_px >= _BESIDE_FROM_PX, wide_px >= _WORDED_FROM_PX
        if fits != self._fits:
            self._fits = fits
            self._side.set_room(*fits)
            self._widen()

    @property
    def _is_wide_enough(self) -> bool:
        least_px = self._frame.minimumSizeHint().width()
        room_px = self._room.width() if self._beside else self._frame.width()
        return self._side.folded or room_px >= least_px

    def _widen(self) -> None:
        """Give the panel its room."""
        rail_px = self._side.rail_px + _EDGES_PX
        wide_px = self._wide_px if self._beside else rail_px
        self._room.setMaximumWidth(ANY_WIDTH_PX if self._beside else rail_px)
        self._room.setMinimumWidth(self._frame.minimumSizeHint().width() if self._beside else 0)
        *others, beside, now_px = self._splitter.sizes()
        self._splitter.setSizes([*others, beside + now_px - wide_px, wide_px])
        self._place()

    def _place(self) -> None:
        """Lay the panels over their room, and over more to the left of it."""
        parent = self._frame.parentWidget()
        assert parent is not None
        place = QRect(self._room.mapTo(parent, QPoint(0, 0)), self._room.size())
        if not self._side.folded and not self._beside:
            place.setLeft(max(place.right() + 1 - self._wide_px, 0))
        self._frame.setGeometry(place)
        for bar in self._bars:
            covered_px = bar.mapTo(parent, bar.rect().topRight()).x() + 1 - place.left()
            bar.setContentsMargins(0, 0, max(covered_px, 0), 0)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Follow the splitter, and the needs of the open panel."""
        if event.type() in _PLACED_AGAIN:
            if watched is self._splitter and event.type() == QEvent.Type.Resize:
                self._fit()
            if watched is self._room and event.type() == QEvent.Type.Show:
                self._widen()
            elif watched is not self._frame:
                self._place()
            elif event.type() == QEvent.Type.LayoutRequest and not self._is_wide_enough:
                self._widen()
        return False

    def _name(self, shown: str) -> str:
        return f"panel/width/{shown if shown in _USUAL_PX else ''}"
