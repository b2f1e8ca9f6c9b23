"""Estimated time of a training, and its source."""

from __future__ import annotations

from PySide6.QtWidgets import QLabel, QVBoxLayout, QWidget

from sd2app.background.step_times import StepKey, StepTime, StepTimes
from sd2app.widgets.panel import sentence
from sd2app.widgets.text import about


class EstimateLines(QWidget):
    """Estimated time in large letters, with its steps below."""

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
        """Show an estimate; ``count`` names the data and the number of steps."""
        self._time.setText(estimate_text(seconds))
        self._source.setText(estimate_source_text(count, step, key, self._times))


def estimate_text(seconds: float | None) -> str:
    """Estimated time."""
    return "Time: not known yet" if seconds is None else f"Takes {about(seconds)}"


def estimate_source_text(count: str, step: StepTime | None, key: StepKey, times: StepTimes) -> str:
    """Source of the estimate; ``count`` names the data and ends with the number of steps."""
    if step is not None:
        known = "as in the last run here" if step.source == "run" else "timed here"
        return f"{count} of about {step_text(step.seconds)}, {known}."
    if times.timing == key:
        return f"{count}. Timing a few of them…"
    why_not = times.why_not(key)
    return f"{count}. They could not be timed: {why_not}" if why_not else f"{count}."


def step_text(seconds: float) -> str:
    """Time of a step."""
    if seconds >= 0.95:
        return f"{seconds:.1f} s"
    return f"{float(f'{1000 * seconds:.2g}'):g} ms"
