"""Gesture classifiers in the window: use, and the panel of their trainings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial
from pathlib import Path

from PySide6.QtWidgets import QLabel, QMenu, QWidget

from sd2app.background.model_worker.client import ClassifierLibrary
from sd2app.classify.model import (
    FEATURE_WORDS,
    MODEL_WORDS,
    ClassifyModel,
    classifier_page,
    learned_text,
    network_text,
    note,
    run_headline,
)
from sd2app.classify.run import MAPS, CheckPoint, ClassHistory, ClassRun, ClassTraining, DataSource
from sd2app.classify.strip import ClassStrip
from sd2app.denoise.model import DenoiseModel
from sd2app.feature import Action, Drop, Feature, Shell, report
from sd2app.labels.actions import editing
from sd2app.labels.edits import LabelEdits
from sd2app.labels.model import LabelsModel
from sd2app.session.content import UNTITLED
from sd2app.session.display import DisplayModel
from sd2app.session.document import DocumentModel
from sd2app.session.session import Session
from sd2app.training.run import division_text
from sd2app.widgets.chart import Chart, ChartView, Curve, Mark, Scale
from sd2app.widgets.dialogs import ask_file, ask_folder
from sd2app.widgets.inputs import CheckBox, TypedLine
from sd2app.widgets.layouts import grid_of, row_of
from sd2app.widgets.model_menu import ModelButton, ModelMenu, Words
from sd2app.widgets.panel import FactRows, sentence, side_by_side
from sd2app.widgets.run_panel import Button, Field, RunPanel, RunView, RunWords, TrainingForm
from sd2app.widgets.text import counted
from sd2core.classify.defaults import model_names
from sd2core.cli.classify.train import Train
from sd2core.errors import Sd2Error
from sd2core.runs.command_folder import COMMAND_IN_FOLDER

_DATA = "Data sets and labelled radar files (*.h5 *.hdf5 *.npz)"
_MAP_TIPS = {
    "radar": "What a radar saw, simulated or real",
    "synthetic": "Counted from the mesh",
    "denoised": "The synthetic ones, as the bundled denoiser makes them a radar's",
}
_FIELDS = (
    Field(Train, "delay_s", "Waits", 0.1, decimals=2, suffix=" s"),
    Field(Train, "width", "Width", 8),
    Field(Train, "steps", "Steps", 50),
    Field(Train, "seed", "Seed", 1),
)


class ClassSetupView(TrainingForm):
    """A form over :class:`ClassSetup`."""

    def __init__(self, training: ClassTraining, document: DocumentModel, shell: Shell) -> None:
        super().__init__(training.setup, shell)
        self._training, self._labelled, self._document = training, training.setup, document
        self._add_labelled_data()
        self._add_network()
        self.add_start(training.train, lambda: training.command)
        training.changed.connect(self._refresh)
        self._refresh()

    def _add_labelled_data(self) -> None:
        menu = self.add_data(
            "Labelled data",
            "Add data",
            "Choose labelled data to learn from",
            "A classifier learns from labelled maps: of a simulated campaign, of an exported data"
            " set, or of recordings and radar files in which gestures are labelled.",
        )
        folder = menu.addAction("Folder…", self._add_folder)
        folder.setToolTip("A campaign or pairs, a data set (.zarr), a recording, or several")
        file = menu.addAction("File…", self._add_file)
        file.setToolTip("A data set (.h5, .npz), or a labelled radar file (.h5)")
        this = menu.addAction("This recording", lambda: self._labelled.add(*self._this))
        menu.aboutToShow.connect(lambda: this.setEnabled(bool(self._this)))

    def _add_folder(self) -> None:
        title = "A campaign, a data set, a recording, or a folder of recordings"
        if path := ask_folder(self._shell.dialog_parent, title):
            self._labelled.add(path)

    def _add_file(self) -> None:
        if path := ask_file(self._shell.dialog_parent, "Data set or labelled radar file", _DATA):
            self._labelled.add(path)

    @property
    def _this(self) -> tuple[Path, ...]:
        """The open recording, if it can be learnt from: it is on disk."""
        recording = self._document.recording
        on_disk = recording is not None and recording.folder != UNTITLED
        return (recording.folder,) if recording is not None and on_disk else ()

    def _add_network(self) -> None:
        self._boxes: dict[str, CheckBox] = {}
        for name in MAPS:
            chosen = partial(self._labelled.set_map, name)
            self._boxes[name] = CheckBox(name, self, chosen, _MAP_TIPS[name])
        grid = grid_of(gaps_px=(8, 4), wide=(1, 3))
        grid.addWidget(QLabel("Maps", self), 0, 0)
        grid.addLayout(side_by_side(*self._boxes.values()), 0, 1, 1, 3)
        names = {name: MODEL_WORDS.get(name, name) for name in model_names()}
        network = self.choice("model", "Kind of network", names)
        shown = self.choice("features", "What it is shown of each frame", FEATURE_WORDS)
        for row, (text, choice) in enumerate((("Network", network), ("Sees", shown)), start=1):
            grid.addWidget(QLabel(text, self), row, 0)
            grid.addWidget(choice, row, 1, 1, 3)
        for number, field in enumerate(_FIELDS):
            row, column = divmod(number, 2)
            for beside, part in enumerate(self.number(field)):
                grid.addWidget(part, 3 + row, 2 * column + beside)
        self.column.addLayout(grid)

    def _refresh(self) -> None:
        training, setup = self._training, self._labelled
        if training.run is not None:
            return
        self.show_setup(
            ""
            if setup.division is None
            else division_text(
                setup.division, "judging, with sd2 classify eval", "some of the movements"
            )
        )
        for name, box in self._boxes.items():
            box.show_checked(name in setup.maps)
        steps = 0 if setup.problem else setup.value("steps")
        count = f"The data is read first; then {counted(steps, 'step')}"
        self.show_estimate(count, steps, setup.step_s)
        self.show_start(training.why_not_train, can_copy=not setup.train_problem)

    def below_row(self, one: DataSource) -> QWidget | None:
        """Make the field for the name of the person, where the user can name one."""
        if not one.nameable:
            return None
        line = TypedLine(
            f"Who {one.path.name} is of",
            "Who it is of: whoever is learnt from is neither chosen by nor judged on.\nThe same"
            " name for everything of one person.",
        )
        line.setText(one.person)
        itself = one.people[0] if len(one.people) == 1 else "each a different person"
        line.setPlaceholderText("" if one.person else itself)
        line.ended.connect(lambda: self._labelled.name_person(one.path, line.text()))
        field = QWidget(self)
        field.setLayout(row_of(QLabel("Person"), (line, 1), spacing_px=8, margins_px=(0, 2, 0, 2)))
        return field


class ClassRunView(RunView[ClassRun]):
    """Recall of a training."""

    def __init__(self, training: ClassTraining, display: DisplayModel, shell: Shell) -> None:
        buttons = (
            Button(
                "use", "Use this model", "Say with it which gesture each frame shows",
                partial(shell.attempt, training.use_model),
                lambda run: not run.under_way and run.result and not training.in_use, primary=True,
            ),
        )  # fmt: skip
        super().__init__(training, shell, RunWords(run_headline, note), buttons)
        self._curve = ChartView(display, "Recall over the steps", class_chart(ClassHistory()))
        self._facts = FactRows(1, at_the_edge=False, parent=self)
        self._about = sentence("")
        self.add(self._curve, self._facts, self._about)

    def show_made(self, run: ClassRun) -> None:
        """Follow recall and loss."""
        history, best = run.history, run.history.best
        self._curve.show_chart(class_chart(history))
        self._curve.setVisible(bool(history.losses))
        self._facts.show_facts([] if best is None else [("Best recall", recall_text(best))])
        self._about.setText(run.path.name)
        self._about.setToolTip(str(run.path))


def recall_text(check: CheckPoint) -> str:
    """Recall at a step."""
    return f"{100 * check.recall:.1f} %, at step {check.step}"


def class_chart(history: ClassHistory) -> Chart:
    """Recall in per cent and, faint, the loss as a share of the first one, over the steps."""
    losses, checks, best = history.losses, history.checks, history.best
    first = max(losses[0][1], 1e-9) if losses else 1.0
    marks = [Mark(one.step, 100 * one.recall, _check_text(one)) for one in checks]
    return Chart(
        Scale(0.0, float(max(history.total, 1))),
        Scale(0.0, 100.0, values=(0, 25, 50, 75, 100)),
        "steps",
        "%",
        [
            Curve(
                "loss",
                "synthetic",
                [(step, 100 * min(loss / first, 1.0)) for step, loss in losses],
                width_px=1,
                alpha=110,
            ),
            Curve("recall, validation", "real", [(one.x, one.y) for one in marks], dot_px=2.0),
        ],
        marks,
        None if best is None else marks[checks.index(best)],
    )


def _check_text(check: CheckPoint) -> str:
    best = ", better than all before" if check.best else ""
    return f"Step {check.step}{best}\nRecall {100 * check.recall:.1f} %"


_WORDS = Words(
    "Classify with",
    "Classifier",
    "Say nothing of gestures",
    "Choose a model that says which gesture a frame shows",
    network_text,
    learned_text,
    "Open classifier file",
    "Classifiers (*.safetensors)",
    classifier_page,
)


class ClassifyFeature(Feature):
    """Probabilities of gestures below the maps, and runs that train classifiers.

    ``suggest`` suggests what a finder finds.
    """

    def __init__(
        self,
        session: Session,
        shell: Shell,
        denoise: DenoiseModel,
        labels: LabelsModel,
        edits: LabelEdits,
        library: ClassifierLibrary,
        suggest: Callable[[ClassifyModel], object],
        command: Sequence[str] | None,
    ) -> None:
        self._session, self._shell, self._suggest = session, shell, suggest
        self._labels, self._edits = labels, edits
        self.model = ClassifyModel(session, denoise, labels, library, session.parent)
        self.training = ClassTraining(
            session.settings, self.model.use, session.parent, command=command or COMMAND_IN_FOLDER
        )
        self.model.failed.connect(shell.warn)
        report(shell, self.training)
        came = (track.came_or_went for track in session.maps.all)
        self.changing = *self.model.signals, *came
        self.closing = (self.training, self.model)  # runs go on
        self.working, self.running = (self.model,), (self.training,)

    def actions(self) -> Sequence[Action]:
        """Classifier, its probabilities, gestures as suggestions, training."""
        model = self.model
        return (
            *editing(
                self._edits,
                Action(
                    "find_gestures", "Labels", "Find gestures", ("Shift+G",),
                    "Suggest what the classifier takes for gestures; each is then accepted or"
                    " rejected",
                    lambda: self._suggest(model), why_not=lambda: model.why_not,
                ),
            ),
            Action(
                "open_classifier", "Model", "Open classifier file…", (),
                "Say which gesture each frame shows, with a classifier of your own (.safetensors)",
                lambda: self._classifiers.open_file(),
            ),
            Action(
                "classifier_card", "Model", "About this classifier…", (),
                "What it is shown, what it learned from, and how well it did",
                lambda: self._classifiers.show_card(), lambda: model.card is not None,
            ),
            Action(
                "show_classes", "Model", "Probabilities of gestures", ("Shift+I",),
                "Show under the maps how probable each gesture is, and which one is on screen",
                lambda: model.set_shown(not model.shown),
                checked=lambda: model.shown and model.path is not None,
                why_not=lambda: "" if model.path is not None else "No classifier is in use",
            ),
            Action(
                "train_classifier", "Model", "Train a classifier…", ("Shift+C",),
                "Learn gestures from labelled maps, in the background",
                lambda: self._shell.bring_up("Train", "Classifier"),
            ),
        )  # fmt: skip

    def menus(self) -> Mapping[str, Callable[[QMenu], object]]:
        """The classifiers to choose from."""
        return {"classifiers": lambda menu: menu.addMenu(self._classifiers)}

    @cached_property
    def _classifiers(self) -> ModelMenu:
        below = "open_classifier", "classifier_card"
        return ModelMenu(self.model, _WORDS, self._shell, below)

    def panels(self) -> Mapping[str, QWidget]:
        """Probabilities below the maps."""
        button = ModelButton(self._classifiers)
        return {"classes": ClassStrip(self._session, self.model, self._labels, button)}

    def panel(self) -> QWidget:
        """Page of the Train panel."""
        s, shell, training = self._session, self._shell, self.training
        setup = ClassSetupView(training, s.document, shell)
        run = ClassRunView(training, s.display, shell)
        return RunPanel(training, setup, run, "Trainings: under way, or ended")

    def drop_of(self, path: Path) -> Drop | None:
        """Use a classifier that is dropped."""
        if path.suffix != ".safetensors":
            return None
        try:
            self.model.describe(path)
        except Sd2Error:
            return None  # another kind of model
        return Drop("Classify with this model", lambda: self._classifiers.use(path))
