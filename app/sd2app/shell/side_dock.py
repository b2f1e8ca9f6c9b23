"""Place of the panel at the side: beside the maps or over them, as wide as it is wanted."""

from __future__ import annotations

from collections.abc import Iterable

from PySide6.QtCore import QEvent, QObject, QPoint, QRect, QSignalBlocker
from PySide6.QtWidgets import QSplitter, QWidget

from sd2app.session.display import Layouts
from sd2app.settings import Settings
from sd2app.shell.side_panel import SidePanel
from sd2app.widgets.layouts import ANY_WIDTH_PX

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
