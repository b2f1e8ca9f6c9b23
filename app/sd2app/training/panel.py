"""The Train panel: a new run to be set up, or one that is under way or has ended."""

from __future__ import annotations

from typing import Protocol

from PySide6.QtCore import QSignalBlocker
from PySide6.QtWidgets import QCheckBox, QHBoxLayout, QVBoxLayout, QWidget

from sd2app.session.display import DisplayModel
from sd2app.training.model import TrainingModel
from sd2app.training.result import ModelAdoption
from sd2app.training.run_view import TrainingRunView
from sd2app.training.setup_view import TrainingSetupView
from sd2app.training.text import gain_rows, gain_summary
from sd2app.widgets.panel import FactRows, outlined, sentence, title
from sd2app.widgets.run_list import RunPanel


class Asks(Protocol):
    """Actions of the panel that need dialogs."""

    def ask_store(self) -> None:
        """Let the user choose a store of pairs."""

    def ask_recordings(self) -> None:
        """Let the user choose recordings to make pairs of."""

    def start(self) -> None:
        """Start what is set up."""

    def copy_command(self) -> None:
        """Put the command on the clipboard."""

    def use(self) -> None:
        """Use the model of the run in view."""

    def open_run(self) -> None:
        """Let the user choose a run in another folder."""

    def resume(self) -> None:
        """Resume the run in view."""

    def delete(self) -> None:
        """Ask, then delete the run in view."""


class TrainingGainView(QWidget):
    """A view of :class:`ModelAdoption`."""

    def __init__(self, use: ModelAdoption, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._use = use
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(4)
        layout.addWidget(title("In use"))
        self._summary = sentence("")
        layout.addWidget(self._summary)
        self._table = FactRows(3, at_the_edge=True, parent=self)
        layout.addWidget(self._table)
        self._both = QCheckBox("Show the map from before", self)
        self._both.setToolTip("Draw the map of the model before under that of this one")
        self._both.toggled.connect(use.set_comparing)
        self._back = outlined("Go back", "Denoise with what was in use before", use.go_back, self)
        row = QHBoxLayout()
        row.addWidget(self._both)
        row.addStretch(1)
        row.addWidget(self._back)
        layout.addLayout(row)
        use.changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        use = self._use
        self._summary.setText(gain_summary(use.gain, use.has_radar))
        self._table.show_facts(gain_rows(use.gain) if use.gain is not None else [])
        with QSignalBlocker(self._both):
            self._both.setChecked(use.comparing)
        self._both.setVisible(use.can_compare)


class TrainingPanel(RunPanel):
    """Panel of the trainings of denoisers, with the gain of the model in use."""

    def __init__(
        self,
        training: TrainingModel,
        use: ModelAdoption,
        display: DisplayModel,
        asks: Asks,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(
            training,
            "Runs: those under way, and those that have ended",
            asks.open_run,
            parent,
        )
        self._training, self._use = training, use
        self._gain = TrainingGainView(use, self)
        self._run_view = TrainingRunView(
            training, display, asks.use, asks.resume, asks.delete, self._gain, self
        )
        setup = TrainingSetupView(
            training, asks.ask_store, asks.ask_recordings, asks.start, asks.copy_command, self
        )
        self.fill(setup, self._run_view)
        use.changed.connect(self.refresh)

    def refresh(self) -> None:
        """Follow the models."""
        super().refresh()
        run = self._training.run
        in_use = run is not None and self._use.run == run.folder.path
        self._gain.setVisible(in_use)
        self._run_view.set_in_use(in_use)
