"""Batches: set up, started in a process that outlives the window, followed, opened."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import LatestRunner
from sd2app.background.run_command import COMMAND, launch
from sd2app.batch.results import BatchResults
from sd2app.batch.run import BatchMonitor, plan_of
from sd2app.batch.setup import BatchSetupModel
from sd2app.settings import Settings
from sd2app.widgets.text import counted
from sd2core.batch.estimate import BatchEstimate, estimate
from sd2core.batch.folder import BatchFolder
from sd2core.batch.plan import BatchPlan
from sd2core.batch.plan_file import write_plan
from sd2core.errors import Sd2Error


class BatchModel(QObject):
    """One batch in view, or a new one that is being set up.

    ``command`` is the program that runs ``sd2`` commands. ``estimate`` is that of the set-up,
    None until it has been asked for and computed.
    """

    changed = Signal()
    phase_changed = Signal()  # phase of the batch in view, or another batch is in view
    noted = Signal(str)
    failed = Signal(str)

    def __init__(
        self,
        settings: Settings,
        parent: QObject | None = None,
        command: Sequence[str] = COMMAND,
    ) -> None:
        super().__init__(parent)
        self._settings = settings
        self._command = tuple(command)
        self.setup = BatchSetupModel(settings, self)
        self.results = BatchResults(self)
        self.estimate: BatchEstimate | None = None
        self._asked: tuple[BatchPlan, int] | None = None
        self._refusal = ""
        self._estimating = LatestRunner("estimate", self)
        self._estimating.finished.connect(self._take_estimate)
        self._estimating.failed.connect(self._refuse_estimate)
        self._monitor: BatchMonitor | None = None
        self._was_under_way = self._taking_up = self._watched = False
        for signal in (self.setup.changed, self.results.changed):
            signal.connect(self.changed)

    # --- what is known --------------------------------------------------------------------

    @property
    def batch(self) -> BatchMonitor | None:
        """The batch in view; None while a new one is being set up."""
        return self._monitor

    @property
    def why_not_start(self) -> str:
        """Reason why the set-up cannot be started; empty when it can."""
        setup = self.setup
        if setup.problem:
            return setup.problem
        if self._asked != (setup.plan(), setup.workers):
            return "Its tasks have not been counted yet."
        if self._estimating.busy:
            return "Working out what it would do…"
        return self._refusal

    @property
    def refused(self) -> bool:
        """True if what is set up cannot be done."""
        return bool(self._refusal) and self.why_not_start == self._refusal

    def set_watched(self, watched: bool) -> None:
        """Note that the batch is visible or hidden."""
        self._watched = watched

    # --- one batch after another ----------------------------------------------------------

    def look_for_batch(self) -> None:
        """At the start of the program: find the last one, which may be under way."""
        last = self._settings.stored("batch/last", "")
        if last and BatchFolder(Path(last)).exists:  # it may lie elsewhere
            self._taking_up = True
            self.select(Path(last))

    def select(self, path: Path | None) -> None:
        """Show a batch; None is a new one, to be set up."""
        if path is None:
            self._follow(None)
            self._settings.set_value("batch/last", "")
        elif self._monitor is None or self._monitor.path != path:
            self._follow(BatchMonitor(path, self))

    def open_batch(self, path: Path) -> None:
        """Show a batch of another folder, such as a terminal's; Sd2Error if there is none."""
        BatchFolder(path).about()
        self.select(path)

    def ask_estimate(self) -> None:
        """Compute the estimate for the set-up, unless it is known."""
        if self.setup.problem:
            return
        asked = self.setup.plan(), self.setup.workers
        if asked != self._asked:
            self._forget_estimate()
            self._asked = asked
            self._estimating.submit(lambda emit: estimate(*asked, lambda done, of: emit(None)))
            self.changed.emit()

    def start(self) -> None:
        """Begin as set up; Sd2Error if it cannot start, OSError if its plan cannot be written."""
        if self.why_not_start:
            raise Sd2Error(self.why_not_start)
        plan = self.setup.plan()
        out = Path(plan.out)
        if BatchFolder(out).live:
            raise Sd2Error(f"A process is at work in {out} already", "one batch at a time there")
        file = plan_of(out)  # beside its folder, which may not be there yet
        write_plan(file, plan)
        self._launch(out, file)

    def resume(self) -> None:
        """Continue the batch in view, or raise Sd2Error."""
        run = self._monitor
        if run is not None and run.resumable:
            self._launch(run.path, run.folder.plan)

    def stop(self) -> None:
        """End the batch in view; what is done stays, and it can go on later."""
        if self._monitor is not None:
            try:
                self._monitor.stop()
            except OSError as error:
                self.failed.emit(str(error))

    def close(self) -> None:
        """Stop polling; a running batch goes on."""
        self._estimating.close()
        self.setup.close()
        self.results.close()
        if self._monitor is not None:
            self._monitor.close()

    def _launch(self, out: Path, plan: Path) -> None:
        output = BatchFolder(out).output
        # What an earlier start said is not about this one.
        output.unlink(missing_ok=True)
        words = ["batch", str(plan), "--workers", str(self.setup.workers)]
        process = launch([*self._command, *words], output)
        self._forget_estimate()  # of what is about to be done
        self._follow(BatchMonitor(out, self, process=process))

    # --- the estimate ---------------------------------------------------------------------

    def _forget_estimate(self) -> None:
        self._estimating.cancel()
        self._asked, self.estimate, self._refusal = None, None, ""

    def _take_estimate(self, found: BatchEstimate) -> None:
        self.estimate = found
        self.changed.emit()

    def _refuse_estimate(self, error: Exception) -> None:
        self._refusal = str(error)
        self.changed.emit()

    # --- following ------------------------------------------------------------------------

    def _follow(self, monitor: BatchMonitor | None) -> None:
        if self._monitor is not None:
            self._monitor.close()
            self._monitor.deleteLater()
        self._monitor = monitor
        self._was_under_way = False
        self.results.forget()
        if monitor is not None:
            self._settings.set_value("batch/last", str(monitor.path))
            monitor.changed.connect(self.changed)
            monitor.phase_changed.connect(self._notice)
        self.phase_changed.emit()
        self.changed.emit()

    def _notice(self) -> None:
        run = self._monitor
        if run is None:
            return
        if run.phase == "gone":
            self.select(None)
            return
        ended = run.loaded and self._was_under_way and not run.under_way
        taken_up, self._taking_up = self._taking_up and run.loaded, False
        self._was_under_way = run.loaded and run.under_way
        if run.loaded and not run.under_way:
            self.results.read(run.folder)
        self.phase_changed.emit()
        name = run.path.name
        if taken_up and run.under_way:
            self.noted.emit(f"{name} is at work. File → Batch… shows it.")
        elif ended and not self._watched:
            self._say_ended(name, run)

    def _say_ended(self, name: str, run: BatchMonitor) -> None:
        if run.phase in ("failed", "died"):
            self.failed.emit(f"{name} did not come to its end. File → Batch… says more.")
        elif run.phase == "finished":
            failed = run.status.failed if run.status is not None else 0
            but = f", but {counted(failed, 'task')} could not be done" if failed else ""
            self.noted.emit(f"{name} has come to its end{but}. File → Batch… opens results.")
