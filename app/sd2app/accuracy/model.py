"""The accuracy of the map: a tolerance, and the plan that holds it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from PySide6.QtCore import QObject, Signal

from sd2app.accuracy.measurements import (
    InUse,
    Library,
    MeasuredModel,
    cheapest_within,
    serves_at_rest,
)
from sd2app.background.latest import Emit, ReportingModel
from sd2app.session.tasks import ListedRunner, TaskList
from sd2app.settings import Settings
from sd2core.doppler.options import SynthesisOptions
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import VirtualSensor

if TYPE_CHECKING:
    from sd2core.accuracy.plans import AccuracyPlan
    from sd2core.accuracy.results import Choice, PlanResult
    from sd2core.accuracy.survey import Survey

PRESETS = (0.005, 0.01, 0.02, 0.05, 0.1)
"""Offered tolerances."""


class _Request(NamedTuple):
    """Request for a plan; without a tolerance the clicked plan stays in use at rest."""

    tolerance: float | None
    budget_ms: float
    sensor: VirtualSensor


class AccuracyModel(ReportingModel):
    """Chooses a plan for the open scene in the background; the newest request wins.

    At rest the tolerance rules, unless the user clicked a point: then that plan
    stays until the tolerance is set again. While the sensor is dragged a budget
    rules.
    """

    plan_changed = Signal()  # the plan at rest or that for dragging, also when it becomes known
    decided = Signal()  # a choice ended: the same plan, another one, or an error
    requested = Signal()  # another tolerance; the receiver asks for a choice if the sensor rests
    changed = Signal()
    noted = Signal(str)

    def __init__(
        self, jobs: TaskList, settings: Settings, library: Library, parent: QObject
    ) -> None:
        super().__init__(parent)
        self._settings = settings
        self._library = library
        self.measured = MeasuredModel(jobs, library, self)
        for signal in (self.plan_changed, self.changed):  # figures of the plan in use
            self.measured.changed.connect(signal)
        self.measured.failed.connect(self.failed)
        self.tolerance = settings.tolerance  # relative L1 after smoothing that the user accepts
        self._scene: tuple[MeshSequence, SynthesisOptions] | None = None
        self._runner = ListedRunner("choose", jobs, self, self._decide, self._fail)
        self._runner.partial.connect(self._receive)
        self._runner.cancelled.connect(self._decide)
        self._runner.idle_changed.connect(self.changed)
        self._forget()

    def _forget(self) -> None:
        self.choice: Choice | None = None  # newest by tolerance; its place may be the one before
        self._chosen_at: VirtualSensor | None = None
        self._dragging: Choice | None = None
        self._asked: _Request | None = None  # that is decided, or being chosen for
        self._survey: Survey | None = None  # the last, which later ones of this clip build on
        self._clicked: PlanResult | None = None
        self._body: tuple[float | None, bool] = (None, False)  # its share, and if it is pending

    # --- what is known --------------------------------------------------------------------

    @property
    def frames(self) -> int:
        """Frames of the clip; none without a mesh to choose for."""
        return self._scene[0].frame_count if self._scene else 0

    @property
    def in_use(self) -> InUse | None:
        """The plan at rest; None until the first choice."""
        if self._clicked is None:
            elsewhere = self._asked is not None and self._asked.sensor != self._chosen_at
            return self._of_choice(self.choice, elsewhere=elsewhere)
        here = self._measured_here(self._clicked.plan)
        result = here or self._clicked
        cost_ms = result.cost.all_cores_ms.median
        return InUse(result.plan, result.errors.l1, cost_ms, True, here is None, *self._body)

    @property
    def while_dragging(self) -> InUse | None:
        """The plan while the sensor moves; None until it is known."""
        return self._of_choice(self._dragging)

    def _of_choice(self, choice: Choice | None, *, elsewhere: bool = False) -> InUse | None:
        if choice is None:
            return None
        error, cost_ms = choice.errors.l1, choice.cost_ms
        # The figures that the plot shows of the same plan, where it was measured here.
        if here := self._measured_here(choice.plan):
            error, cost_ms = here.errors.l1, here.cost.all_cores_ms.median
        return InUse(choice.plan, error, cost_ms, False, elsewhere, *self._body)

    def _measured_here(self, plan: AccuracyPlan) -> PlanResult | None:
        counting = self.measured.counting
        return None if counting is None or counting.stale else counting.of(plan)

    @property
    def choosing(self) -> bool:
        """True while a plan is being chosen."""
        return self._runner.busy

    @property
    def current_point(self) -> PlanResult | None:
        """Measured point of the plan at rest; None where others were measured, or elsewhere."""
        measurement, in_use = self.measured.measurement, self.in_use
        if measurement is None or in_use is None or (measurement.stale and not self._clicked):
            return None
        return measurement.of(in_use.plan)

    def cost_at(self, tolerance: float) -> float | None:
        """Milliseconds per frame of the cheapest counting plan known to hold a tolerance.

        Of those that were measured, and the one that was chosen; None until the
        scene has been measured, and where none holds.
        """
        if self.measured.counting is None:
            return None
        cheapest = cheapest_within(self.measured.counting, tolerance)
        known_ms = [] if cheapest is None else [cheapest.cost.all_cores_ms.median]
        if self.choice is not None and self.choice.errors.l1 <= tolerance:
            known_ms.append(self.choice.cost_ms)
        return min(known_ms, default=None)

    def is_decided(self, sensor: VirtualSensor, budget_ms: float) -> bool:
        """True if the plans were chosen for this sensor, budget and tolerance."""
        return self._asked == self._request(sensor, budget_ms) and not self.choosing

    def _request(self, sensor: VirtualSensor, budget_ms: float) -> _Request:
        return _Request(None if self._clicked else self.tolerance, budget_ms, sensor)

    # --- requests -------------------------------------------------------------------------

    def attach(self, mesh: MeshSequence | None, options: SynthesisOptions) -> None:
        """Take over another scene, or none."""
        self.hold()
        self._scene = None if mesh is None else (mesh, options)
        self._forget()
        self.measured.attach(mesh, options)
        self.plan_changed.emit()
        self.changed.emit()

    def surround(self, mesh: MeshSequence) -> None:
        """Go on with the same clip among other things; plans hold until others are chosen."""
        assert self._scene is not None
        if mesh is self._scene[0]:
            return
        self.hold()
        self._scene = mesh, self._scene[1]
        self._asked = None
        self.measured.attach(*self._scene)
        self.changed.emit()

    def choose(self, sensor: VirtualSensor, budget_ms: float) -> None:
        """Choose for the sensor at rest, and for a drag from there at ``budget_ms`` per frame."""
        request = self._request(sensor, budget_ms)
        if self._scene is None or request == self._asked:
            return
        self._asked = request
        mesh, options = self._scene
        self._runner.submit(
            lambda emit: self._compute(mesh, options, request, emit),
            "Choosing what the scene requires",
        )

    def hold(self) -> None:
        """Stop choosing, which frees the processor for the moving sensor."""
        if self.choosing:
            self._asked = None
        self._runner.cancel()

    def set_tolerance(self, tolerance: float) -> None:
        """Accept another error; a clicked point no longer rules."""
        if tolerance != self.tolerance or self._clicked is not None:
            self.tolerance = self._settings.tolerance = tolerance
            self.choose_by_tolerance()

    def await_body(self) -> None:
        """Keep the body's share as that of another place until it is found for this one."""
        self.set_body(self._body[0], pending=True)

    def set_body(self, error: float | None, *, pending: bool = False) -> None:
        """Take the body's share of the map's error."""
        if self._body != (error, pending):
            self._body = error, pending
            self.plan_changed.emit()
            self.changed.emit()

    def choose_by_tolerance(self) -> None:
        """Choose by the tolerance again."""
        if self._clicked is not None:
            self._clicked = None
            self.plan_changed.emit()
        self.requested.emit()
        self.changed.emit()

    def use(self, result: PlanResult) -> None:
        """Use a plan that was measured, whatever the tolerance is."""
        if result.plan.family != "histogram":
            self.noted.emit(
                "The window counts vertices; FMCW plans are shown for comparison. "
                "Run one with: sd2 synth MESH --out map.npz --method fmcw"
            )
            return
        if not serves_at_rest(result):
            self.noted.emit(
                "That plan keeps a mask while the sensor moves; it is used for dragging where it "
                "is the best. At rest the mask is recomputed: click a filled point."
            )
            return
        self.hold()
        self._clicked = result
        self.plan_changed.emit()
        self.changed.emit()

    # --- choosing -------------------------------------------------------------------------

    def _compute(
        self, mesh: MeshSequence, options: SynthesisOptions, request: _Request, emit: Emit
    ) -> Choice:
        """Choose for a wish in the background, at rest first; a place is surveyed once."""
        library = self._library()

        def progress(done: int, total: int) -> None:
            emit((done, total))

        survey = self._survey
        if survey is not None and (survey.trial.mesh, survey.trial.options) != (mesh, options):
            survey = None
        if survey is None or survey.trial.sensor != request.sensor:
            trial = survey.trial.at(request.sensor) if survey is not None else None
            survey = library.survey_scene(mesh, request.sensor, options, progress, trial=trial)
            self._survey = survey

        def within(**limit: float) -> Choice:
            choice: Choice = library.choose(
                mesh, request.sensor, options=options, survey=survey, progress=progress, **limit
            )
            survey.trial.forget()  # frames that were prepared for it
            return choice

        if request.tolerance is not None:
            emit(within(tolerance=request.tolerance))
        return within(budget_ms=request.budget_ms)

    def _receive(self, result: Any) -> None:
        if not isinstance(result, tuple):  # how far it is
            self._take(result)

    def _take(self, choice: Choice) -> None:
        """Use a plan that is chosen."""
        before = self.in_use, self.while_dragging
        if choice.tolerance is not None:
            self.choice, self._chosen_at = choice, self._asked and self._asked.sensor
        else:
            self._dragging = choice
        if before != (self.in_use, self.while_dragging):
            self.plan_changed.emit()
        self.changed.emit()

    def _decide(self, choice: Choice | None = None) -> None:
        """End a choice, which is the last of a wish: the same place is not asked for again."""
        if choice is not None:
            self._take(choice)
        else:
            self.changed.emit()
        self.decided.emit()

    def _fail(self, error: Exception) -> None:
        self._decide()
        super()._fail(error)
