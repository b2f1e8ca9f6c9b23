"""Page to set up the training of a denoiser: pairs, kind of model, settings, estimated time."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtWidgets import QWidget

from sd2app.feature import Shell
from sd2app.session.document import DocumentModel
from sd2app.training.model import TrainingModel
from sd2app.training.text import INPUT_WORDS, MODEL_WORDS, division_text, model_name
from sd2app.widgets.dialogs import ask_folder
from sd2app.widgets.layouts import STRETCH, grid_of, pane, row_of
from sd2app.widgets.model_page import model_title
from sd2app.widgets.panel import ElidedLabel, Fold, ProgressBar, outlined, sentence, title
from sd2app.widgets.text import counted
from sd2app.widgets.training_form import Field, TrainingForm
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
        estimate = setup.estimate
        count = f"{estimate.segments:,} segments, {counted(estimate.steps, 'step')}"
        self.show_estimate(count, estimate.steps, estimate.step_s)
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
