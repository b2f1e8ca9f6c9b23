"""Measured error and cost of every sensible plan on the open recording, also in words."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import Emit, LatestRunner, ReportingModel
from sd2app.session.tasks import Job, ListedRunner, TaskList
from sd2app.widgets.text import milliseconds, seconds
from sd2core.doppler.options import SynthesisOptions
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.map_accuracy import MapAccuracy, percent
from sd2core.sensor import VirtualSensor

if TYPE_CHECKING:
    from sd2core.accuracy.plans import AccuracyPlan, Family
    from sd2core.accuracy.results import Measurement, PlanResult


Library = Callable[[], Any]
"""Gives the functions of :mod:`sd2core.accuracy`, which tests replace."""


def core_accuracy() -> Any:
    """Functions of the library; called in the background, as they take a second to load."""
    from sd2core import accuracy

    return accuracy


FAMILIES: tuple[Family, ...] = ("histogram", "fmcw")


class MeasuredModel(ReportingModel):
    """Measures when asked, and remembers per scene and machine; one measurement per family.

    ``changed`` is emitted for anything that is shown, ``failed`` with a sentence
    for the user.
    """

    changed = Signal()

    def __init__(self, jobs: TaskList, library: Library, parent: QObject) -> None:
        super().__init__(parent)
        self._library = library
        self.family: Family = "histogram"  # of the plans that are shown
        self._scene: tuple[MeshSequence, SynthesisOptions] | None = None
        self._place: VirtualSensor | None = None
        self._known: dict[Family, Measurement] = {}
        self._meter = ListedRunner("measure", jobs, self, self._receive, self._fail)
        for signal in (self._meter.partial, self._meter.idle_changed):
            signal.connect(self.changed)
        self._memory = LatestRunner("remember", self, self._receive_remembered, self._fail)

    @property
    def measurement(self) -> Measurement | None:
        """Measurement of the family on screen."""
        return self._known.get(self.family)

    @property
    def counting(self) -> Measurement | None:
        """Measurement of the plans that the window can apply."""
        return self._known.get("histogram")

    @property
    def job(self) -> Job | None:
        """The measurement under way."""
        return self._meter.job

    @property
    def can_measure(self) -> bool:
        """True if the sensor is at rest and no measurement is running."""
        return self._scene is not None and self._place is not None and not self._meter.busy

    def attach(self, mesh: MeshSequence | None, options: SynthesisOptions) -> None:
        """Take over another scene, or none."""
        self._meter.cancel()
        self._memory.cancel()
        self._scene = None if mesh is None else (mesh, options)
        self._place = None
        self._known = {}
        self.changed.emit()

    def rest_at(self, sensor: VirtualSensor) -> None:
        """Read the stored measurement for this sensor, once per place."""
        if self._scene is None or sensor == self._place:
            return
        first, self._place = self._place is None, sensor
        mesh, options = self._scene
        self._known = {
            family: replace(measurement, stale=True) for family, measurement in self._known.items()
        }
        library = self._library
        self._memory.submit(
            lambda emit: [
                library().cached_measurement(mesh, sensor, options, family) for family in FAMILIES
            ]
        )
        if first or self._known:  # what is known is stale now
            self.changed.emit()

    def set_family(self, family: Family) -> None:
        """Show the plans of another family."""
        if family != self.family:
            self.family = family
            self.changed.emit()

    def measure(self) -> None:
        """Measure every sensible plan of the family on this scene."""
        if self._scene is None or self._place is None or self._meter.busy:
            return
        mesh, options = self._scene
        sensor, family, library = self._place, self.family, self._library

        def work(emit: Emit) -> tuple[Measurement, VirtualSensor]:
            measurement = library().measure(
                mesh,
                sensor,
                options=options,
                family=family,
                memory=False,  # the window's other threads work
                progress=lambda done, total: emit((done, total)),
            )
            library().store_measurement(mesh, measurement)
            return measurement, sensor

        self._meter.submit(work, "Measuring this scene")

    def cancel(self) -> None:
        """Stop measuring; what was known stays."""
        self._meter.cancel()

    def _receive(self, answer: tuple[Measurement, VirtualSensor]) -> None:
        measurement, place = answer
        elsewhere = place != self._place
        self._known[measurement.family] = replace(measurement, stale=measurement.stale or elsewhere)
        self.changed.emit()

    def _receive_remembered(self, measurements: list[Measurement | None]) -> None:
        stored = {known.family: known for known in measurements if known is not None}
        self._known |= stored
        if stored:
            self.changed.emit()


def serves_at_rest(result: PlanResult) -> bool:
    """True if a plan suits a sensor at rest; reused masks are for a sensor that moves."""
    return result.plan.mask_reuse_m == 0


def cheapest_within(measurement: Measurement, tolerance: float) -> PlanResult | None:
    """The cheapest plan for a sensor at rest whose measured error is within a tolerance."""
    holding = (one for one in front_at_rest(measurement) if one.errors.l1 <= tolerance)
    return next(holding, None)


def front_at_rest(measurement: Measurement) -> tuple[PlanResult, ...]:
    """The Pareto front of the plans that serve at rest, cheapest first."""
    resting = tuple(result for result in measurement.results if serves_at_rest(result))
    return replace(measurement, results=resting).front


@dataclass(frozen=True)
class InUse:
    """Plan in use with its error and cost."""

    plan: AccuracyPlan
    error: float  # relative L1 after smoothing, as measured on this scene
    cost_ms: float  # per frame, on all cores
    clicked: bool = False  # a point of the plot, not chosen by tolerance or budget
    elsewhere: bool = False  # measured with the sensor at another place
    body: float | None = None  # likewise, of a fitted body; None: its mesh states none
    pending: bool = False  # the body's is of another place, until it is found for this one

    @property
    def accuracy(self) -> str:
        """How far the map may be from the truth."""
        return f"{MapAccuracy(self.body, self.error)}{'…' if self.pending else ''}"

    def __str__(self) -> str:
        text = f"{self.plan} · {self.accuracy} · {milliseconds(self.cost_ms)}/frame"
        return f"{text} (measured elsewhere)" if self.elsewhere else text


def chosen_sentence(in_use: InUse, frames: int) -> str:
    """One sentence of the plan in use: its error, and its cost per frame and for the clip."""
    way = "Clicked" if in_use.clicked else "Chosen"
    body = "" if in_use.body is None else f" – {in_use.accuracy} with the body –"
    return (
        f"{way}: {short(in_use.plan)}, whose map is {percent(in_use.error)} off the reference{body}"
        f" and costs {milliseconds(in_use.cost_ms)} per frame,"
        f" {seconds(1e-3 * in_use.cost_ms * frames)} for the clip."
    )


def legend(measurement: Measurement, tolerance: float, *, in_use: bool) -> str:
    """Signs of the plot and what they stand for, as far as they are there."""
    counting = measurement.family == "histogram"
    signs = []
    if in_use:
        signs.append("◉ chosen" if counting else "◉ in use")
    if counting:
        if cheapest_within(measurement, tolerance) is not None:
            signs.append("◇ cheapest measured within the tolerance")
        if not all(map(serves_at_rest, measurement.results)):
            signs.append("○ only while dragging")
    return "   ".join(sign.replace(" ", "\N{NO-BREAK SPACE}") for sign in signs)


def short(plan: AccuracyPlan) -> str:
    """Short description of a plan: visibility, masks, geometry, time."""
    sight = plan.visibility
    words = [f"visibility {sight}"]
    if sight in ("depth", "none"):
        words = [f"depth {plan.depth_resolution}" if sight == "depth" else "all vertices"]
    if plan.mask_stride > 1:
        words.append(f"mask every {plan.mask_stride} frames")
    if plan.vertices_kept < 1:
        words.append(f"{percent(plan.vertices_kept)} of the vertices")
    if plan.frame_rate_factor > 1:
        words.append(f"frame rate × {plan.frame_rate_factor}")
    if plan.left_out:
        words.append(f"without {', '.join(plan.left_out)}")
    return " · ".join(words)


def point_text(result: PlanResult) -> str:
    """Plan, errors and cost of a point of the plot, one fact a line."""
    errors, cost = result.errors, result.cost
    memory = "" if cost.peak_bytes is None else f"{cost.peak_bytes / 2**20:.0f} MiB at most, "
    return "\n".join(
        (
            str(result.plan),
            f"Error {percent(errors.l1)} after smoothing, {percent(errors.l1_raw)} before",
            f"Peak velocity off by {errors.peak_mps.median:.2g} m/s"
            f" (95 % of frames within {errors.peak_mps.p95:.2g} m/s)",
            f"{percent(errors.wrong_bins.median)} of the energy in wrong bins",
            f"{milliseconds(cost.all_cores_ms.median)} per frame on all cores,"
            f" {milliseconds(cost.one_thread_ms.median)} on one thread",
            f"{memory}{seconds(cost.setup_s)} once per clip",
        )
    )
