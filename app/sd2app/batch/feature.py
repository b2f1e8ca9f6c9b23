"""Batches over many recordings and placements."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QWidget

from sd2app.batch.model import BatchModel
from sd2app.batch.questions import BatchQuestions
from sd2app.batch.run_view import BatchRunView
from sd2app.batch.setup_view import BatchSetupView
from sd2app.denoise.model import DenoiseModel
from sd2app.feature import Action, Feature, Shell, report
from sd2app.manual.help import help_button
from sd2app.sensor.placements import PlacementsModel
from sd2app.session.session import Session
from sd2app.widgets.dialogs import Dialog, take_room
from sd2app.widgets.layouts import column_of
from sd2app.widgets.panel import sentence, show_words
from sd2app.widgets.run_panel import RunPanel
from sd2core.runs.command_folder import COMMAND


class BatchWindow(Dialog):
    """A new batch, or the one in view; the rest of the program can be used meanwhile."""

    def __init__(self, batch: BatchModel, asks: BatchQuestions, parent: QWidget) -> None:
        super().__init__("Batch", parent)
        self._warning = sentence("", "warning")
        self._warning.hide()
        runs = RunPanel(
            batch,
            BatchSetupView(batch, asks, self),
            BatchRunView(batch, asks),
            "The batch in view; one that lies elsewhere can be opened",
            ("Open batch…", asks.open_batch),
            new="New batch",
            guide=help_button("Batch", self),
        )
        column = column_of(self._warning, (runs, 1), spacing_px=4, margins_px=(8, 8, 8, 10))
        self.setLayout(column)
        take_room(self, 620, 640)

    def warn(self, text: str) -> None:
        """Say what went wrong, or nothing any more."""
        show_words(self._warning, text)


class BatchFeature(Feature):
    """Window in which a batch is set up, followed and its results opened."""

    def __init__(
        self,
        session: Session,
        shell: Shell,
        placements: PlacementsModel,
        denoiser: DenoiseModel,
        command: Sequence[str] | None,
        parent: QObject,
    ) -> None:
        self.model = BatchModel(session.settings, parent, command or COMMAND)
        self.running = (self.model,)
        report(shell, self.model)
        self._shell = shell
        self._questions = BatchQuestions(self.model, session, shell, placements, denoiser)
        self._questions.warned.connect(self._say)
        self._window: BatchWindow | None = None

    def show(self) -> None:
        """Bring up the batch in view, or set up another as the open recording is."""
        if self._window is None:
            self._window = BatchWindow(self.model, self._questions, self._shell.dialog_parent)
        if not self._window.isVisible():
            self._questions.begin_as_open()
        self._window.show()
        self._window.raise_()
        self._window.activateWindow()

    def show_with_placements(self) -> None:
        """Set up a batch with the places that are planned in the open recording."""
        self.show()
        self._questions.place_as_planned()

    def _say(self, text: str) -> None:
        """Show a sentence in the batch window if it is open, else in the main window."""
        if self._window is not None and self._window.isVisible():
            self._window.warn(text)
        elif text:
            self._shell.warn(text)

    def actions(self) -> Sequence[Action]:
        """The window of the batch."""
        return (
            Action(
                "batch", "File", "Batch…", ("Ctrl+B",),
                "Fit, synthesise, denoise and export many recordings from many places, in the"
                " background",
                self.show,
            ),
        )  # fmt: skip

    def close(self) -> None:
        """Close the window of the batch, which goes on."""
        if self._window is not None:
            self._window.close()
        self.model.close()
