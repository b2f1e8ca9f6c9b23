"""The Train panel: a new run to be set up, or one that is under way or has ended."""

from __future__ import annotations

from typing import Protocol

from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from sd2app.models.display import DisplayModel
from sd2app.models.training import TrainingModel
from sd2app.models.training_use import TrainingUse
from sd2app.views.panel_parts import outlined
from sd2app.views.run_choice import RunChoice
from sd2app.views.training_gain_view import TrainingGainView
from sd2app.views.training_run_view import TrainingRunView
from sd2app.views.training_setup_view import TrainingSetupView

_TIP = "Runs: those under way, and those that have ended"


class Asks(Protocol):
    """What the panel leaves to dialogs."""

    def ask_store(self) -> None:
        """Let the user choose a store of pairs."""

    def ask_recordings(self) -> None:
        """Let the user choose recordings to make pairs of."""

    def start(self) -> None:
        """Begin as it is set up."""

    def copy_command(self) -> None:
        """Put the command on the clipboard."""

    def use(self) -> None:
        """Use the model of the run in view."""

    def open_run(self) -> None:
        """Let the user choose a run that lies elsewhere."""

    def resume(self) -> None:
        """Go on with the run in view."""

    def delete(self) -> None:
        """Ask, then delete the run in view."""


class TrainingPanel(QWidget):
    """The list of runs on top, the one in view below."""

    def __init__(
        self,
        training: TrainingModel,
        use: TrainingUse,
        display: DisplayModel,
        asks: Asks,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setObjectName("page")
        self._training = training
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 6, 8, 6)
        layout.setSpacing(8)
        self._runs = RunChoice(_TIP, training.select, asks.open_run, self)
        self._new = outlined("New", "Set up another training", lambda: training.select(None), self)
        row = QHBoxLayout()
        row.setSpacing(6)
        row.addWidget(self._runs, 1)
        row.addWidget(self._new)
        layout.addLayout(row)
        self._setup = TrainingSetupView(
            training, asks.ask_store, asks.ask_recordings, asks.start, asks.copy_command, self
        )
        self._gain = TrainingGainView(use, self)
        self._run = TrainingRunView(
            training, display, asks.use, asks.resume, asks.delete, self._gain, self
        )
        layout.addWidget(self._setup)
        layout.addWidget(self._run)
        layout.addStretch(1)
        training.changed.connect(self._refresh)
        use.changed.connect(self._refresh)
        self._use = use
        self._refresh()

    def showEvent(self, event: QShowEvent) -> None:
        """Look again at what lies on disk, and time a step where that is not known."""
        super().showEvent(event)
        self._training.set_watched(True)

    def hideEvent(self, event: QHideEvent) -> None:
        """Nobody looks."""
        super().hideEvent(event)
        self._training.set_watched(False)

    def _refresh(self) -> None:
        run = self._training.run
        self._setup.setVisible(run is None)
        self._run.setVisible(run is not None)
        self._new.setVisible(run is not None)
        in_use = run is not None and self._use.run == run.folder.path
        self._gain.setVisible(in_use)
        self._run.set_in_use(in_use)
        self._runs.show_runs(
            [(known.path, known.title) for known in self._training.library.runs],
            run.folder.path if run is not None else None,
        )
