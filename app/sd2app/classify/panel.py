"""Panel of the trainings of classifiers: something new to be set up, or one in view."""

from __future__ import annotations

from collections.abc import Collection
from functools import partial

from sd2app.background.run_monitor import UNDER_WAY
from sd2app.classify.dialogs import ClassifyDialogs
from sd2app.classify.run import CheckPoint, ClassHistory, ClassRun
from sd2app.classify.setup_view import ClassSetupView
from sd2app.classify.text import note, run_headline, run_time_text
from sd2app.classify.training import ClassTraining
from sd2app.session.display import DisplayModel
from sd2app.widgets.chart import Chart, ChartView, Curve, Mark, Scale
from sd2app.widgets.panel import FactRows, sentence
from sd2app.widgets.run_panel import Button, RunPanel, RunView


class ClassPanel(RunPanel):
    """Panel of trainings and comparisons of classifiers."""

    def __init__(
        self, training: ClassTraining, display: DisplayModel, dialogs: ClassifyDialogs
    ) -> None:
        super().__init__(
            training,
            ClassSetupView(training, dialogs),
            ClassRunView(training, display, dialogs),
            "Trainings and comparisons: under way, or ended",
        )


class ClassRunView(RunView[ClassRun]):
    """Recall of a training, and the result of a comparison."""

    def __init__(
        self, training: ClassTraining, display: DisplayModel, dialogs: ClassifyDialogs
    ) -> None:
        shell = dialogs.shell
        buttons = (
            Button(
                "use", "Use this model", "Say with it which gesture each frame shows",
                partial(shell.attempt, training.use_model), primary=True,
            ),
            Button(
                "show", "Show result", "Both confusion matrices, and the learning curve",
                dialogs.show_result, primary=True,
            ),
            Button(
                "again", "Resume", "Train what is missing", partial(shell.attempt, training.again)
            ),
        )  # fmt: skip
        super().__init__(training, shell, buttons)
        self._training = training
        self._curve = ChartView(display, "Recall over the steps", class_chart(ClassHistory()))
        self._facts = FactRows(1, at_the_edge=False, parent=self)
        self._about = sentence("")
        for part in (self._curve, self._facts, self._about):
            self.column.addWidget(part)
        self.refresh()

    def texts(self, run: ClassRun) -> tuple[str, str, str]:
        """Headline, time, and advice for a run that has ended."""
        return run_headline(run), run_time_text(run), note(run)

    def shown(self, run: ClassRun) -> Collection[str]:
        """Names of the buttons that are of use now."""
        if run.phase in UNDER_WAY:
            return ("stop", "delete")
        useful = {
            "use": run.result is not None and not run.compares and not self._training.in_use,
            "show": run.result is not None and run.compares,
            "again": run.compares and run.phase != "finished",
            "delete": True,
        }
        return [name for name, is_useful in useful.items() if is_useful]

    def show_made(self, run: ClassRun) -> None:
        """Follow recall and loss."""
        history, best = run.history, run.history.best
        self._curve.show_chart(class_chart(history))
        self._curve.setVisible(not run.compares and bool(history.losses))
        self._facts.show_facts([] if best is None else [("Best recall", recall_text(best))])
        self._about.setText(run.path.name)
        self._about.setToolTip(str(run.path))


def recall_text(check: CheckPoint) -> str:
    """Recall at a step."""
    return f"{100 * check.recall:.1f} %, at step {check.step}"


def class_chart(history: ClassHistory) -> Chart:
    """Recall in per cent and, faint, the loss as a share of the first one, over the steps."""
    losses, checks = history.losses, history.checks
    first = max(losses[0].loss, 1e-9) if losses else 1.0
    marks = [Mark(one.step, 100 * one.recall, _check_text(one)) for one in checks]
    best = next(
        (mark for mark, one in zip(marks, checks, strict=True) if one is history.best), None
    )
    return Chart(
        Scale(0.0, float(max(history.total, 1))),
        Scale(0.0, 100.0, values=(0, 25, 50, 75, 100)),
        "steps",
        "%",
        [
            Curve(
                "loss",
                "synthetic",
                [(one.step, 100 * min(one.loss / first, 1.0)) for one in losses],
                width_px=1,
                alpha=110,
            ),
            Curve("recall, validation", "real", [(one.x, one.y) for one in marks], dot_px=2.0),
        ],
        marks,
        best,
    )


def _check_text(check: CheckPoint) -> str:
    best = ", better than all before" if check.best else ""
    return f"Step {check.step}{best}\nRecall {100 * check.recall:.1f} %"
