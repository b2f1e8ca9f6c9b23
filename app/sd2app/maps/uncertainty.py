"""Standard deviation of the cells of the synthetic map, computed once the map is complete."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal

from sd2app.accuracy.model import AccuracyModel
from sd2app.background.latest import BackgroundModel
from sd2app.maps.model import SynthesisModel
from sd2app.session.session import Session
from sd2app.session.tasks import ListedRunner
from sd2core.maps import CellUncertainty, DopplerMap

_SHOWN = "uncertain_cells"


class UncertaintyModel(BackgroundModel):
    """Follows the synthetic map while uncertain cells are shown; the choice is remembered.

    Another map has no uncertainty until its own is known: while the sensor moves none
    is shown.
    """

    changed = Signal()
    failed = Signal(str)

    def __init__(
        self, session: Session, synthesis: SynthesisModel, accuracy: AccuracyModel, parent: QObject
    ) -> None:
        super().__init__(parent)
        self._session, self._synthesis, self._accuracy = session, synthesis, accuracy
        self._track = session.maps.synthetic
        self.shown = session.settings.flag(_SHOWN, False)  # the user wants uncertain cells marked
        self._of: DopplerMap | None = None
        self._runner = ListedRunner("uncertainty", session.jobs, self, self._take)
        self._runner.failed.connect(lambda error: self.failed.emit(str(error)))
        self._runner.cancelled.connect(lambda: self.set_shown(False))
        self._track.changed.connect(self._follow)
        synthesis.completed.connect(self._follow)
        accuracy.decided.connect(self._follow)
        session.document.opened.connect(self.changed)

    @property
    def why_not(self) -> str:
        """Reason why it cannot be computed for this recording; empty where it can."""
        mesh = self._session.document.mesh
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
        if shown == self.shown:
            return
        self.shown = shown
        self._session.settings.set_value(_SHOWN, shown)
        if not shown:
            self._runner.cancel()
            self._track.set_uncertainty(None)
        self._follow()
        self.changed.emit()

    def _follow(self) -> None:
        """Compute for a finished map; stop if that map is gone."""
        made = self._track.map
        if self.busy and made is not self._of:
            self._runner.cancel()
        if not self.shown or self.why_not or self.busy or self._accuracy.choosing:
            return
        worker = self._synthesis.made_by()
        if worker is None or made is None or self._track.uncertainty is not None:
            return
        synthesizer, sensor = worker
        self._of = made
        self._runner.submit(
            lambda emit: synthesizer().uncertainty(
                sensor, progress=lambda done, total: emit((done, total))
            ),
            "Finding how well the map is known",
        )

    def _take(self, found: CellUncertainty) -> None:
        if self._track.map is self._of and self.shown:
            self._track.set_uncertainty(found)
