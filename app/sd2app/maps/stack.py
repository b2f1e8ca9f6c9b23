"""The Doppler maps one above the other, as the user arranged them, and their difference."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QObject, QPointF, QRectF, Qt, Signal, SignalInstance
from PySide6.QtGui import (
    QColor,
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QFrame, QMenu, QScrollArea, QScrollBar, QWidget

from sd2app.maps.arrangement import BELOW_PX, HEADER_PX, MIN_PX, Arrangement, heights_px
from sd2app.maps.difference import DifferenceModel
from sd2app.maps.heatmap import BinMarks, HeatmapView
from sd2app.maps.heatmap_image import Overview, difference_image
from sd2app.session.maps import Reading
from sd2app.session.session import Session
from sd2app.widgets.canvas import AT_RIGHT, Overlay, faint, image_of, signed_table
from sd2app.widgets.time_axis import HANDLE_PX, MARGIN_PX

_BAR_PX = 72


class DifferenceView(HeatmapView):
    """Heatmap of the difference, on the clock of the denoised map.

    A colour names the track that shows more there: it is that of its curve.
    """

    def __init__(
        self, difference: DifferenceModel, session: Session, overlays: Sequence[Overlay] = ()
    ) -> None:
        super().__init__(difference.denoised, session, overlays)
        self._difference = difference
        difference.changed.connect(self.redraw)

    def title(self) -> str:
        """Title: the two maps that are compared."""
        return f"Denoised − {self._difference.against}"

    def make_image(self, start_s: float, end_s: float, columns: int) -> QImage:
        """Image in signed colours, clear where one of the two has no frame."""
        background = QColor(self._display.palette.well).rgb()
        levels = self._display.levels
        return difference_image(
            self._difference, levels, start_s, end_s, columns, self._table(), background
        )

    def bin_marks(self) -> BinMarks:
        """Bins in which one of the two has no information, over the colour of no difference."""
        hatch = faint(self._display.palette.hatch, 150)  # legible on that colour in either theme
        marked = ((self._difference.blank_bins, Qt.BrushStyle.BDiagPattern),)
        return QColor.fromRgb(int(self._table()[127])), hatch, marked

    def read(self, time_s: float, velocity_mps: float) -> Reading | None:
        """Text of both levels and their difference."""
        return self._difference.read(time_s, velocity_mps)

    def _table(self) -> np.ndarray:
        colours = self._display.palette
        return signed_table(colours.real, colours.level, colours.denoised)

    def colour_scale(self) -> tuple[NDArray[np.uint32], float, float, str]:
        """Signed colours, from those where the other is stronger."""
        full, unit = self._difference.full_scale(self._display.levels)
        return self._table(), -full, full, unit

    def status(self) -> str:
        """Words for what was done to the maps before they are compared."""
        return "both as strong altogether, relative to the radar's 0 dB"

    def _paint_corner(self, painter: QPainter, box: QRectF, left: float) -> float:
        """Paint the colour bar; returns its width."""
        full, unit = self._difference.full_scale(self._display.levels)
        metrics, against = painter.fontMetrics(), self._difference.against
        for ends in (
            (f"{against} stronger  −{full:g}", f"+{full:g} {unit}  denoised"),
            (f"{against}  −{full:g}", f"+{full:g} {unit}  denoised"),
            (f"−{full:g}", f"+{full:g} {unit}"),
        ):
            widths = [metrics.horizontalAdvance(text) + 8 for text in ends]
            width = sum(widths) + _BAR_PX
            if self.width() - 16 - left - width > 60:
                break
        else:
            return 0.0
        bar = image_of(self._table()[None])
        place = QRectF(box.right() - widths[1] - _BAR_PX, box.center().y() - 5, _BAR_PX, 10)
        painter.drawImage(place, bar)
        painter.drawText(box, AT_RIGHT, ends[1])
        before = QRectF(place.left() - widths[0], box.top(), widths[0] - 8, box.height())
        painter.drawText(before, AT_RIGHT, ends[0])
        return width


_BORDER_PX = BELOW_PX + 2  # two pixels of the map, to be hit
_MOVED_PX = 4
_NOTCH = 120.0
"""Angle of one notch of the wheel in Qt's units."""


class MapStack(QScrollArea):
    """One view per map; views without content are hidden, and the rest scrolls if it must."""

    arranged = Signal()
    """Views have moved, or others are to be seen."""

    def __init__(
        self,
        session: Session,
        difference: DifferenceModel,
        over_maps: Sequence[Overlay],
        over_all: Sequence[Overlay],
    ) -> None:
        super().__init__()
        self._session, self._difference, maps = session, difference, session.maps
        self._content = QWidget()
        self._named = {
            name: HeatmapView(track, session, over_maps, alignable=track is maps.real)
            for name, track in vars(maps).items()
        }
        self.synthetic, self.denoised, self.before, self.real = self._named.values()
        self._named["difference"] = self.difference = DifferenceView(difference, session, over_maps)
        self.arrangement = Arrangement(tuple(self._named), session.settings, self)
        self.overview = Overview(session, over_all)
        self._offer: QWidget | None = None
        self._under_way: Callable[[], str] = str
        self._shown: object = None
        self._with_content: frozenset[str] = frozenset()
        self.setWidget(self._content)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        # A bar beside the maps would shift their time axis against that of the labels below.
        self.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self._bar = QScrollBar(Qt.Orientation.Vertical, self)
        self._bar.valueChanged.connect(self.verticalScrollBar().setValue)
        self.verticalScrollBar().valueChanged.connect(self._bar.setValue)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setMinimumHeight(MIN_PX)
        for name, view in self._named.items():
            view.setParent(self._content)
            view.menu_parts = (partial(self._fill_menu, name),)
            _Hands(self, name, view)
        self.arrangement.changed.connect(self._arrange)
        self.verticalScrollBar().valueChanged.connect(lambda _: self.arranged.emit())
        for track in maps.all:
            track.changed.connect(self.refresh)
        difference.changed.connect(self.refresh)
        self.refresh()

    @property
    def views(self) -> tuple[HeatmapView, ...]:
        """All views from top to bottom, hidden ones included."""
        return tuple(self._named[name] for name in self.arrangement.order)

    @property
    def shown(self) -> tuple[str, ...]:
        """Names of the maps on screen from top to bottom."""
        if self.arrangement.enlarged in self._with_content:
            return (self.arrangement.enlarged,)
        return tuple(name for name in self.arrangement.order if name in self._with_content)

    @property
    def leading(self) -> HeatmapView | None:
        """First open map that begins in view, or shows a half: *This frame* shares its axis."""
        top = self.verticalScrollBar().value()
        views = [self._named[name] for name in self.shown]
        opened = [view for view in views if not view.folded and view.track.map is not None]
        whole = [view for view in opened if view.y() >= top]
        seen = [view for view in opened if view.y() + view.height() // 2 > top]
        return next(iter(whole or seen or opened), None)

    def view(self, name: str) -> HeatmapView:
        """View of a map by its name."""
        return self._named[name]

    def set_denoiser_buttons(self, offer: QWidget, chosen: QWidget) -> None:
        """Put the choice of the denoiser beside the map it makes, or the one it could use."""
        self._offer = offer
        self.synthetic.set_button(offer)
        self.denoised.set_button(chosen)
        self._shown = None
        self.refresh()

    def refresh(self) -> None:
        """Show the views that have content."""
        document, maps = self._session.document, self._session.maps
        has_any = maps.synthetic.map is not None or maps.real.map is not None
        with_content = {
            "synthetic": maps.synthetic.map is not None or maps.synthetic.awaited or not has_any,
            "denoised": maps.denoised.map is not None or maps.denoised.awaited,
            "before": maps.before.map is not None,
            "real": maps.real.map is not None,
            "difference": self._difference.shown,
        }
        state = *with_content.values(), maps.synthetic.map is None, document.content is None
        if state == self._shown:
            return  # maps change many times a second
        self._shown = state
        before = self._with_content
        self._with_content = frozenset(name for name, has in with_content.items() if has)
        if self._offer is not None:
            denoised = with_content["denoised"]
            self._offer.setVisible(maps.synthetic.map is not None and not denoised)
        self.overview.set_track(maps.synthetic if maps.synthetic.map is not None else maps.real)
        self._show_hint()
        self._arrange()
        if before and (added := self._with_content - before):
            self.ensureWidgetVisible(self.view(min(added, key=self.arrangement.order.index)), 0, 0)

    def set_under_way(self, under_way: Callable[[], str], *changed: SignalInstance) -> None:
        """Take the words for a mesh that is on its way; they are asked for after these signals."""
        self._under_way = under_way
        for signal in changed:
            signal.connect(self._show_hint)

    def _show_hint(self) -> None:
        self.synthetic.set_hint(
            self._under_way()
            or "Add a mesh to see its synthetic Doppler: File → Add to this recording…\n\n"
            "From a video alone: File → New from video… fits a body to the person in it."
        )

    def toggle_enlarged(self, name: str) -> None:
        """Show a map alone, or all of them again."""
        arrangement = self.arrangement
        arrangement.enlarge(None if arrangement.enlarged == name else name)
        self.view(name).setFocus(Qt.FocusReason.OtherFocusReason)

    def scroll(self, angle: int) -> bool:
        """Scroll by a turn of the wheel, in Qt's units; False where all maps are in view."""
        bar = self.verticalScrollBar()
        bar.setValue(bar.value() - round(angle / _NOTCH * MIN_PX / 2))
        return bar.maximum() > 0

    def under(self, name: str, y_px: float) -> tuple[str, bool] | None:
        """Map at a height of the stack, and if it is its lower half; None over the same map."""
        for other in self.shown:
            view = self.view(other)
            if view.y() <= y_px < view.y() + view.height():
                lower = y_px >= view.y() + view.height() / 2
                return None if other == name else (other, lower)
        return None

    def _arrange(self) -> None:
        arrangement, shown = self.arrangement, self.shown
        alone = shown == (arrangement.enlarged,)
        rows = [arrangement.row(name) for name in shown]
        if alone:
            rows = [row._replace(wanted_px=None, folded=False) for row in rows]
        if shown == ("synthetic",) and self._session.maps.synthetic.map is None:
            rows = [rows[0]._replace(folded=False)]  # the hint is to be read
        heights = heights_px(rows, self.viewport().height())
        self._content.resize(self.viewport().width(), max(sum(heights), 1))
        top = 0
        for name, row, height in zip(shown, rows, heights, strict=True):
            view = self.view(name)
            view.set_state(folded=row.folded, enlarged=alone)
            view.setGeometry(0, top, self._content.width(), height)
            top += height
        for name, view in self._named.items():
            view.setVisible(name in shown)
        inner = self.verticalScrollBar()
        self._bar.setRange(inner.minimum(), inner.maximum())
        self._bar.setPageStep(inner.pageStep())
        self._bar.setSingleStep(MIN_PX)
        self._bar.setGeometry(self.width() - MARGIN_PX, 0, MARGIN_PX, self.height())
        self._bar.setVisible(inner.maximum() > 0)
        self.arranged.emit()

    def _fill_menu(self, name: str, menu: QMenu, place: QPointF) -> None:
        """Offer what can be made of a map's room."""
        arrangement, shown = self.arrangement, self.shown
        alone = arrangement.enlarged == name
        menu.addAction(
            "Show a&ll maps" if alone else "En&large", lambda: self.toggle_enlarged(name)
        )
        if alone:
            return
        folded = arrangement.row(name).folded
        menu.addAction("&Unfold" if folded else "&Fold", lambda: arrangement.fold(name, not folded))
        row = shown.index(name)
        for text, other, below in (("Move u&p", row - 1, False), ("Move &down", row + 1, True)):
            action = menu.addAction(text)
            action.setEnabled(0 <= other < len(shown))
            action.triggered.connect(
                lambda _, other=other, below=below: arrangement.move(name, shown[other], below)
            )
        shared = menu.addAction("Usual &height", lambda: arrangement.set_height(name, None))
        shared.setEnabled(arrangement.row(name).wanted_px is not None)

    # --- events ---------------------------------------------------------------------------

    def event(self, event: QEvent) -> bool:
        """Claim Escape while a map is enlarged."""
        if event.type() == QEvent.Type.ShortcutOverride and self.ends_enlarging(event):
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Leave all keys to the window: arrows belong to the playback."""
        event.ignore()

    def ends_enlarging(self, event: QEvent) -> bool:
        """True for the key that shows all maps again, while one stands for all."""
        escape = isinstance(event, QKeyEvent) and event.key() == Qt.Key.Key_Escape
        return escape and self.arrangement.enlarged is not None

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Share out the new room."""
        super().resizeEvent(event)
        self._arrange()


class _Hands(QObject):
    """Mouse on the title row and the lower border of one map."""

    def __init__(self, stack: MapStack, name: str, view: HeatmapView) -> None:
        super().__init__(view)
        self._stack, self._name, self._view = stack, name, view
        self._held = ""  # "height" or "place"
        self._from_px = 0.0
        self._moved = False
        view.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Fold, enlarge, move, change the height, or scroll."""
        if isinstance(event, QWheelEvent):
            return event.position().y() < HEADER_PX and self._stack.scroll(event.angleDelta().y())
        if not isinstance(event, QMouseEvent):
            return False
        place, kind = event.position(), event.type()
        if kind == QEvent.Type.MouseMove:
            return self._move(place, event)
        if event.button() != Qt.MouseButton.LeftButton:
            return False
        if kind == QEvent.Type.MouseButtonPress:
            return self._press(place)
        if kind == QEvent.Type.MouseButtonRelease:
            return self._release(place)
        if kind == QEvent.Type.MouseButtonDblClick:
            return self._double_click(place)
        return False

    def _part_at(self, place: QPointF) -> str:
        view = self._view
        if place.y() < HEADER_PX:
            return "place"
        at_border = place.y() >= view.height() - _BORDER_PX
        return "height" if at_border and not view.folded and not view.enlarged else ""

    def _press(self, place: QPointF) -> bool:
        self._held, self._moved = self._part_at(place), False
        self._from_px = place.y()
        return bool(self._held)

    def _move(self, place: QPointF, event: QMouseEvent) -> bool:
        if not event.buttons():
            self._held = ""  # a menu or a dialog may have taken the release
        part = self._held or ("" if event.buttons() else self._part_at(place))
        if part == "height":
            self._view.setCursor(Qt.CursorShape.SizeVerCursor)
        elif part == "place":
            self._view.setCursor(Qt.CursorShape.PointingHandCursor)
        if not self._held:
            return bool(part)
        self._moved = self._moved or abs(place.y() - self._from_px) >= _MOVED_PX
        if self._moved and self._held == "height":
            self._stack.arrangement.set_height(self._name, round(place.y()) + BELOW_PX // 2)
        elif self._moved and not self._view.enlarged:
            self._view.setCursor(Qt.CursorShape.ClosedHandCursor)
            target = self._stack.under(self._name, self._view.y() + place.y())
            if target is not None:
                self._swap(*target)
        return True

    def _swap(self, other: str, lower: bool) -> None:
        """Change places as soon as the pointer is beyond the middle of the other map."""
        order = self._stack.shown
        downwards = order.index(other) > order.index(self._name)
        if downwards == lower:
            self._stack.arrangement.move(self._name, other, below=downwards)

    def _release(self, place: QPointF) -> bool:
        held, self._held = self._held, ""
        if held == "place" and not self._moved and place.x() < HANDLE_PX:
            if self._view.enlarged:
                self._stack.toggle_enlarged(self._name)
            else:
                self._stack.arrangement.fold(self._name, not self._view.folded)
        return bool(held)

    def _double_click(self, place: QPointF) -> bool:
        if place.y() < HEADER_PX and place.x() >= HANDLE_PX:
            self._stack.toggle_enlarged(self._name)
            return True
        if self._part_at(place) == "height":
            self._stack.arrangement.set_height(self._name, None)
            return True
        return False
