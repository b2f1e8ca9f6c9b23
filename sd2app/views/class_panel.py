"""Training of classifiers: something new to be set up, or a run under way or ended."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QSignalBlocker
from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import QHBoxLayout, QSizePolicy, QVBoxLayout, QWidget

from sd2app.models.class_training import ClassTraining
from sd2app.models.display import DisplayModel
from sd2app.views.class_asks import ClassAsks
from sd2app.views.class_run_view import ClassRunView
from sd2app.views.class_setup_view import ClassSetupView
from sd2app.views.inputs import Choice
from sd2app.views.panel_parts import outlined

_NEW = "New training"
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
        self._paths: list[Path | None] = []
        self._runs = Choice(_TIP, self)
        self._runs.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self._runs.activated.connect(lambda at: training.select(self._paths[at]))
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
        here = run.folder.path if run is not None else None
        paths: list[Path | None] = [None, *(known.path for known in self._training.runs)]
        texts = [_NEW, *(known.title for known in self._training.runs)]
        if here is not None and here not in paths:
            # Just begun: it is not in the list yet.
            paths.insert(1, here)
            texts.insert(1, here.name)
        with QSignalBlocker(self._runs):
            if texts != [self._runs.itemText(at) for at in range(self._runs.count())]:
                self._runs.clear()
                self._runs.addItems(texts)
            self._runs.setCurrentIndex(paths.index(here))
        self._runs.setToolTip(str(here) if here is not None else _TIP)
        self._paths = paths
