"""A slider over the frames of a video, with the time of the one that is shown."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QSignalBlocker, Qt
from PySide6.QtWidgets import QLabel, QSlider, QWidget

from sd2app.widgets.layouts import row_of
from sd2app.widgets.time_axis import clock_text


class FrameSlider(QWidget):
    """Follows a model; ``chosen`` is called with another frame, by mouse or arrow keys."""

    def __init__(self, chosen: Callable[[int], object], parent: QWidget) -> None:
        super().__init__(parent)
        self.slider = QSlider(Qt.Orientation.Horizontal, self)
        self.slider.setAccessibleName("Frame")
        self.slider.valueChanged.connect(chosen)
        self._where = QLabel(self)
        self._where.setObjectName("muted")
        width_px = self._where.fontMetrics().horizontalAdvance("00:00.000 · frame 00000")
        self._where.setMinimumWidth(width_px)
        self.setLayout(row_of((self.slider, 1), self._where, margins_px=0))

    def show_frame(self, frame: int, frames: int, time_s: float) -> None:
        """Show which of so many frames is on screen."""
        with QSignalBlocker(self.slider):
            self.slider.setRange(0, max(frames - 1, 0))
            self.slider.setValue(frame)
        self.slider.setEnabled(frames > 1)
        self._where.setText(f"{clock_text(time_s)} · frame {frame}" if frames else "")
