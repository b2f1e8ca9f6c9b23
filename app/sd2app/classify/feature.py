"""Gesture classifiers in the window: use and training."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QMenu, QWidget

from sd2app.background.model_worker.client import ClassifierLibrary
from sd2app.classify.model import ClassifyModel
from sd2app.classify.panel import ClassRunView, ClassSetupView
from sd2app.classify.strip import ClassStrip
from sd2app.classify.text import classifier_page, learned_text, network_text
from sd2app.classify.training import ClassTraining
from sd2app.denoise.model import DenoiseModel
from sd2app.feature import Action, Drop, Feature, Shell, report
from sd2app.labels.actions import editing
from sd2app.labels.edits import LabelEdits
from sd2app.labels.model import LabelsModel
from sd2app.session.session import Session
from sd2app.widgets.model_menu import ModelButton, ModelMenu, Words
from sd2app.widgets.run_panel import RunPanel
from sd2core.errors import Sd2Error
from sd2core.runs.command_folder import COMMAND_IN_FOLDER

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
        parent: QObject,
    ) -> None:
        self._session, self._shell, self._suggest = session, shell, suggest
        self._labels, self._edits = labels, edits
        self.model = ClassifyModel(session, denoise, labels, library, parent)
        self.training = ClassTraining(
            session.settings, self.model.use, parent, command=command or COMMAND_IN_FOLDER
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
