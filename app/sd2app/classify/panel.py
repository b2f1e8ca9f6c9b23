"""Training of classifiers: something new to be set up, or a run under way or ended."""

from __future__ import annotations

from PySide6.QtWidgets import QWidget

from sd2app.classify.questions import ClassAsks
from sd2app.classify.run_view import ClassRunView
from sd2app.classify.setup_view import ClassSetupView
from sd2app.classify.training import ClassTraining
from sd2app.session.display import DisplayModel
from sd2app.widgets.run_list import RunPanel


class ClassPanel(RunPanel):
    """Panel of trainings and comparisons of classifiers."""

    def __init__(
        self,
        training: ClassTraining,
        display: DisplayModel,
        asks: ClassAsks,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(
            training,
            "Trainings and comparisons: under way, or ended",
            parent=parent,
        )
        self.fill(ClassSetupView(training, asks, self), ClassRunView(training, display, asks, self))
