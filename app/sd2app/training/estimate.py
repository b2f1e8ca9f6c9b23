"""Estimated time of a training, and its source."""

from __future__ import annotations

from PySide6.QtWidgets import QLabel, QVBoxLayout, QWidget

from sd2app.background.step_times import StepKey, StepTime, StepTimes
from sd2app.training.text import estimate_source_text, estimate_text
from sd2app.widgets.panel import sentence


class EstimateLines(QWidget):
    """The time in large letters, the steps that it is made of below."""

    def __init__(self, times: StepTimes, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._times = times
        self._time = QLabel(self)
        self._time.setObjectName("title")
        self._time.setWordWrap(True)
        self._time.setAccessibleName("How long it will take")
        self._source = sentence("")
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(6)
        layout.addWidget(self._time)
        layout.addWidget(self._source)

    def show_estimate(
        self, seconds: float | None, count: str, step: StepTime | None, key: StepKey
    ) -> None:
        """Show another one; ``count`` is of what there are how many steps."""
        self._time.setText(estimate_text(seconds))
        self._source.setText(estimate_source_text(count, step, key, self._times))
