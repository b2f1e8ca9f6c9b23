"""Training of denoisers, and of pairs for it, in processes that outlive the window."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

from PySide6.QtCore import QObject, Signal

from sd2app.background.run_monitor import CommandRun
from sd2app.background.runs import Runs, free_folder
from sd2app.settings import Settings
from sd2app.training.run import TrainingMonitor, model_name
from sd2app.training.setup import TrainingSetupModel
from sd2app.widgets.text import quoted
from sd2core.cli.pairs import Recordings
from sd2core.errors import Sd2Error
from sd2core.files.paths import remove, user_data
from sd2core.options.records import given_of, words_of
from sd2core.options.training import Train, TrainConfig
from sd2core.processes import ONE_THREAD
from sd2core.recording.recording import is_recording, open_recording
from sd2core.runs.command_folder import COMMAND, launch
from sd2core.train.folder import TrainingFolder


class PairRun(CommandRun):
    """Run that makes pairs."""

    stop_patience_s = 3.0


class PairMaker(Runs[PairRun]):
    """Runs ``sd2 pairs recordings`` once at a time, with ``command``.

    Pairs are kept in ``folder``, which is made on demand.
    """

    monitor, remembered = PairRun, "run"
    environment: ClassVar = {}

    made = Signal(object)  # path of a finished store

    def __init__(
        self, folder: Path, parent: QObject | None = None, command: Sequence[str] = COMMAND
    ) -> None:
        super().__init__(Settings.forgetful(), folder, parent, (*command, "--folder"))

    @property
    def out(self) -> Path | None:
        """Store that is being made."""
        return None if self.run is None else self.run.out

    def candidates(self) -> Iterable[Path]:
        """None: those of another window are its own."""
        return ()

    def make(self, place: Path, *, limbs: bool = False) -> None:
        """Make pairs of a recording, or of all recordings in a folder; with ``limbs`` also split.

        Raises Sd2Error if there is none with a mesh and a radar capture, some are being made, or
        it cannot be started; OSError if the folder cannot be read, or that of the pairs not be
        made.
        """
        if self.out is not None:
            raise Sd2Error(f"{self.out.stem} is being made already", "one at a time", "Wait for it")
        recordings = usable_recordings(place)
        self._folder.mkdir(parents=True, exist_ok=True)
        out = _free(self._folder, place.stem)
        words = words_of(
            "pairs recordings", Recordings(recordings=tuple(recordings), out=out, limbs=limbs)
        )
        self.start_command(out.with_name(f".{out.stem}"), words, what="pairs", out=str(out))

    def close(self) -> None:
        """End the process at once."""
        if self.run is not None:
            self.run.kill()
            self._clear_up(self.run)
        super().close()

    def say_ended(self, run: PairRun) -> None:
        """Say what was made, or why it was not, unless it was cancelled."""
        self._clear_up(run)
        if run.phase == "finished":
            self.made.emit(run.out)
        elif run.phase != "stopped":
            lines = run.text.splitlines() or [f"{run.out.stem} could not be made."]
            self.failed.emit(lines[-1].removeprefix("sd2: "))

    def _clear_up(self, run: PairRun) -> None:
        """Forget the process, and remove what it left."""
        self.select(None)
        run.folder.discard()
        if run.phase != "finished" and run.out.exists():
            remove(run.out)


def usable_recordings(place: Path) -> list[Path]:
    """The recording itself, or those in a folder that have a mesh and a radar capture.

    Raises Sd2Error if there is none.
    """
    folders = [place] if is_recording(place) else sorted(place.iterdir())
    usable = []
    for folder in folders:
        if is_recording(folder):
            try:
                recording = open_recording(folder)
            except Sd2Error:
                continue  # damaged: the others are still of use
            if recording.mesh is not None and recording.radar is not None:
                usable.append(folder)
    if not usable:
        raise Sd2Error(
            f"{place} holds no recording with a mesh and a radar capture",
            "a recording (.sd2), or a folder of some",
        )
    return usable


def _free(folder: Path, name: str) -> Path:
    path, number = folder / f"{name}.zarr", 2
    while path.exists():
        path, number = folder / f"{name}-{number}.zarr", number + 1
    return path


Closing = Literal["ask", "keep", "stop"]

CLOSING: tuple[Closing, ...] = ("ask", "keep", "stop")
"""Choices for a run under way when the window is closed."""


class TrainingModel(Runs[TrainingMonitor]):
    """Trainings of denoisers, of which the window starts one at a time.

    ``command`` runs ``sd2`` commands. ``folder`` holds the runs; by default as the settings
    say, or in the user's data directory.
    """

    monitor, remembered = TrainingMonitor, "training/run"

    def __init__(
        self,
        settings: Settings,
        parent: QObject | None = None,
        command: Sequence[str] = COMMAND,
        folder: Path | None = None,
    ) -> None:
        chosen = settings.stored("training/folder", "")
        folder = folder or (Path(chosen) if chosen else user_data("runs"))
        super().__init__(settings, folder, parent, command)
        self.setup = TrainingSetupModel(settings, self)
        self.setup.changed.connect(self.changed)
        self.pair_maker = PairMaker(folder.parent / "pairs", self, command)
        self.pair_maker.changed.connect(self.changed)
        self.pair_maker.made.connect(self.setup.add)
        self.pair_maker.failed.connect(self.failed)

    # --- what is known --------------------------------------------------------------------

    def to_be_left(self) -> TrainingMonitor | None:
        """The run that would go on when the window is closed, brought into view.

        Runs that were started from a terminal do not count here unless they are in view.
        """
        if not self.under_way:
            if self.live is None or not TrainingFolder(self.live.path).output.exists():
                return None
            self.select(self.live.path)
        return self.run

    @property
    def closing(self) -> Closing:
        """Choice of what happens to the run when the window is closed."""
        stored = self._settings.stored("training/closing", "ask")
        return next((name for name in CLOSING if name == stored), "ask")

    def set_closing(self, closing: Closing) -> None:
        """Choose what happens to the run when the window is closed."""
        self._settings.set_value("training/closing", closing)
        self.changed.emit()

    @property
    def why_not_start(self) -> str:
        """Reason why no run can be started; empty when one can."""
        return self.busy or self.setup.problem

    @property
    def command(self) -> str:
        """Command for a terminal that does what is set up; Sd2Error if it cannot be started."""
        config = self.setup.config
        return quoted(train_arguments(config, Path(_new_run(Path(), config).name)))

    # --- one run after another ------------------------------------------------------------

    def start(self) -> None:
        """Begin as set up; Sd2Error if it cannot start, OSError if its folder cannot be made."""
        config = self.setup.config
        self._folder.mkdir(parents=True, exist_ok=True)
        path = _new_run(self._folder, config)
        self._launch(path, train_arguments(config, path))

    def resume(self) -> None:
        """Go on with the run in view where it ended; raises what :meth:`start` does."""
        run = self.run
        if run is not None and not run.under_way:
            self._launch(run.path, ["train", "--resume", str(run.path)])

    def _launch(self, path: Path, arguments: list[str]) -> None:
        if self.busy:
            raise Sd2Error(self.busy)
        # What moves on the screen comes first: the training gets by with one processor.
        words = [*self._command, *arguments]
        self.follow_new(path, launch(words, TrainingFolder(path).output, ONE_THREAD))

    def name_of(self, path: Path, about: Mapping[str, Any]) -> str:
        """Name of its kind of model."""
        return model_name(str(about.get("model", "")))


def train_arguments(config: TrainConfig, run: Path) -> list[str]:
    """Arguments of ``sd2 train`` for all that differs from the defaults, but for the machine."""
    model, data = given_of(config.model), given_of(config.data)
    if config.model.start is None:
        # Named even where it is the default: it is what one looks for.
        model["name"] = config.model.name
    command = Train(
        inputs=data.pop("pairs"),
        model=model,
        data=data,
        training=given_of(config.training),
        background=True,
        out=run,
    )
    return words_of("train", command)


def _new_run(folder: Path, config: TrainConfig) -> Path:
    start = config.model.start
    name = config.model.name if start is None else start.stem
    return free_folder(folder, name, config.data.pairs)
