"""Training of denoisers, in processes that outlive the window."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

from PySide6.QtCore import QObject, QTimer, Signal

from sd2app.background.run_command import COMMAND, launch
from sd2app.background.step_times import COMMAND as TIMING_COMMAND
from sd2app.background.step_times import PatientTiming, StepKey, StepTimes
from sd2app.settings import Settings
from sd2app.training.command import (
    new_run_folder,
    quoted,
    resume_arguments,
    train_arguments,
)
from sd2app.training.library import TrainingLibrary, user_runs_folder
from sd2app.training.pair_maker import PairMaker
from sd2app.training.run import TrainingMonitor
from sd2app.training.setup import TrainingSetupModel
from sd2core.errors import Sd2Error
from sd2core.processes import ONE_THREAD
from sd2core.train.folder import TrainingFolder

Closing = Literal["ask", "keep", "stop"]

CLOSING: tuple[Closing, ...] = ("ask", "keep", "stop")
"""Choices for a run under way when the window is closed."""
_LIBRARY_MS = 3000


class TrainingModel(QObject):
    """One run in view, the others in a list; one that the window started at a time.

    ``command`` runs ``sd2`` commands, ``timing_command`` times a step. ``folder`` holds the
    runs; by default as the settings say, or in the user's data directory.
    """

    changed = Signal()
    phase_changed = Signal()  # phase of the run in view, or another run is in view
    noted = Signal(str)
    failed = Signal(str)

    def __init__(
        self,
        settings: Settings,
        parent: QObject | None = None,
        command: Sequence[str] = COMMAND,
        timing_command: Sequence[str] = TIMING_COMMAND,
        folder: Path | None = None,
    ) -> None:
        super().__init__(parent)
        self._settings = settings
        self._command = tuple(command)
        self.step_times = StepTimes(settings, self, timing_command)
        self.setup = TrainingSetupModel(settings, self.step_times, self)
        chosen = settings.stored("training/folder", "")
        self.library = TrainingLibrary(
            folder or (Path(chosen) if chosen else user_runs_folder()), self
        )
        self.pair_maker = PairMaker(self.library.folder.parent / "pairs", self, command)
        self.pair_maker.changed.connect(self.changed)
        self.pair_maker.made.connect(self.setup.add_store)
        self.pair_maker.failed.connect(self.failed)
        self._monitor: TrainingMonitor | None = None
        self._was_under_way = False
        self._looking_for_runs = False
        self._watched = False
        self._timer = QTimer(self)
        self._timer.setInterval(_LIBRARY_MS)
        self._timer.timeout.connect(self.library.refresh)
        self.library.changed.connect(self.changed)
        self.library.refreshed.connect(self._take_up)
        self.setup.changed.connect(self.changed)
        self._timing = PatientTiming(self.step_times, self._to_be_timed, self)
        self.setup.changed.connect(self._timing.wait)

    # --- what is known --------------------------------------------------------------------

    @property
    def run(self) -> TrainingMonitor | None:
        """The run in view; None while a new one is being set up."""
        return self._monitor

    @property
    def under_way(self) -> bool:
        """True while the run in view has a process."""
        return self._monitor is not None and self._monitor.loaded and self._monitor.under_way

    def to_be_left(self) -> TrainingMonitor | None:
        """The run that would go on when the window is closed, brought into view.

        Runs that were started from a terminal do not count here unless they are in view.
        """
        if not self.under_way:
            live = self.library.live
            if live is None or not TrainingFolder(live.path).output.exists():
                return None
            self.select(live.path)
        return self._monitor

    @property
    def mark(self) -> str:
        """Share of the run in view that is done, as text; empty when none is under way."""
        if not self.under_way or self._monitor is None:
            return ""
        share = self._monitor.history.share
        if self._monitor.phase == "paused":
            return "paused"
        return "…" if share is None else f"{100 * share:.0f} %"

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
        live = self.library.live
        path = self._monitor.path if self._monitor and self.under_way else None
        if live is not None or path is not None:
            return _busy_text(path or live.path)  # type: ignore[union-attr]
        return self.setup.problem

    @property
    def command(self) -> str:
        """Command for a terminal that does what is set up; Sd2Error if it cannot be started."""
        config = self.setup.config
        return quoted(train_arguments(config, Path(new_run_folder(Path(), config).name)))

    def set_watched(self, watched: bool) -> None:
        """Note that the panel is visible or hidden: steps are timed only while it is visible."""
        self._watched = watched
        if watched:
            self.setup.refresh()
            self.library.refresh()
        self._timing.look()

    def _to_be_timed(self) -> StepKey | None:
        wanted = self._watched and self._monitor is None and not self.why_not_start
        return self.setup.step_key if wanted else None

    # --- one run after another ------------------------------------------------------------

    def look_for_runs(self) -> None:
        """At the start of the program: find what is under way, or what was in view last."""
        self._looking_for_runs = True
        self.library.refresh()
        self._timer.start()

    def select(self, path: Path | None) -> None:
        """Show a run; None is a new one, to be set up."""
        if path is None:
            self._follow(None)
            self._settings.set_value("training/run", "")
        elif self._monitor is None or self._monitor.path != path:
            self._follow(TrainingMonitor(path, self))

    def open_run(self, path: Path) -> None:
        """Show a run of another folder; Sd2Error if there is none."""
        TrainingFolder(path).state()
        self.select(path)

    def start(self) -> None:
        """Begin as set up; Sd2Error if it cannot start, OSError if its folder cannot be made."""
        if self.why_not_start:
            raise Sd2Error(self.why_not_start)
        config = self.setup.config
        self.step_times.stop()
        self.library.folder.mkdir(parents=True, exist_ok=True)
        path = new_run_folder(self.library.folder, config)
        self._launch(path, train_arguments(config, path))

    def resume(self) -> None:
        """Go on with the run in view where it ended; raises what :meth:`start` does."""
        run = self._monitor
        if run is None or run.under_way:
            return
        # The folders are asked: what the library found may be over by now.
        for other in self.library.runs:
            if other.live and TrainingFolder(other.path).live:
                raise Sd2Error(_busy_text(other.path))
        self._launch(run.path, resume_arguments(run.path))

    def _launch(self, path: Path, arguments: list[str]) -> None:
        # What moves on the screen comes first: the training gets by with one processor.
        process = launch([*self._command, *arguments], TrainingFolder(path).output, ONE_THREAD)
        self._follow(TrainingMonitor(path, self, process=process))
        self.library.refresh()

    # --- steering -------------------------------------------------------------------------

    def pause(self) -> None:
        """Pause, which frees the processor but not the memory."""
        self._attempt(lambda run: run.tell("pause"))

    def go_on(self) -> None:
        """End the pause."""
        self._attempt(lambda run: run.tell("run"))

    def stop(self) -> None:
        """End it now, and keep the best model so far."""
        self._attempt(lambda run: run.tell("stop"))

    def cancel(self) -> None:
        """End it now, and delete what it made."""
        self._attempt(lambda run: run.tell("cancel"))

    def delete(self) -> None:
        """Delete the run in view, which has ended, with its model."""
        run = self._monitor
        if run is not None and not run.under_way:
            self._attempt(lambda run: run.delete())
            self.select(None)
            self.library.refresh()

    def close(self) -> None:
        """Stop polling; a running training goes on."""
        self._timer.stop()
        self._timing.stop()
        self.pair_maker.close()
        self.setup.close()
        self.library.close()
        if self._monitor is not None:
            self._monitor.close()

    def _attempt(self, work: Callable[[TrainingMonitor], None]) -> None:
        if self._monitor is not None:
            try:
                work(self._monitor)
            except (OSError, Sd2Error) as error:
                self.failed.emit(str(error))

    # --- following ------------------------------------------------------------------------

    def _follow(self, monitor: TrainingMonitor | None) -> None:
        if self._monitor is not None:
            self._monitor.close()
            self._monitor.deleteLater()
        self._monitor = monitor
        self._was_under_way = False
        if monitor is not None:
            self._settings.set_value("training/run", str(monitor.path))
            monitor.changed.connect(self._tell)
            monitor.phase_changed.connect(self._notice)
        self.phase_changed.emit()
        self.changed.emit()

    def _tell(self) -> None:
        run = self._monitor
        if run is not None and run.under_way and run.history.epoch_points:
            self._learn_step_time(run)
        self.changed.emit()

    def _notice(self) -> None:
        run = self._monitor
        if run is None:
            return
        if run.phase == "gone":
            # Cancelled: there is nothing to show any more.
            self.library.refresh()
            self.select(None)
            return
        ended = run.loaded and self._was_under_way and not run.under_way
        self._was_under_way = run.loaded and run.under_way
        self.library.refresh()
        self.phase_changed.emit()
        if ended:
            self._learn_step_time(run)
            self._say_ended(run)

    def _say_ended(self, run: TrainingMonitor) -> None:
        if self._watched:
            return  # it is seen
        name = run.path.name
        if run.phase == "finished":
            self.noted.emit(f"{name} is trained. The Train panel puts its model to use.")
        elif run.phase in ("failed", "died"):
            self.failed.emit(f"{name} could not be trained to its end. The Train panel says more.")

    def _learn_step_time(self, run: TrainingMonitor) -> None:
        """Store the measured time of a step as the estimate for the next run."""
        step_s, config = run.history.step_s, run.config
        if step_s is not None and config is not None:
            key = StepKey.of_denoiser(config.model.name, config.training.batch_size)
            self.step_times.learn(key, step_s)

    def _take_up(self) -> None:
        """Select the run under way, or the last in view, after the first search for runs."""
        if not self._looking_for_runs:
            return
        self._looking_for_runs = False
        live = self.library.live
        if live is not None:
            self.select(live.path)
            self.noted.emit(f"{live.path.name} is being trained. The Train panel shows it.")
            return
        last = self._settings.stored("training/run", "")
        # It may lie elsewhere.
        if last and TrainingFolder(Path(last)).exists:
            self.select(Path(last))


def _busy_text(path: Path) -> str:
    return f"{path.name} is being trained. Wait for it, or stop it."
