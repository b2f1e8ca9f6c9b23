"""The difference of two Doppler maps in signed colours, zero in the middle."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPainter

from sd2app.maps.difference import DifferenceModel
from sd2app.maps.heatmap import BinMarks, HeatmapView
from sd2app.maps.heatmap_image import difference_image
from sd2app.session.maps import Reading
from sd2app.session.session import Session
from sd2app.widgets.canvas import AT_RIGHT, Overlay, faint, image_of, signed_table

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
        difference.changed.connect(self.invalidate)

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
