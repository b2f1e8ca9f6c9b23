"""Window of a batch: a new one that is set up, or the one in view."""

from __future__ import annotations

from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import QDialog, QStackedWidget, QWidget

from sd2app.background.latest import delayed
from sd2app.batch.model import BatchModel
from sd2app.batch.questions import BatchQuestions
from sd2app.batch.run_view import BatchRunView
from sd2app.batch.setup_view import BatchSetupView
from sd2app.manual.help import help_button
from sd2app.widgets.layouts import column_of, row_of
from sd2app.widgets.panel import outlined, sentence, show_words, title

_ESTIMATE_MS = 600


class BatchWindow(QDialog):
    """A new batch, or the one in view; the rest of the program can be used meanwhile."""

    def __init__(self, batch: BatchModel, asks: BatchQuestions, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle("Batch")
        self._batch = batch
        self._title = title("New batch")
        another = outlined("Open batch…", "One that lies elsewhere", asks.open_batch, self)
        self._setup = BatchSetupView(batch, asks, self)
        self._run = BatchRunView(batch, asks, self)
        self._pages = QStackedWidget(self)
        self._pages.addWidget(self._setup)
        self._pages.addWidget(self._run)
        self._warning = sentence("", "warning")
        self._warning.hide()
        head = row_of((self._title, 1), another, help_button("Batch", self))
        parts = (head, self._warning, (self._pages, 1))
        self.setLayout(column_of(*parts, spacing_px=10, margins_px=(16, 12, 16, 16)))
        # Not while the user still changes a number.
        self._patience = delayed(self._estimate, _ESTIMATE_MS, self)
        batch.changed.connect(self._refresh)
        batch.setup.changed.connect(self._patience.start)
        self.resize(620, 640)
        self._refresh()

    def warn(self, text: str) -> None:
        """Say what went wrong, or nothing any more."""
        show_words(self._warning, text)

    def showEvent(self, event: QShowEvent) -> None:
        """Follow the batch and estimate the set-up."""
        super().showEvent(event)
        self._batch.set_watched(True)
        self._setup.refresh()
        self._patience.start()

    def hideEvent(self, event: QHideEvent) -> None:
        """Stop following while hidden."""
        super().hideEvent(event)
        self._batch.set_watched(False)

    def _refresh(self) -> None:
        run = self._batch.run
        self._title.setText("New batch" if run is None else run.folder.path.name)
        page = self._setup if run is None else self._run
        if self._pages.currentWidget() is not page:
            self._pages.setCurrentWidget(page)
            self._patience.start()

    def _estimate(self) -> None:
        if self.isVisible() and self._batch.run is None:
            self._batch.ask_estimate()
