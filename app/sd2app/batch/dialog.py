"""Window of batches: a new one that is set up, or the one in view."""

from __future__ import annotations

from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QWidget

from sd2app.background.latest import delayed
from sd2app.batch.model import BatchModel
from sd2app.batch.questions import BatchQuestions
from sd2app.batch.run_view import BatchRunView
from sd2app.batch.setup_view import BatchSetupView
from sd2app.manual.help import help_button
from sd2app.widgets.dialogs import Dialog, take_room
from sd2app.widgets.layouts import column_of
from sd2app.widgets.panel import sentence, show_words
from sd2app.widgets.run_panel import RunPanel

_ESTIMATE_MS = 600


class BatchWindow(Dialog):
    """A new batch, or the one in view; the rest of the program can be used meanwhile."""

    def __init__(self, batch: BatchModel, asks: BatchQuestions, parent: QWidget) -> None:
        super().__init__("Batch", parent)
        self._batch = batch
        self._setup, self._run = BatchSetupView(batch, asks, self), BatchRunView(batch, asks)
        self._warning = sentence("", "warning")
        self._warning.hide()
        tip = "The batch in view; one that lies elsewhere can be opened"
        runs = RunPanel(
            batch,
            self._setup,
            self._run,
            tip,
            ("Open batch…", asks.open_batch),
            new="New batch",
            guide=help_button("Batch", self),
        )
        column = column_of(self._warning, (runs, 1), spacing_px=4, margins_px=(8, 8, 8, 10))
        self.setLayout(column)
        # Not while the user still changes a number.
        self._patience = delayed(self._estimate, _ESTIMATE_MS, self)
        batch.changed.connect(self._patience.start)
        take_room(self, 620, 640)

    def warn(self, text: str) -> None:
        """Say what went wrong, or nothing any more."""
        show_words(self._warning, text)

    def showEvent(self, event: QShowEvent) -> None:
        """Follow what the open recording offers, and estimate the set-up."""
        super().showEvent(event)
        self._setup.refresh()
        self._patience.start()

    def _estimate(self) -> None:
        if self.isVisible() and self._batch.run is None:
            self._batch.ask_estimate()
