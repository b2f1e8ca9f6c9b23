"""How well the synthetic map is known, in all and by cell, found once the map is complete."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal

from sd2app.accuracy.model import AccuracyModel
from sd2app.background.latest import Emit, ReportingModel
from sd2app.maps.model import SynthesisModel
from sd2app.session.session import Session
from sd2app.session.tasks import ListedRunner
from sd2core.doppler.body_error import body_error
from sd2core.maps import CellUncertainty, DopplerMap

_SHOWN = "uncertain_cells"
_LARGE_ERROR = 0.2
"""Body's share of the map's error from which cells are marked unless the user chose otherwise."""


class UncertaintyModel(ReportingModel):
    """Follows the synthetic map of a mesh that states its uncertainty.

    The body's share of the accuracy is found for every finished map, and stays as pending while
    the sensor moves. The cells' uncertainty is found while it is shown: where the body's share is
    large, or as the user chose, which is remembered. Another map has none until its own is known.
    """

    changed = Signal()

    def __init__(
        self, session: Session, synthesis: SynthesisModel, accuracy: AccuracyModel, parent: QObject
    ) -> None:
        super().__init__(parent)
        self._session, self._synthesis, self._accuracy = session, synthesis, accuracy
        self._track = session.maps.synthetic
        self._chosen = session.settings.choice(_SHOWN)  # by the user; None: as the body needs it
        self._large = False  # the body's share of the error
        self._of: DopplerMap | None = None  # what the body's share is of
        self._runner = ListedRunner("uncertainty", session.jobs, self, self._take, self._fail)
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

    @property
    def shown(self) -> bool:
        """True while uncertain cells are marked."""
        return self._large if self._chosen is None else self._chosen

    def set_shown(self, shown: bool) -> None:
        """Show uncertain cells or not, and remember it."""
        if shown == self.shown:
            return
        self._chosen = shown
        self._session.settings.set_value(_SHOWN, shown)
        if not shown:
            if self.busy:
                self._of = None
            self._runner.cancel()
            self._track.set_uncertainty(None)
        self._follow()
        self.changed.emit()

    def _follow(self) -> None:
        """Compute for a finished map, the body's share first; stop if that map is gone."""
        made = self._track.map
        if self.why_not:
            self._runner.cancel()
            return
        if made is not self._of:
            self._runner.cancel()
            self._accuracy.await_body()
        worker = self._synthesis.made_by()
        if worker is None or made is None or self.busy or self._accuracy.choosing:
            return
        synthesizer, sensor = worker

        def of_body(emit: Emit) -> float | None:
            return body_error(synthesizer(), sensor, progress=lambda *_: emit(None))

        def of_cells(emit: Emit) -> CellUncertainty:
            return synthesizer().uncertainty(sensor, progress=lambda *now: emit(now))

        if made is not self._of:
            self._of = made
            self._runner.submit(of_body)
        elif self.shown and self._track.uncertainty is None:
            self._runner.submit(of_cells, "Finding how well the map is known")

    def _take(self, uncertainty: CellUncertainty | float | None) -> None:
        if isinstance(uncertainty, CellUncertainty):
            self._track.set_uncertainty(uncertainty)
        else:
            self._accuracy.set_body(uncertainty)
            self._large = uncertainty is not None and uncertainty >= _LARGE_ERROR
            self._follow()
            self.changed.emit()
