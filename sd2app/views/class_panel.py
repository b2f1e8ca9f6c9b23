"""Training of classifiers: something new to be set up, or a run under way or ended."""

from __future__ import annotations

from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from sd2app.models.class_training import ClassTraining
from sd2app.models.display import DisplayModel
from sd2app.views.class_asks import ClassAsks
from sd2app.views.class_run_view import ClassRunView
from sd2app.views.class_setup_view import ClassSetupView
from sd2app.views.panel_parts import outlined
from sd2app.views.run_choice import RunChoice

_TIP = "Trainings and comparisons: under way, or ended"


class ClassPanel(QWidget):
    """The list of runs on top, the one in view below."""

    def __init__(
        self,
        training: ClassTraining,
        display: DisplayModel,
        asks: ClassAsks,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setObjectName("page")
        self._training = training
        self._runs = RunChoice(_TIP, training.select, parent=self)
        self._new = outlined("New", "Set up another training", lambda: training.select(None), self)
        row = QHBoxLayout()
        row.setSpacing(6)
        row.addWidget(self._runs, 1)
        row.addWidget(self._new)
        self._setup = ClassSetupView(training, asks, self)
        self._run = ClassRunView(training, display, asks, self)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 4, 8, 6)
        layout.setSpacing(8)
        layout.addLayout(row)
        layout.addWidget(self._setup)
        layout.addWidget(self._run)
        layout.addStretch(1)
        training.changed.connect(self._refresh)
        self._refresh()

    def showEvent(self, event: QShowEvent) -> None:
        """Look again at what lies on disk."""
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
        self._runs.show_runs(
            [(known.path, known.title) for known in self._training.runs],
            run.folder.path if run is not None else None,
        )
