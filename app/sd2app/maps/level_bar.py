"""One control of level and colour map for all heatmaps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import QAction, QColor, QMouseEvent, QPainter, QResizeEvent
from PySide6.QtWidgets import QWidget

from sd2app.session.display import COLOUR_MAPS
from sd2app.session.session import Session
from sd2app.widgets.canvas import Canvas, image_of, lookup_table, uncertain_table
from sd2app.widgets.inputs import Choice, NumberBox, action_button
from sd2app.widgets.layouts import ANY_WIDTH_PX, STRETCH, column_of, row_of
from sd2app.widgets.panel import outlined

_STRIP_PX = 14
_SCALE_PX = 32


class _ColourStrip(Canvas):
    """The colours of the levels; below them those of uncertain cells, where there are any."""

    USUAL_PX = 200, _STRIP_PX

    def __init__(self, session: Session, parent: QWidget) -> None:
        super().__init__(parent)
        self._display, self._tracks = session.display, session.maps.all
        self.setFixedHeight(_STRIP_PX)
        self.follow(self._display.levels_changed, *(track.changed for track in self._tracks))

    def paint(self, painter: QPainter) -> None:
        name = self._display.levels.colour_map
        strips = [lookup_table(name)]
        if any(track.uncertainty is not None for track in self._tracks):
            strips.append(uncertain_table(name))
        painter.drawImage(QRectF(self.rect()), image_of(np.stack(strips)))
        painter.setPen(QColor(self._display.palette.border))
        painter.drawRect(self.rect().adjusted(0, 0, -1, -1))


class ColourScale(Canvas):
    """The colours of the levels from below, with the level at either end; a click unfolds it."""

    clicked = Signal()

    def __init__(self, session: Session) -> None:
        super().__init__()
        self._display = session.display
        self.setFixedWidth(_SCALE_PX)
        self.setAccessibleName("Levels")
        self.setToolTip("Level of the colours in dB; click for this frame and for the levels")
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.follow(self._display.levels_changed, self._display.theme_changed)

    def paint(self, painter: QPainter) -> None:
        """A strip of colours between its two ends."""
        levels, palette = self._display.levels, self._display.palette
        painter.fillRect(self.rect(), QColor(palette.panel))
        line_px = painter.fontMetrics().height()
        strip = self.rect().adjusted(10, line_px + 4, -10, -line_px - 4)
        table = lookup_table(levels.colour_map)
        painter.drawImage(QRectF(strip), image_of(np.ascontiguousarray(table[::-1, None])))
        painter.setPen(QColor(palette.border))
        painter.drawRect(strip)
        painter.setPen(QColor(palette.muted))
        for y, level in ((0, levels.high_db), (self.height() - line_px - 2, levels.low_db)):
            text = f"{level:g}".replace("-", "−")
            painter.drawText(
                QRectF(0, y, self.width(), line_px + 2), Qt.AlignmentFlag.AlignCenter, text
            )

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Unfold it."""
        if event.button() == Qt.MouseButton.LeftButton:
            self.clicked.emit()


class MapEdge(QWidget):
    """Right edge of the maps: a colour scale, or unfolded *This frame* over the levels.

    ``show_frame`` is called with whether it is to be unfolded.
    """

    def __init__(
        self, session: Session, frame: QWidget, show_frame: Callable[[bool], object]
    ) -> None:
        super().__init__()
        self._scale, self._frame = ColourScale(session), frame
        self._scale.clicked.connect(lambda: show_frame(True))
        tip = "Fold this frame to the scale of colours"
        fold = outlined("»", tip, lambda: show_frame(False), self._frame, name=tip, look="")
        self.setLayout(row_of(self._scale, (frame, 1), spacing_px=0, margins_px=0))
        self._fold = fold

    def set_folded(self, folded: bool) -> None:
        """Show the scale of colours alone, or this frame and the levels."""
        self._scale.setVisible(folded)
        self._frame.setVisible(not folded)
        edge = self.parentWidget()
        assert edge is not None
        edge.setMaximumWidth(_SCALE_PX + 2 if folded else ANY_WIDTH_PX)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the button in the corner."""
        super().resizeEvent(event)
        size = self._fold.sizeHint()
        self._fold.setGeometry(self.width() - size.width() - 4, 0, size.width(), 24)


class LevelBar(QWidget):
    """Colour strip with its two ends, scale, colour map, and what 0 dB means."""

    def __init__(self, session: Session, uncertain: QAction) -> None:
        super().__init__()
        self._display, self._tracks = session.display, session.maps.all
        set_levels = session.display.set_levels
        self._low, self._high = (
            NumberBox(-90.0, 20.0, " dB", tip, decimals=0, step=3.0)
            for tip in ("Level shown as the first colour", "Level shown as the last colour")
        )
        self._low.valueChanged.connect(lambda value: set_levels(low_db=value))
        self._high.valueChanged.connect(lambda value: set_levels(high_db=value))
        self._scale = Choice(
            "Logarithmic or linear levels, for all heatmaps",
            self,
            {name: name for name in ("dB", "linear")},
            lambda scale: set_levels(scale=scale),
        )
        self._colours = Choice(
            "Colour map of all heatmaps",
            self,
            {name: name for name in COLOUR_MAPS},
            lambda name: set_levels(colour_map=name),
        )
        ends = row_of(
            self._low, STRETCH, action_button(uncertain, "Uncertain"), STRETCH, self._high
        )
        choices = row_of((self._scale, 1), (self._colours, 1))
        self._strip = _ColourStrip(session, self)
        controls = column_of(self._strip, ends, choices, spacing_px=4)
        self.setLayout(column_of(controls, spacing_px=0, margins_px=(8, 0, 8, 4)))
        for signal in (self._display.levels_changed, *(track.changed for track in self._tracks)):
            signal.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        levels = self._display.levels
        self._low.show_value(levels.low_db)
        self._high.show_value(levels.high_db)
        self._low.setEnabled(levels.scale == "dB")
        self._scale.show_value(levels.scale)
        self._colours.show_value(levels.colour_map)
        # A tip, because the plot above stands beside its map and needs the height.
        self._strip.setToolTip(
            "\n".join(
                f"0 dB {track.title.lower()}: {track.reference:.3g} {track.map.unit}".rstrip()
                for track in self._tracks
                if track.map is not None
            )
        )
