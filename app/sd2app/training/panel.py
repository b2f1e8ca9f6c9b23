"""Panel of the trainings of denoisers: a new one, or one in view with the use of its model."""

from __future__ import annotations

import math
from collections.abc import Collection
from functools import partial

from PySide6.QtWidgets import QWidget

from sd2app.feature import Shell
from sd2app.session.display import DisplayModel
from sd2app.session.document import DocumentModel
from sd2app.training.model import TrainingModel
from sd2app.training.result import ModelAdoption, gain_rows, gain_summary
from sd2app.training.run import TrainingHistory, TrainingMonitor
from sd2app.training.setup_view import TrainingSetupView
from sd2app.training.text import about_text, headline, metric_rows, point_text, remedy_text
from sd2app.widgets.canvas import tick_text
from sd2app.widgets.chart import Chart, ChartView, Curve, Mark, Scale
from sd2app.widgets.dialogs import ask_folder
from sd2app.widgets.inputs import CheckBox, Choice
from sd2app.widgets.layouts import STRETCH, column_of, pane, row_of
from sd2app.widgets.panel import FactRows, outlined, sentence, title
from sd2app.widgets.run_panel import Button, RunPanel, RunView, RunWords

_CLOSING_TEXT = {"ask": "ask", "keep": "keep training", "stop": "stop, keep the best"}
_PAD = 1.12
_MIN_RATIO = 1.6


class TrainingPanel(RunPanel):
    """Panel of the trainings of denoisers."""

    def __init__(
        self,
        training: TrainingModel,
        adoption: ModelAdoption,
        display: DisplayModel,
        document: DocumentModel,
        shell: Shell,
    ) -> None:
        def open_run() -> None:
            if path := ask_folder(shell.dialog_parent, "Folder of a run"):
                shell.attempt(lambda: training.open_run(path))

        super().__init__(
            training,
            TrainingSetupView(training, document, shell),
            TrainingRunView(training, adoption, display, shell),
            "Runs: those under way, and those that have ended",
            ("Open a run…", open_run),
        )


class TrainingRunView(RunView[TrainingMonitor]):
    """Curves and figures of a training, and what its model gains while it is in use."""

    def __init__(
        self, training: TrainingModel, adoption: ModelAdoption, display: DisplayModel, shell: Shell
    ) -> None:
        pause, go_on = partial(training.tell, "pause"), partial(training.tell, "run")
        resume = partial(shell.attempt, training.resume)
        buttons = (
            Button(
                "use", "Use this model", "Denoise with it, and compare with what was there before",
                adoption.use,
                lambda run: not run.under_way and run.facts.has_model and adoption.run != run.path,
                primary=True,
            ),
            Button("pause", "Pause", "Rest, and give the processor back", pause, _can_pause),
            Button(
                "go_on", "Continue", "Go on training", go_on,
                lambda run: run.phase in ("pausing", "paused"),
            ),
            Button(
                "resume", "Resume", "Go on where it ended", resume, lambda run: run.resumable
            ),
        )  # fmt: skip
        super().__init__(training, shell, RunWords(headline, remedy_text), buttons)
        self._training, self._adoption = training, adoption
        self._gain = TrainingGainView(adoption)
        empty = training_chart(TrainingHistory())
        self._curves = ChartView(display, "Errors over the epochs", empty)
        self._metrics = FactRows(3, at_the_edge=False, parent=self)
        self._about = sentence("")
        tip = "What happens to the training when the window is closed"
        self._choice = Choice(tip, self, _CLOSING_TEXT, training.set_closing)
        self._closing = pane(row_of(sentence("When closing:"), (self._choice, 1), spacing_px=8))
        adoption.changed.connect(self.refresh)
        self.add(self._gain, self._curves, self._metrics, self._about, self._closing)

    def show_made(self, run: TrainingMonitor) -> None:
        """Follow curves and figures."""
        history = run.history
        self._gain.setVisible(self._adoption.run == run.path)
        self._curves.show_chart(training_chart(history))
        self._curves.setVisible(bool(history.epoch_points or history.step_points))
        self._metrics.show_facts(metric_rows(history))
        self._about.setText(about_text(run))
        self._closing.setVisible(run.under_way)
        self._choice.show_value(self._training.closing)


def _can_pause(run: TrainingMonitor) -> bool:
    return run.under_way and run.phase not in ("starting", "pausing", "paused")


class TrainingGainView(QWidget):
    """A view of :class:`ModelAdoption`."""

    def __init__(self, adoption: ModelAdoption) -> None:
        super().__init__()
        self._adoption = adoption
        self._summary = sentence("")
        self._table = FactRows(3, at_the_edge=True, parent=self)
        self._both = CheckBox(
            "Show the map from before",
            self,
            adoption.denoise.set_comparing,
            "Draw the map of the model before under that of this one",
        )
        back = outlined("Go back", "Denoise with what was in use before", adoption.go_back, self)
        buttons = row_of(self._both, STRETCH, back)
        parts = title("In use"), self._summary, self._table, buttons
        self.setLayout(column_of(*parts, spacing_px=4, margins_px=0))
        adoption.changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        use = self._adoption
        self._summary.setText(gain_summary(use.gain, use.has_radar, is_old=use.is_old))
        self._table.show_facts(gain_rows(use.gain) if use.gain is not None else [])
        self._both.show_checked(use.denoise.comparing)
        self._both.setVisible(use.previous is not None)


def training_chart(history: TrainingHistory) -> Chart:
    """Errors over the epochs, on a logarithmic axis; the best epoch is marked."""
    epochs = history.epoch_points
    trained = [(one.epoch, one.train_rmse) for one in epochs]
    validated = [(one.epoch, one.validation_rmse) for one in epochs]
    curves = [
        Curve("", "synthetic", _drawable(history.step_points), width_px=1, alpha=80),
        Curve("training", "synthetic", _drawable(trained)),
        Curve("validation", "real", _drawable(validated)),
    ]
    # Steps scatter: they set the range only while there is little else.
    shown = [y for curve in curves[len(epochs) >= 2 :] for _, y in curve.points] or [0.1, 1.0]
    last = max((at for at, _ in [*trained[-1:], *history.step_points[-1:]]), default=0.0)
    marks = [Mark(one.epoch, one.validation_rmse, point_text(one)) for one in epochs]
    best = next(
        (mark for mark, one in zip(marks, epochs, strict=True) if one is history.best), None
    )
    return Chart(
        Scale(0.0, last or 1.0, whole=last >= 2),
        Scale.around(shown, _PAD, _MIN_RATIO, tick_text),
        "epochs",
        "RMSE",
        curves,
        marks,
        best,
    )


def _drawable(points: Collection[tuple[float, float]]) -> list[tuple[float, float]]:
    return [(x, y) for x, y in points if math.isfinite(y) and y > 0]
