"""Training of denoisers in a background process: the panel."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from functools import partial
from pathlib import Path

from PySide6.QtWidgets import QCheckBox, QMessageBox, QWidget

from sd2app.denoise.model import DenoiseModel
from sd2app.feature import Action, Feature, Shell, report
from sd2app.session.display import DisplayModel
from sd2app.session.document import DocumentModel
from sd2app.session.session import Session
from sd2app.training.model import COMMAND, TrainingModel
from sd2app.training.result import ModelAdoption, gain_rows, gain_summary
from sd2app.training.run import (
    INPUT_WORDS,
    MODEL_WORDS,
    TrainingHistory,
    TrainingMonitor,
    about_text,
    division_text,
    headline,
    metric_rows,
    model_name,
    point_text,
    remedy_text,
)
from sd2app.widgets.canvas import tick_text
from sd2app.widgets.chart import Chart, ChartView, Curve, Mark, Scale
from sd2app.widgets.dialogs import ask_folder
from sd2app.widgets.inputs import CheckBox, Choice
from sd2app.widgets.layouts import STRETCH, grid_of, pane, row_of
from sd2app.widgets.model_page import model_title
from sd2app.widgets.panel import ElidedLabel, FactRows, Fold, ProgressBar, outlined, sentence, title
from sd2app.widgets.run_panel import Button, Field, RunPanel, RunView, RunWords, TrainingForm
from sd2app.widgets.text import counted
from sd2core.denoise.files import user_models_folder
from sd2core.denoise.registry import DENOISERS
from sd2core.files.resources import is_bundled
from sd2core.options.training import DataConfig, TrainingConfig

_FIELDS = (
    Field(TrainingConfig, "epochs", "Epochs", 50),
    Field(TrainingConfig, "batch_size", "Batch", 16),
)
_MORE = (
    Field(TrainingConfig, "early_stopping_epochs", "Stop early after", 10, suffix=" epochs"),
    Field(TrainingConfig, "learning_rate", "Learning rate", 5e-4, decimals=8),
    Field(DataConfig, "range_factor", "Range factor", 0.5, decimals=1),
    Field(TrainingConfig, "seed", "Seed", 1),
)


class TrainingSetupView(TrainingForm):
    """A form over :class:`TrainingSetupModel`."""

    def __init__(self, training: TrainingModel, document: DocumentModel, shell: Shell) -> None:
        super().__init__(training.setup, shell)
        self._training, self._pairs, self._document = training, training.setup, document
        self._menu = self.add_data(
            "Pairs",
            "Add pairs",
            "Choose pairs of synthetic and radar Doppler",
            "A denoiser learns from pairs: a synthetic map, and what a radar saw of the same"
            " movement. Make them of recordings that have a mesh and a radar capture, or with"
            " sd2 simulate campaign, and add their folder.",
        )
        self._menu.aboutToShow.connect(self._fill_menu)
        self.column.addWidget(self._making_part())
        names = {name: model_name(name) for name in (*MODEL_WORDS, *DENOISERS.names())}
        self._kind = self.choice("model", "Kind of model", names)
        self._about = sentence("")
        self._inputs = self.choice(
            "inputs", "What it learns from; all but the map need pairs with --limbs", INPUT_WORDS
        )
        starts = {name: model_title(card) for name, card in self._pairs.starts.items()}
        start = self.choice(
            "start",
            "Go on from a model with pairs of your own: fewer are enough",
            {"": "New", **starts},
        )
        rows = ("Model", self._kind), ("Input", self._inputs), ("Start", start)
        lines = ((title(name), one) for name, one in rows)
        self.column.addLayout(grid_of(*lines, gaps_px=(8, 6)))
        self.column.addWidget(self._about)
        self._add_settings()
        self.add_start(training.start, lambda: training.command)
        training.changed.connect(self._refresh)
        self._refresh()

    def _making_part(self) -> QWidget:
        stop = partial(self._training.pair_maker.tell, "stop")
        self._making_text = ElidedLabel(self, "muted")
        bar = ProgressBar("Pairs are being made", width_px=64)
        bar.show_share(None)
        self._making_cancel = outlined("Cancel", "Make no pairs", stop, self)
        self._making = pane(row_of((self._making_text, 1), bar, self._making_cancel))
        return self._making

    def _add_settings(self) -> None:
        # Labels to the left; several boxes share what room there is.
        first = (part for field in _FIELDS for part in self.number(field))
        grid = grid_of([*first], gaps_px=(8, 0), wide=(1, 3))
        tip = "Put all settings back to the paper's"
        self._reset = outlined("Reset", tip, self._pairs.reset, self)
        rest = [self.number(field) for field in _MORE]
        boxes = [box for _, box in rest]
        for box in boxes:
            box.setMinimumWidth(112)
        boxes[0].setSpecialValueText("never")
        boxes[2].setPrefix("× ")
        hidden = pane(grid_of(*rest, gaps_px=(8, 4), wide=(0,)))
        more = Fold("More settings", "Learning rate, early stopping, range, seed", hidden, self)
        self.column.addLayout(grid)
        self.column.addLayout(row_of(more, STRETCH, self._reset))
        self.column.addWidget(hidden)

    def _refresh(self) -> None:
        training, setup, maker = self._training, self._pairs, self._training.pair_maker
        if training.run is not None:
            return
        division = setup.division if not setup.problem else None
        self.show_setup(division_text(division) if division is not None else "")
        self._making.setVisible(maker.run is not None)
        if maker.run is not None:
            self.nothing.hide()
            cancelling = maker.run.phase == "stopping"
            doing = "Cancelling…" if cancelling else "Making"
            self._making_text.setText(f"{doing} {maker.run.out.name}")
            self._making_cancel.setEnabled(not cancelling)
        card = setup.start
        for one in (self._kind, self._inputs):
            one.setEnabled(card is None)
        self._about.setText(
            MODEL_WORDS.get(setup.value("model"), ("", "Of a plug-in."))[1]
            if card is None
            else f"Goes on from {model_title(card)}, with its kind and its input."
        )
        self._reset.setVisible(setup.differs)
        count = f"{setup.segments:,} segments, {counted(setup.steps, 'step')}"
        self.show_estimate(count, setup.steps, setup.step_s)
        self.show_start(training.why_not_start, can_copy=not setup.problem)

    def _fill_menu(self) -> None:
        menu = self._menu
        menu.clear()
        for path in self._pairs.known:
            action = menu.addAction(path.name)
            action.setToolTip(str(path))
            action.triggered.connect(lambda _=False, path=path: self._pairs.add(path))
        if not menu.isEmpty():
            menu.addSeparator()
        menu.addAction("Folder of pairs…", self._ask_store)
        one = menu.addAction("Make of this recording", self._make_of_this)
        one.setToolTip(self._why_not_this or "Its mesh and its radar, as it was saved")
        one.setEnabled(not self._why_not_this)
        make = menu.addAction("Make of recordings…", self._ask_recordings)
        make.setToolTip("Of one recording, or of all in a folder, that have a mesh and a radar")
        make.setEnabled(self._training.pair_maker.out is None)

    def _ask_store(self) -> None:
        if path := ask_folder(self._shell.dialog_parent, "Folder of pairs to learn from"):
            self._pairs.add(path)

    @property
    def _why_not_this(self) -> str:
        """Reason why no pairs can be made of the open recording; empty where they can."""
        recording = self._document.recording
        if self._training.pair_maker.out is not None:
            return "Pairs are being made"
        if recording is None or recording.mesh is None or recording.radar is None:
            return "It takes a recording with a mesh and a radar capture"
        # What comes with the program is learnt from as it came.
        unsaved = self._document.modified and not is_bundled(recording.folder)
        return "Save the recording first" if unsaved else ""

    def _make_of_this(self) -> None:
        if (recording := self._document.recording) is not None:
            self._make_of(recording.folder)

    def _ask_recordings(self) -> None:
        if path := ask_folder(self._shell.dialog_parent, "A recording, or a folder of some"):
            self._make_of(path)

    def _make_of(self, place: Path) -> None:
        """Make pairs of a recording, or of those in a folder, for the input that is set up."""
        limbs = bool(self._pairs.parts)
        self._shell.attempt(lambda: self._training.pair_maker.make(place, limbs=limbs))


_CLOSING_TEXT = {"ask": "ask", "keep": "keep training", "stop": "stop, keep the best"}
_PAD = 1.12
_MIN_RATIO = 1.6


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
                lambda run: not run.under_way and run.has_model and adoption.run != run.path,
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
        self._summary, self._gains = sentence(""), FactRows(3, at_the_edge=True, parent=self)
        tip = "Draw the map of the model before under that of this one"
        self._both = CheckBox("Show the map from before", self, adoption.denoise.set_comparing, tip)
        back = outlined("Go back", "Denoise with what was in use before", adoption.go_back, self)
        both = row_of(self._both, STRETCH, back)
        self._gain = pane(title("In use"), self._summary, self._gains, both, spacing_px=4)
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
        """Follow curves and figures, and what the model gains while it is in use."""
        history, use = run.history, self._adoption
        self._gain.setVisible(use.run == run.path)
        self._summary.setText(gain_summary(use.gain, use.has_radar, is_old=use.is_old))
        self._gains.show_facts(gain_rows(use.gain) if use.gain is not None else [])
        self._both.show_checked(use.denoise.comparing)
        self._both.setVisible(use.previous is not None)
        self._curves.show_chart(training_chart(history))
        self._curves.setVisible(bool(history.epoch_points or history.step_points))
        self._metrics.show_facts(metric_rows(history))
        self._about.setText(about_text(run))
        self._closing.setVisible(run.under_way)
        self._choice.show_value(self._training.closing)


def _can_pause(run: TrainingMonitor) -> bool:
    return run.under_way and run.phase not in ("starting", "pausing", "paused")


def training_chart(history: TrainingHistory) -> Chart:
    """Errors over the epochs, on a logarithmic axis; the best epoch is marked."""
    epochs, best = history.epoch_points, history.best
    trained = [(one.epoch, one.train_rmse) for one in epochs]
    validated = [(one.epoch, one.validation_rmse) for one in epochs]
    curves = [
        Curve("", "synthetic", history.step_points, width_px=1, alpha=80),
        Curve("training", "synthetic", _drawable(trained)),
        Curve("validation", "real", _drawable(validated)),
    ]
    # Steps scatter: they set the range only while there is little else.
    shown = [y for curve in curves[len(epochs) >= 2 :] for _, y in curve.points] or [0.1, 1.0]
    last = max((at for at, _ in [*trained[-1:], *history.step_points[-1:]]), default=0.0)
    marks = [Mark(one.epoch, one.validation_rmse, point_text(one)) for one in epochs]
    return Chart(
        Scale(0.0, last or 1.0, whole=last >= 2),
        Scale.around(shown, _PAD, _MIN_RATIO, tick_text),
        "epochs",
        "RMSE",
        curves,
        marks,
        None if best is None else marks[epochs.index(best)],
    )


def _drawable(points: Collection[tuple[float, float]]) -> list[tuple[float, float]]:
    return [(x, y) for x, y in points if math.isfinite(y) and y > 0]


def open_run(training: TrainingModel, shell: Shell) -> None:
    """Let the user choose the folder of a run, and show it."""
    if path := ask_folder(shell.dialog_parent, "Folder of a run"):
        shell.attempt(lambda: training.open_run(path))


def may_leave(training: TrainingModel, parent: QWidget) -> bool:
    """True if the window may close; decides on a run under way."""
    run = training.to_be_left()
    if run is None or run.phase in ("stopping", "cancelling"):
        return True  # it ends by itself
    if training.closing == "ask":
        return _ask_what_becomes(training, run.folder.path.name, parent)
    if training.closing == "stop":
        training.tell("stop")
    return True


def _ask_what_becomes(training: TrainingModel, name: str, parent: QWidget) -> bool:
    box = QMessageBox(parent)
    box.setIcon(QMessageBox.Icon.Question)
    box.setWindowTitle("A training is under way")
    box.setText(f"{name} is being trained.")
    box.setInformativeText(
        "It needs no window: it can go on in the background, and is found again when the"
        " program is started the next time."
    )
    roles = QMessageBox.ButtonRole
    keep = box.addButton("Keep training in the background", roles.AcceptRole)
    stop = box.addButton("Stop and keep the best", roles.AcceptRole)
    discard = box.addButton("Cancel and discard", roles.DestructiveRole)
    stay = box.addButton("Don't close", roles.RejectRole)
    box.setDefaultButton(keep)
    box.setEscapeButton(stay)
    always = QCheckBox("Do so every time, unless it is to be discarded", box)
    box.setCheckBox(always)
    box.exec()
    chosen = box.clickedButton()
    box.deleteLater()
    if chosen is discard:
        training.tell("cancel")
    elif chosen is stop:
        training.tell("stop")
    elif chosen is not keep:
        return False
    if always.isChecked() and chosen is not discard:
        training.set_closing("stop" if chosen is stop else "keep")
    return True


class TrainingFeature(Feature):
    """Runs that train denoisers, and the use of what they made."""

    def __init__(
        self, session: Session, shell: Shell, denoise: DenoiseModel, command: Sequence[str] | None
    ) -> None:
        self._session, self._shell = session, shell
        self.model = TrainingModel(session.settings, session.parent, command or COMMAND)
        self.adoption = ModelAdoption(
            self.model, denoise, session.maps, user_models_folder, session.parent
        )
        report(shell, self.model, self.adoption)
        self.closing, self.running = (self.adoption, self.model), (self.model,)  # runs go on

    def actions(self) -> Sequence[Action]:
        """The panel."""
        return (
            Action(
                "show_train", "View", "Train panel", ("Shift+T",),
                "Train a denoiser in the background, watch it, and use it",
                lambda: self._shell.bring_up("Train", "Denoiser"),
            ),
        )  # fmt: skip

    def panel(self) -> QWidget:
        """Page of the Train panel."""
        s, shell = self._session, self._shell
        setup = TrainingSetupView(self.model, s.document, shell)
        run = TrainingRunView(self.model, self.adoption, s.display, shell)
        other = "Open a run…", partial(open_run, self.model, shell)
        tip = "Runs: those under way, and those that have ended"
        return RunPanel(self.model, setup, run, tip, other)

    def may_close(self) -> bool:
        """Ask what becomes of a run under way."""
        return may_leave(self.model, self._shell.dialog_parent)
