"""Training classifiers, in processes that outlive the window."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject

from sd2app.background.quoting import quoted
from sd2app.background.runs import Runs, free_folder
from sd2app.classify.run import MODEL_NAME, ClassRun
from sd2app.classify.setup import ClassSetup
from sd2app.settings import Settings
from sd2core.classify.files import user_classifiers_folder
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write
from sd2core.runs.command_folder import COMMAND_IN_FOLDER


class ClassTraining(Runs[ClassRun]):
    """Trainings of classifiers, one under way at a time.

    ``use`` classifies with a file. ``folder`` is that of the classifiers, with the runs in
    ``runs`` below it. ``command`` is the program that runs ``sd2`` commands in a folder.
    """

    monitor, remembered = ClassRun, "classify/train/run"

    def __init__(
        self,
        settings: Settings,
        use: Callable[[Path], None],
        parent: QObject,
        folder: Path | None = None,
        command: Sequence[str] = COMMAND_IN_FOLDER,
    ) -> None:
        self._classifiers = folder or user_classifiers_folder()
        super().__init__(settings, self._classifiers / "runs", parent, command)
        self._use = use
        self.setup = ClassSetup(settings, self)
        self.follow_setup(self.setup)
        self._used: Path | None = None

    @property
    def in_use(self) -> bool:
        """True if the model of the run in view is in use."""
        return self.run is not None and self._used == self.run.path

    @property
    def why_not_train(self) -> str:
        """Reason why no classifier can be trained; empty when one can."""
        return self.busy or self.setup.train_problem

    @property
    def command(self) -> str:
        """Command for a terminal that does what is set up."""
        return quoted(self.setup.train_arguments(Path(MODEL_NAME)))

    def name_of(self, path: Path, about: Mapping[str, Any]) -> str:
        """Name of such a run, the same for all."""
        return "Training"

    def train(self) -> None:
        """Begin as set up; Sd2Error if it cannot start, OSError if its folder cannot be made."""
        if self.why_not_train:
            raise Sd2Error(self.why_not_train)
        data = [one.path for one in self.setup.data]
        path = free_folder(self._folder, str(self.setup.value("model")), data)
        words = [*self.setup.train_arguments(path / MODEL_NAME), "--progress-json"]
        self.start_command(path, words, what="train")

    def use_model(self) -> None:
        """Keep the model of the run in view among the classifiers, and classify with it.

        Raises Sd2Error or OSError if it cannot be read or kept.
        """
        run = self.run
        if run is None or run.result is None:
            return
        kept = self._classifiers / f"{run.path.name}.safetensors"
        with atomic_write(kept) as stream:
            stream.write(run.result.read_bytes())
        self._use(kept)
        self._used = run.path
        self.changed.emit()
