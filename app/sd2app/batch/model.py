"""Batches: set up, started in a process that outlives the window, followed, opened."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject

from sd2app.background.latest import LatestRunner
from sd2app.background.runs import Runs
from sd2app.batch.run import BatchMonitor, BatchResults, plan_of
from sd2app.batch.setup import BatchSetupModel
from sd2app.settings import Settings
from sd2app.widgets.text import counted
from sd2core.batch.folder import BatchFolder
from sd2core.cli.batch import Batch
from sd2core.errors import Sd2Error
from sd2core.options.records import words_of
from sd2core.progress import Progress
from sd2core.runs.command_folder import COMMAND, launch

if TYPE_CHECKING:
    # Imported where it is used: it takes long to load, and the window starts without.
    from sd2core.batch.estimate import BatchEstimate
    from sd2core.batch.plan import BatchPlan


class BatchModel(Runs[BatchMonitor]):
    """One batch in view, or a new one that is being set up.

    ``command`` is the program that runs ``sd2`` commands. ``estimate`` is that of the set-up,
    None until it has been asked for and computed.
    """

    monitor, remembered = BatchMonitor, "batch/last"
    shown_by = "File → Batch…"

    def __init__(
        self, settings: Settings, parent: QObject, command: Sequence[str] = COMMAND
    ) -> None:
        self._last = settings.stored(self.remembered, "")
        super().__init__(settings, Path(self._last), parent, command)
        self.setup = BatchSetupModel(settings, self)
        self.results = BatchResults(self)
        self.estimate: BatchEstimate | None = None
        self._asked: tuple[BatchPlan, int] | None = None
        self._refusal = ""
        take, refuse = self._take_estimate, self._refuse_estimate
        self._estimating = LatestRunner("estimate", self, take, refuse)
        self.setup.changed.connect(self.changed)
        self.results.changed.connect(self.changed)
        self.changed.connect(self._estimate_if_seen)

    # --- the set-up -------------------------------------------------------------------------

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

    def _estimate_if_seen(self) -> None:
        if self._watched and self.run is None:
            self.ask_estimate()

    def ask_estimate(self) -> None:
        """Compute the estimate for the set-up, unless it is known."""
        if self.setup.problem:
            return
        asked = self.setup.plan(), self.setup.workers
        if asked != self._asked:
            self._forget_estimate()
            self._asked = asked
            self._estimating.submit(lambda emit: _estimate(*asked, lambda done, of: emit(None)))
            self.changed.emit()

    def _forget_estimate(self) -> None:
        self._estimating.cancel()
        self._asked, self.estimate, self._refusal = None, None, ""

    def _take_estimate(self, estimate: BatchEstimate) -> None:
        self.estimate = estimate
        self.changed.emit()

    def _refuse_estimate(self, error: Exception) -> None:
        self._refusal = str(error)
        self.changed.emit()

    # --- one batch after another ------------------------------------------------------------

    def candidates(self) -> Iterable[Path]:
        """Folder of the last batch, which may lie anywhere."""
        return (Path(self._last),) if self._last else ()

    @property
    def replaces(self) -> bool:
        """True if the folder of the results holds those of other recordings, which would go."""
        from sd2core.batch.plan_file import read_plan

        plan = self.setup.plan()
        folder = BatchFolder(Path(plan.out))
        try:
            before = read_plan(folder.plan).recordings.files if folder.exists else ()
        except (Sd2Error, OSError):
            return False
        return not {*before} <= {*plan.recordings.files}

    def start(self) -> None:
        """Begin as set up; Sd2Error if it cannot start, OSError if its plan cannot be written."""
        from sd2core.batch.plan_file import write_plan

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
        if self.run is not None and self.run.resumable:
            self._launch(self.run.path, self.run.folder.plan)

    def _launch(self, out: Path, plan: Path) -> None:
        output = BatchFolder(out).output
        # What an earlier start said is not about this one.
        output.unlink(missing_ok=True)
        self._forget_estimate()  # of what is about to be done
        self.follow_new(out, launch([*self._command, *self.words(plan)], output))

    def words(self, plan: Path) -> list[str]:
        """Words of ``sd2`` that work on a plan."""
        return words_of("batch", Batch(plan=plan, workers=self.setup.workers))

    # --- following --------------------------------------------------------------------------

    def follow(self, run: BatchMonitor | None, under_way: bool = False) -> None:
        """Show a batch; its results are read whenever it is found at rest."""
        self.results.forget()
        super().follow(run, under_way)
        if run is not None:
            self._last = str(run.path)  # it is listed once another is in view
            run.phase_changed.connect(self._read_results)

    def _read_results(self) -> None:
        run = self.run
        if run is not None and run.loaded and not run.under_way:
            self.results.read(run.folder)

    def say_ended(self, run: BatchMonitor) -> None:
        """Tell the user how many tasks of a batch could not be done."""
        failed = run.history.failed
        if run.phase == "finished" and failed:
            but = f"has come to its end, but {counted(failed, 'task')} could not be done"
            self.noted.emit(f"{run.path.name} {but}. File → Batch… opens results.")
        else:
            super().say_ended(run)


def _estimate(plan: BatchPlan, workers: int, progress: Progress) -> BatchEstimate:
    from sd2core.batch.estimate import estimate

    return estimate(plan, workers, progress)
