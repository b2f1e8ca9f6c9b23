"""Standard deviation of the cells of the synthetic map, computed once the map is complete."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QObject, Signal

from sd2app.accuracy.model import AccuracyModel
from sd2app.background.latest import LatestRunner
from sd2app.maps.model import SynthesisModel
from sd2app.session.document import DocumentModel
from sd2app.session.maps import MapModel
from sd2app.session.tasks import Job, TaskList
from sd2app.settings import Settings
from sd2core.maps import CellUncertainty, DopplerMap
from sd2core.progress import Cancelled

_SHOWN = "uncertain_cells"


class UncertaintyModel(QObject):
    """Follows the synthetic map while uncertain cells are shown; the choice is remembered.

    Another map has no uncertainty until its own is known: while the sensor moves none
    is shown.
    """

    changed = Signal()
    failed = Signal(str)

    def __init__(
        self,
        document: DocumentModel,
        synthesis: SynthesisModel,
        trade: AccuracyModel,
        track: MapModel,
        jobs: TaskList,
        settings: Settings,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._document = document
        self._synthesis = synthesis
        self._trade = trade
        self._track = track
        self._jobs = jobs
        self._settings = settings
        self._shown = settings.flag(_SHOWN, False)
        self._of: DopplerMap | None = None
        self._job: Job | None = None
        self._runner = LatestRunner("uncertainty", self)
        self._runner.partial.connect(self._report)
        self._runner.finished.connect(self._take)
        self._runner.failed.connect(self._fail)
        track.changed.connect(self._follow)
        synthesis.completed.connect(self._follow)
        trade.decided.connect(self._follow)
        document.opened.connect(self.changed)

    @property
    def shown(self) -> bool:
        """True while the user wants uncertain cells marked."""
        return self._shown

    @property
    def busy(self) -> bool:
        """True while it is being computed."""
        return self._job is not None

    @property
    def why_not(self) -> str:
        """Reason why it cannot be computed for this recording; empty where it can."""
        mesh = self._document.mesh
        if mesh is None:
            return "There is no mesh"
        if mesh.uncertainty is None:
            return (
                "This mesh does not say how well its velocities are known;"
                " one that is fitted to a video does (File → New from video…)"
            )
        return ""

    def set_shown(self, shown: bool) -> None:
        """Show uncertain cells or not, and remember it."""
        if shown == self._shown:
            return
        self._shown = shown
        self._settings.set_value(_SHOWN, shown)
        if not shown:
            self._stop()
            self._track.set_uncertainty(None)
        self._follow()
        self.changed.emit()

    def close(self) -> None:
        """Stop computing."""
        self._stop()
        self._runner.close()

    def _follow(self) -> None:
        """Compute for a finished map; stop if that map is gone."""
        made = self._track.map
        if self._job is not None and made is not self._of:
            self._stop()
        if not self._shown or self.why_not or self._job is not None or self._trade.choosing:
            return
        worker = self._synthesis.made_by()
        if worker is None or made is None or self._track.uncertainty is not None:
            return
        synthesizer, sensor = worker
        self._of = made
        self._job = self._jobs.start("Finding how well the map is known", self._cancel)
        self._runner.submit(
            lambda emit: synthesizer().uncertainty(
                sensor, progress=lambda done, total: emit((done, total))
            )
        )

    def _report(self, progress: tuple[int, int]) -> None:
        if self._job is not None:
            self._jobs.report(self._job, *progress)

    def _take(self, found: CellUncertainty) -> None:
        current = self._track.map is self._of
        self._end_job()
        if current and self._shown:
            self._track.set_uncertainty(found)

    def _fail(self, error: Any) -> None:
        self._end_job()
        if not isinstance(error, Cancelled):
            self.failed.emit(str(error))

    def _cancel(self) -> None:
        """Cancel on the user's request."""
        self._stop()
        self.set_shown(False)

    def _stop(self) -> None:
        self._runner.cancel()
        self._end_job()

    def _end_job(self) -> None:
        if self._job is not None:
            job, self._job, self._of = self._job, None, None
            self._jobs.finish(job)
