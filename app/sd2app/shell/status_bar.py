"""The last line of the window: what the pointer reads, how exact the map is, what is under way."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtWidgets import QToolButton, QWidget

from sd2app.accuracy.model import AccuracyModel
from sd2app.background.latest import delayed
from sd2app.maps.model import SynthesisModel
from sd2app.session.session import Session
from sd2app.widgets.layouts import STRETCH, row_of
from sd2app.widgets.panel import ElidedLabel, ProgressBar, outlined

_QUIET_MS = 300


class StatusLine(QWidget):
    """How far the map may be off, and the oldest job with a cancel button on the right."""

    def __init__(
        self,
        session: Session,
        accuracy: AccuracyModel,
        synthesis: SynthesisModel,
        show_accuracy: Callable[[], object],
        parent: QWidget,
    ) -> None:
        super().__init__(parent)
        self._jobs = session.jobs
        self._accuracy, self._synthesis = accuracy, synthesis
        self._plan = outlined("", "", show_accuracy, self, look="")
        self._title = ElidedLabel(self, "muted")
        self._bar = ProgressBar("", width_px=140)
        self._cancel = QToolButton(self)
        self._cancel.setText("Cancel")
        self._cancel.clicked.connect(self._cancel_job)
        self._job = (self._title, self._bar, self._cancel)
        parts = (STRETCH, self._plan, *self._job)
        self.setLayout(row_of(*parts, spacing_px=16, margins_px=(12, 0, 8, 0)))
        for widget in (self._plan, *self._job):
            widget.hide()
        self.setFixedHeight(28)
        # Work that is over at once should not flicker.
        self._delay = delayed(self._show_job, _QUIET_MS, self)
        for signal in (accuracy.changed, accuracy.plan_changed, synthesis.moving_changed):
            signal.connect(self._show_plan)
        session.jobs.changed.connect(self._follow)

    def _show_plan(self) -> None:
        """While the sensor moves the budget rules, at rest the tolerance does."""
        accuracy, moving = self._accuracy, self._synthesis.moving
        in_use = accuracy.while_dragging if moving else accuracy.in_use
        self._plan.setVisible(in_use is not None)
        if in_use is not None:
            when = "while dragging " if moving else ""
            self._plan.setText(f"{when}{in_use.accuracy} · how?")
            self._plan.setAccessibleName(self._plan.text())
            self._plan.setToolTip(f"How far the map may be off. {in_use}")

    def _follow(self) -> None:
        """Show what goes on in a moment: each step of a bar paints the window at once."""
        if not self._jobs.jobs:
            self._show_job()
        elif not self._delay.isActive():
            self._delay.start()

    def _show_job(self) -> None:
        job = self._jobs.jobs[0] if self._jobs.jobs else None
        for widget in self._job:
            widget.setVisible(job is not None)
        if job is None:
            return
        self._title.setText("Cancelling…" if job.cancelling else job.title)
        self._cancel.setEnabled(not job.cancelling)
        self._bar.show_count(job.done, job.total)

    def _cancel_job(self) -> None:
        if self._jobs.jobs:
            self._jobs.cancel(self._jobs.jobs[0])
            self._show_job()
