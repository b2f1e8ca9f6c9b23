"""Estimated time of a training before it starts."""

from __future__ import annotations

from PySide6.QtWidgets import QLabel, QVBoxLayout, QWidget

from sd2app.widgets.panel import sentence
from sd2app.widgets.text import about


class EstimateLines(QWidget):
    """Estimated time in large letters, with its steps below."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._time = QLabel(self)
        self._time.setObjectName("title")
        self._time.setWordWrap(True)
        self._time.setAccessibleName("How long it will take")
        self._basis = sentence("")
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(6)
        layout.addWidget(self._time)
        layout.addWidget(self._basis)

    def show_estimate(self, count: str, steps: int, step_s: float | None) -> None:
        """Show the time of so many steps; ``count`` names the data and ends with the steps."""
        if step_s is None:
            self._time.setText("Time: not known yet")
            self._basis.setText(f"{count}. The first ones tell how long it takes.")
        else:
            self._time.setText(f"Takes {about(steps * step_s)}")
            self._basis.setText(f"{count} of about {step_text(step_s)}, as measured here before.")


def step_text(seconds: float) -> str:
    """Time of a step."""
    if seconds >= 0.95:
        return f"{seconds:.1f} s"
    return f"{float(f'{1000 * seconds:.2g}'):g} ms"
