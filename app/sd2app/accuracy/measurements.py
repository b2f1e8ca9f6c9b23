"""Measured error and cost of every sensible plan on the open recording."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

from PySide6.QtCore import QObject, Signal

from sd2app.accuracy.ladder import Ladder
from sd2app.background.latest import Emit, LatestRunner
from sd2app.session.tasks import Job, TaskList
from sd2core.doppler.options import SynthesisOptions
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import VirtualSensor

if TYPE_CHECKING:
    from sd2core.accuracy.plans import Family
    from sd2core.accuracy.results import Measurement, PlanResult

FAMILIES: tuple[Family, ...] = ("histogram", "fmcw")


class MeasuredModel(QObject):
    """Measures when asked, and remembers per scene and machine; one measurement per family.

    ``changed`` is emitted for anything that is shown, ``failed`` with a sentence
    for the user.
    """

    changed = Signal()
    failed = Signal(str)

    def __init__(self, jobs: TaskList, ladder: Ladder, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._jobs = jobs
        self._ladder = ladder
        self._family: Family = "histogram"
        self._scene: tuple[MeshSequence, SynthesisOptions] | None = None
        self._place: VirtualSensor | None = None
        self._known: dict[Family, Measurement] = {}
        self._job: Job | None = None
        self._meter = LatestRunner("measure", self)
        self._meter.partial.connect(self._report)
        self._meter.finished.connect(self._receive)
        self._meter.failed.connect(self._fail)
        self._memory = LatestRunner("remember", self)
        self._memory.finished.connect(self._receive_remembered)
        self._memory.failed.connect(lambda error: self.failed.emit(str(error)))

    # --- what is known --------------------------------------------------------------------

    @property
    def family(self) -> Family:
        """Family of plans that is shown."""
        return self._family

    @property
    def measurement(self) -> Measurement | None:
        """Measurement of the family on screen."""
        return self._known.get(self._family)

    @property
    def counting(self) -> Measurement | None:
        """Measurement of the plans that the window can apply."""
        return self._known.get("histogram")

    @property
    def job(self) -> Job | None:
        """The measurement under way."""
        return self._job

    @property
    def can_measure(self) -> bool:
        """True if the sensor is at rest and no measurement is running."""
        return self._scene is not None and self._place is not None and self._job is None

    # --- requests -------------------------------------------------------------------------

    def take_over(self, mesh: MeshSequence | None, options: SynthesisOptions) -> None:
        """Take over another scene, or none."""
        self._meter.cancel()
        self._memory.cancel()
        self._end_job()
        self._scene = None if mesh is None else (mesh, options)
        self._place = None
        self._known = {}
        self.changed.emit()

    def rest_at(self, sensor: VirtualSensor) -> None:
        """Read the stored measurement for this sensor, once per place."""
        if self._scene is None or sensor == self._place:
            return
        self._place = sensor
        mesh, options = self._scene
        self._known = {
            family: replace(measurement, stale=True) for family, measurement in self._known.items()
        }
        remembered = self._ladder.remembered
        self._memory.submit(
            lambda emit: [remembered(mesh, sensor, options, family) for family in FAMILIES]
        )
        self.changed.emit()

    def set_family(self, family: Family) -> None:
        """Show the plans of another family."""
        if family != self._family:
            self._family = family
            self.changed.emit()

    def measure(self) -> None:
        """Measure every sensible plan of the family on this scene."""
        if self._scene is None or self._place is None or self._job is not None:
            return
        mesh, options = self._scene
        sensor, family, ladder = self._place, self._family, self._ladder

        def work(emit: Emit) -> tuple[Measurement, VirtualSensor]:
            measurement = ladder.measure(
                mesh,
                sensor,
                options=options,
                family=family,
                progress=lambda done, total: emit((done, total)),
            )
            ladder.remember(mesh, measurement)
            return measurement, sensor

        self._job = self._jobs.start("Measuring this scene", self.cancel)
        self._meter.submit(work)
        self.changed.emit()

    def cancel(self) -> None:
        """Stop measuring; what was known stays."""
        self._meter.cancel()
        self._end_job()
        self.changed.emit()

    def close(self) -> None:
        """Stop every thread."""
        self._meter.close()
        self._memory.close()
        self._end_job()

    # --- results --------------------------------------------------------------------------

    def _report(self, progress: Any) -> None:
        if self._job is not None:
            self._jobs.report(self._job, *progress)
            self.changed.emit()

    def _receive(self, answer: Any) -> None:
        self._end_job()
        measurement, place = cast("tuple[Measurement, VirtualSensor]", answer)
        elsewhere = place != self._place
        self._known[measurement.family] = replace(measurement, stale=measurement.stale or elsewhere)
        self.changed.emit()

    def _receive_remembered(self, found: list[Measurement | None]) -> None:
        self._known |= {known.family: known for known in found if known is not None}
        self.changed.emit()

    def _fail(self, error: Exception) -> None:
        self._end_job()
        self.failed.emit(str(error))
        self.changed.emit()

    def _end_job(self) -> None:
        if self._job is not None:
            self._jobs.finish(self._job)
            self._job = None


def serves_at_rest(result: PlanResult) -> bool:
    """True if a plan suits a sensor at rest; reused masks are for a sensor that moves."""
    return result.plan.mask_reuse_m == 0


def front_at_rest(measurement: Measurement) -> tuple[PlanResult, ...]:
    """The Pareto front of the plans that serve at rest, cheapest first."""
    resting = tuple(result for result in measurement.results if serves_at_rest(result))
    return replace(measurement, results=resting).front
