"""Training and comparing classifiers, in processes that outlive the window."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from PySide6.QtCore import QObject, Signal

from sd2app.background.run_command import COMMAND_IN_FOLDER, CommandFolder, commands_in
from sd2app.background.step_times import PatientTiming, StepKey, StepTime, StepTimes
from sd2app.classify.library import user_classifiers_folder
from sd2app.classify.run import MODEL_NAME, TABLE_NAME, ClassRun
from sd2app.classify.setup import ClassSetup
from sd2app.settings import Settings
from sd2app.training.command import quoted
from sd2app.widgets.text import clock_text
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write


class KnownRun(NamedTuple):
    """A run on disk."""

    path: Path
    title: str
    live: bool


class ClassTraining(QObject):
    """One run in view, the others in a list; one under way at a time.

    ``use`` classifies with a file. ``folder`` is that of the classifiers, with the runs in
    ``runs`` below it. ``command`` is the program that runs ``sd2`` commands in a folder.
    ``step_times`` is shared with the training of denoisers.
    """

    changed = Signal()
    noted = Signal(str)
    failed = Signal(str)

    def __init__(
        self,
        settings: Settings,
        use: Callable[[Path], None],
        parent: QObject | None = None,
        folder: Path | None = None,
        command: Sequence[str] = COMMAND_IN_FOLDER,
        step_times: StepTimes | None = None,
    ) -> None:
        super().__init__(parent)
        self._use, self._command = use, tuple(command)
        self._folder = folder or user_classifiers_folder()
        self.setup = ClassSetup(settings, self)
        self.step_times = step_times or StepTimes(settings, self)
        self._timing = PatientTiming(self.step_times, self._to_be_timed, self)
        self.setup.changed.connect(self.changed)
        self.setup.changed.connect(self._timing.wait)
        self.step_times.changed.connect(self.changed)
        self._run: ClassRun | None = None
        self._runs: tuple[KnownRun, ...] = ()
        self._watched = False
        self._used: Path | None = None

    # --- what is known --------------------------------------------------------------------

    @property
    def run(self) -> ClassRun | None:
        """The run in view; None while a new one is being set up."""
        return self._run

    @property
    def runs(self) -> tuple[KnownRun, ...]:
        """Runs on disk, the newest first."""
        return self._runs

    @property
    def under_way(self) -> bool:
        """True while the run in view has a process."""
        return self._run is not None and self._run.under_way

    @property
    def mark(self) -> str:
        """Share of the run in view that is done, as text; empty when none is under way."""
        if self._run is None or not self._run.under_way:
            return ""
        share = self._run.history.share
        return "…" if share is None else f"{100 * share:.0f} %"

    @property
    def in_use(self) -> bool:
        """True if the model of the run in view is in use."""
        return self._run is not None and self._used == self._run.path

    @property
    def _busy_with(self) -> str:
        if self.under_way and self._run is not None:
            return self._run.path.name
        return next((one.path.name for one in self._runs if one.live), "")

    @property
    def why_not_train(self) -> str:
        """Reason why no classifier can be trained; empty when one can."""
        busy = self._busy_with
        return (
            f"{busy} is under way. Wait for it, or stop it." if busy else (self.setup.train_problem)
        )

    @property
    def why_not_compare(self) -> str:
        """Reason why nothing can be compared; empty when something can."""
        busy = self._busy_with
        return f"{busy} is under way. Wait for it, or stop it." if busy else self.setup.problem

    @property
    def step(self) -> StepTime | None:
        """Time of a training step on this machine; None until it is known."""
        return self.step_times.of(self.setup.step_key)

    @property
    def estimate_s(self) -> float | None:
        """Estimated time of the training once the data has been read; None: not known."""
        return None if self.step is None else self.step.seconds * self.setup.value("steps")

    @property
    def command(self) -> str:
        """Command for a terminal that does what is set up."""
        return quoted(self.setup.train_arguments(Path(MODEL_NAME)))

    # --- one run after another ------------------------------------------------------------

    def set_watched(self, watched: bool) -> None:
        """Note that the panel is visible or hidden."""
        self._watched = watched
        if watched:
            self.setup.refresh()
            self.refresh()
        self._timing.look()

    def _to_be_timed(self) -> StepKey | None:
        wanted = self._watched and self._run is None and not self.why_not_train
        return self.setup.step_key if wanted else None

    def look_for_runs(self) -> None:
        """At the start of the program: find what is under way."""
        self.refresh()
        live = next((one for one in self._runs if one.live), None)
        if live is not None:
            self.select(live.path)
            self.noted.emit(f"{live.path.name} is under way. The Train panel shows it.")

    def refresh(self) -> None:
        """Read the folder of runs again."""
        found = commands_in(self._folder / "runs")
        self._runs = tuple(KnownRun(one.path, _title(one), one.live) for one in found)
        self.changed.emit()

    def select(self, path: Path | None) -> None:
        """Show a run; None is a new one, to be set up."""
        if self._run is not None:
            if self._run.path == path:
                return
            self._run.close()
            self._run.deleteLater()
            self._run = None
        if path is not None:
            self._follow(ClassRun(path, self))
        self.changed.emit()

    def train(self) -> None:
        """Begin as set up; Sd2Error if it cannot start, OSError if its folder cannot be made."""
        if self.why_not_train:
            raise Sd2Error(self.why_not_train)
        path = self._new_folder(str(self.setup.value("model")))
        words = self.setup.train_arguments(path / MODEL_NAME)
        timed_as = list(self.setup.step_key.words)
        self._start(path, [*words, "--progress-json"], {"what": "train", "timed_as": timed_as})

    def compare(self) -> None:
        """Begin to compare the radar alone with synthetic data added; raises as :meth:`train`."""
        if self.why_not_compare:
            raise Sd2Error(self.why_not_compare)
        path = self._new_folder("comparison")
        words = self.setup.table_arguments(path / TABLE_NAME)
        self._start(path, [*words, "--progress-json"], {"what": "table"})

    def again(self) -> None:
        """Go on with a comparison that was stopped: what it has trained is kept."""
        run = self._run
        if run is None or run.under_way or not run.compares:
            return
        if self._busy_with:
            raise Sd2Error(self.why_not_compare)
        about = {"what": "table"}
        arguments = [str(word) for word in run.about.get("arguments", ())]
        self._start(run.path, arguments, about)

    def use_model(self) -> None:
        """Keep the model of the run in view among the classifiers, and classify with it.

        Raises Sd2Error or OSError if it cannot be read or kept.
        """
        run = self._run
        if run is None or run.result is None or run.compares:
            return
        kept = self._folder / f"{run.path.name}.safetensors"
        with atomic_write(kept) as stream:
            stream.write(run.result.read_bytes())
        self._use(kept)
        self._used = run.path
        self.changed.emit()

    def delete(self) -> None:
        """Delete the run in view, which has ended."""
        run = self._run
        if run is not None and not run.under_way:
            run.delete()
            self.select(None)
            self.refresh()

    def close(self) -> None:
        """Stop polling; a running process goes on."""
        self._timing.stop()
        self.setup.close()
        if self._run is not None:
            self._run.close()

    # --- starting and following -----------------------------------------------------------

    def _start(self, path: Path, arguments: list[str], about: dict[str, Any]) -> None:
        self.step_times.stop()
        process = CommandFolder(path).start(arguments, about, self._command)
        self.select(None)
        self._follow(ClassRun(path, self, process=process))
        self.refresh()

    def _follow(self, run: ClassRun) -> None:
        self._run = run
        run.changed.connect(self._tell)
        run.ended.connect(self._end)

    def _tell(self) -> None:
        live = self._run is not None and self._run.phase == "running"
        here = self._run.path if self._run is not None else None
        known = any(one.path == here and one.live for one in self._runs)
        if live and not known:
            self.refresh()  # it has begun
        else:
            self.changed.emit()

    def _end(self) -> None:
        run = self._run
        if run is None:
            return
        self._learn_step_time(run)
        self.refresh()
        if run.phase == "gone":
            self.select(None)
        elif not self._watched:
            name = run.path.name
            if run.phase == "finished":
                self.noted.emit(f"{name} is done. The Train panel shows what came of it.")
            elif run.phase in ("failed", "died"):
                self.failed.emit(f"{name} did not come to its end. The Train panel says more.")

    def _learn_step_time(self, run: ClassRun) -> None:
        """Store the measured time of a step as the estimate for the next training."""
        step_s, words = run.history.step_s, run.about.get("timed_as")
        if step_s is not None and isinstance(words, list):
            self.step_times.learn(StepKey(tuple(map(str, words))), step_s)

    def _new_folder(self, what: str) -> Path:
        """Free folder name made of the task, the data and the time."""
        data = "+".join(one.path.stem for one in self.setup.data)[:40]
        name = f"{what} {data} {time.strftime('%Y-%m-%d %H.%M')}"
        path, number = self._folder / "runs" / name, 2
        while path.exists():
            path, number = path.with_name(f"{name} {number}"), number + 1
        return path


def _title(folder: CommandFolder) -> str:
    about = folder.facts
    what = "Comparison" if about.get("what") == "table" else "Training"
    state = "under way" if folder.live else _STATES.get(folder.code, "failed")
    return f"{clock_text(about.get('started_unix_s', 0.0))} · {what} · {state}"


_STATES = {0: "finished", 130: "stopped", None: "not ended"}
