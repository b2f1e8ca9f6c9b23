"""Progress, curves and actions of one training run."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from PySide6.QtCore import QSignalBlocker
from PySide6.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QProgressBar,
    QVBoxLayout,
    QWidget,
)

from sd2app.background.run_monitor import UNDER_WAY, Phase
from sd2app.session.display import DisplayModel
from sd2app.training.curves import TrainingCurves
from sd2app.training.model import CLOSING, TrainingModel
from sd2app.training.run import TrainingMonitor
from sd2app.training.text import (
    about_text,
    headline,
    metric_rows,
    remedy_text,
    time_text,
)
from sd2app.widgets.inputs import Choice
from sd2app.widgets.panel import FactRows, outlined, sentence

_STEPS = 1000
_CLOSING_TEXT = {"ask": "ask", "keep": "keep training", "stop": "stop, keep the best"}
_BUTTONS: dict[Phase, tuple[str, ...]] = {
    "starting": ("cancel",),
    "running": ("pause", "stop", "cancel"),
    "pausing": ("go_on", "stop", "cancel"),
    "paused": ("go_on", "stop", "cancel"),
    "resuming": ("pause", "stop", "cancel"),
    "stopping": ("pause", "stop", "cancel"),
    "cancelling": ("pause", "stop", "cancel"),
    "finished": ("use", "delete"),
    "stopped": ("use", "resume", "delete"),
    "failed": ("use", "resume", "delete"),
    "died": ("use", "resume", "delete"),
    "gone": (),
}


class TrainingRunView(QWidget):
    """A view of :class:`TrainingMonitor`.

    The callables may ask first, or be refused. ``gain`` is put under the buttons.
    """

    def __init__(
        self,
        training: TrainingModel,
        display: DisplayModel,
        use: Callable[[], None],
        resume: Callable[[], None],
        delete: Callable[[], None],
        gain: QWidget | None = None,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._training = training
        self._in_use = False
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(6)
        self._add_progress(layout)
        # Above the curves: they are to be at hand in a low window, too.
        self._add_buttons(layout, use, resume, delete)
        self._add_reasons(layout)
        if gain is not None:
            layout.addWidget(gain)
        self._curves = TrainingCurves(training, display, self)
        layout.addWidget(self._curves)
        self._metrics = FactRows(3, at_the_edge=False, parent=self)
        layout.addWidget(self._metrics)
        self._about = sentence("")
        layout.addWidget(self._about)
        self._add_closing(layout)
        training.changed.connect(self._refresh)
        self._refresh()

    def set_in_use(self, in_use: bool) -> None:
        """Note that the model of this run denoises the recording, or does not."""
        if in_use != self._in_use:
            self._in_use = in_use
            self._refresh()

    # --- building -------------------------------------------------------------------------

    def _add_progress(self, layout: QVBoxLayout) -> None:
        self._headline = QLabel(self)
        self._headline.setObjectName("title")
        self._headline.setWordWrap(True)
        self._headline.setAccessibleName("How the training stands")
        self._time = sentence("")
        self._bar = QProgressBar(self)
        self._bar.setMaximumHeight(14)
        self._bar.setTextVisible(False)
        self._bar.setAccessibleName("Progress of the training")
        for widget in (self._headline, self._bar, self._time):
            layout.addWidget(widget)

    def _add_reasons(self, layout: QVBoxLayout) -> None:
        self._reason = sentence("", "warning")
        self._remedy = sentence("")
        layout.addWidget(self._reason)
        layout.addWidget(self._remedy)

    def _add_buttons(
        self,
        layout: QVBoxLayout,
        use: Callable[[], None],
        resume: Callable[[], None],
        delete: Callable[[], None],
    ) -> None:
        tell = partial(partial, self._training.tell)
        self._buttons = {
            "use": outlined(
                "Use this model", "Denoise with it, and compare with what was there before",
                use, self,
            ),
            "pause": outlined("Pause", "Rest, and give the processor back", tell("pause"), self),
            "go_on": outlined("Continue", "Go on training", tell("run"), self),
            "stop": outlined("Stop", "End it now and keep the best model", tell("stop"), self),
            "cancel": outlined(
                "Cancel", "End it now and delete what it made", tell("cancel"), self
            ),
            "resume": outlined("Resume", "Go on where it ended", resume, self),
            "delete": outlined("Delete…", "Delete this run with its model", delete, self),
        }  # fmt: skip
        self._buttons["use"].setObjectName("primary")
        row = QHBoxLayout()
        row.setSpacing(6)
        for button in self._buttons.values():
            row.addWidget(button)
        row.addStretch(1)
        layout.addLayout(row)

    def _add_closing(self, layout: QVBoxLayout) -> None:
        self._closing = QWidget(self)
        self._choice = Choice("What happens to the training when the window is closed", self)
        for name in CLOSING:
            self._choice.addItem(_CLOSING_TEXT[name], name)
        self._choice.currentIndexChanged.connect(
            lambda index: self._training.set_closing(CLOSING[index])
        )
        row = QHBoxLayout(self._closing)
        row.setContentsMargins(0, 0, 0, 0)
        label = QLabel("When closing:", self)
        label.setObjectName("muted")
        row.addWidget(label)
        row.addWidget(self._choice, 1)
        layout.addWidget(self._closing)

    # --- showing --------------------------------------------------------------------------

    def _refresh(self) -> None:
        run = self._training.run
        if run is None:
            return
        phase, history = run.phase, run.history
        under_way = phase in UNDER_WAY
        self._headline.setText(headline(run))
        self._time.setText(time_text(run))
        self._time.setVisible(bool(self._time.text()))
        self._bar.setVisible(under_way)
        share = history.share
        # Without a maximum the bar says that it is busy.
        self._bar.setRange(0, 0 if share is None else _STEPS)
        if share is not None:
            self._bar.setValue(round(share * _STEPS))
        self._reason.setText(run.text)
        self._reason.setVisible(bool(run.text) and phase in ("failed", "died"))
        self._remedy.setText(remedy_text(run))
        self._remedy.setVisible(bool(self._remedy.text()))
        self._curves.setVisible(bool(history.epoch_points or history.step_points))
        self._metrics.show_facts(metric_rows(history))
        self._refresh_buttons(run, phase)
        self._about.setText(about_text(run))
        self._closing.setVisible(under_way)
        with QSignalBlocker(self._choice):
            self._choice.setCurrentIndex(CLOSING.index(self._training.closing))

    def _refresh_buttons(self, run: TrainingMonitor, phase: Phase) -> None:
        shown = _BUTTONS[phase]
        has_model, resumable = run.has_model, run.resumable
        for name, button in self._buttons.items():
            there = name in shown
            if name == "use":
                there = there and has_model and not self._in_use
            elif name == "resume":
                there = there and resumable
            button.setVisible(there)
        busy = phase in ("stopping", "cancelling")
        for name in ("pause", "go_on", "stop"):
            self._buttons[name].setEnabled(not busy)
        self._buttons["cancel"].setEnabled(phase != "cancelling")
