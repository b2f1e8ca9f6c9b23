"""Getting ready for the next drag while the sensor rests."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import Emit, LatestRunner
from sd2app.maps.partial_map import View
from sd2app.maps.synthesizers import Carriers
from sd2core.sensor import VirtualSensor

if TYPE_CHECKING:
    from sd2core.accuracy.plans import AccuracyPlan


class Readier(QObject):
    """Prepares the mesh of the plan for dragging, and its masks from where the sensor rests."""

    failed = Signal(str)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._ready_at: VirtualSensor | None = None
        self._runner = LatestRunner("ready", self)
        self._runner.finished.connect(self._note)
        self._runner.failed.connect(lambda error: self.failed.emit(str(error)))

    @property
    def ready_at(self) -> VirtualSensor | None:
        """Where masks for dragging were made."""
        return self._ready_at

    def make_ready(
        self, carriers: Carriers, plan: AccuracyPlan, sensor: VirtualSensor, frames: View
    ) -> None:
        """Carry a plan out once, for frames that will follow a hand."""

        def work(emit: Emit) -> VirtualSensor:
            carrier = carriers.of(plan)
            carrier.stretch(sensor, *frames, progress=lambda *_: emit(None))
            return sensor

        self._runner.submit(work)

    def forget(self) -> None:
        """What was made ready is for another plan or mesh."""
        self._runner.cancel()
        self._ready_at = None

    def cancel(self) -> None:
        """Stop: the machine is needed for something else."""
        self._runner.cancel()

    def close(self) -> None:
        """Stop the thread."""
        self._runner.close()

    def _note(self, sensor: VirtualSensor) -> None:
        self._ready_at = sensor
