"""Each rung taken down alone: what that changes on a scene, and what it saves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from sd2core.compiled import worker_count
from sd2core.doppler.options import SynthesisOptions
from sd2core.ladder.deviation import relative_l1
from sd2core.ladder.reasons import SceneFacts, look_at
from sd2core.ladder.rungs import FRAME_RATE_FACTORS, MASK_REUSE_M, VERTICES_KEPT, Plan, sights
from sd2core.ladder.sample import take_sample
from sd2core.ladder.trial import Trial
from sd2core.mesh import MeshSequence
from sd2core.progress import Progress, silent
from sd2core.sensor import VirtualSensor


@dataclass(eq=False)
class Survey:
    """What single rungs are worth on one scene.

    Parameters
    ----------
    trial : Trial
    base : Plan
        Every rung at its top but the frame rate, which would make all others dear.
    change : dict of Plan to float
        Relative L1 after smoothing on the frames to choose on: of ``base`` with one
        rung taken down, against ``base``; of ``base`` at several frame rates, against
        the reference.
    mask_ms, count_ms : dict of Plan to float
        Milliseconds of processor time per frame for visibility, and for counting.
    facts : SceneFacts
    """

    trial: Trial
    base: Plan
    facts: SceneFacts
    change: dict[Plan, float] = field(default_factory=dict)
    mask_ms: dict[Plan, float] = field(default_factory=dict)
    count_ms: dict[Plan, float] = field(default_factory=dict)

    def forecast_error(self, plan: Plan) -> float:
        """What the rungs of a plan change, added up: more than they do together."""
        return (
            sum(self.change[alone] for alone in self._alone(plan) if alone != self.base)
            + (self.change[replace(self.base, frame_rate_factor=plan.frame_rate_factor)])
        )

    def forecast_ms(self, plan: Plan) -> float:
        """Milliseconds per frame that a plan should take when all cores share the work."""
        base = self.base
        mask_ms = 0.0 if plan.mask_reuse_m else self.mask_ms[_sight_of(plan, base)]
        count_ms = self.count_ms[replace(base, frame_rate_factor=plan.frame_rate_factor)]
        if plan.range_law == "frame":
            per_vertex = self.count_ms[base]
            saved = per_vertex - self.count_ms[replace(base, range_law="frame")]
            count_ms -= min(max(saved, 0.0), 0.9 * per_vertex)
        return plan.vertices_kept * (mask_ms + count_ms) / worker_count()

    def rungs_down(self, plan: Plan) -> int:
        """In how many rungs a plan differs from the base."""
        alone = [*self._alone(plan), replace(self.base, frame_rate_factor=plan.frame_rate_factor)]
        return sum(other != self.base for other in alone)

    def _alone(self, plan: Plan) -> Iterator[Plan]:
        """The base with each rung of a plan alone; frame rates stand for themselves."""
        yield _sight_of(plan, self.base)
        yield replace(self.base, vertices_kept=plan.vertices_kept)
        yield replace(self.base, range_law=plan.range_law)
        yield replace(self.base, beyond=plan.beyond)
        if plan.mask_reuse_m:
            yield replace(self.base, mask_reuse_m=plan.mask_reuse_m)


def survey_scene(
    mesh: MeshSequence,
    sensor: VirtualSensor,
    options: SynthesisOptions,
    progress: Progress = silent,
    *,
    like: Survey | None = None,
) -> Survey:
    """Take down each rung alone.

    Parameters
    ----------
    mesh : MeshSequence
    sensor : VirtualSensor
    options : SynthesisOptions
        For what a plan does not choose.
    progress : Progress
        Counts what was tried; may raise Cancelled.
    like : Survey, optional
        Of the same mesh with the same options from another place: saves sampling and
        decimating again.
    """
    surface = mesh.faces is not None
    if like is not None:
        trial = like.trial.at(sensor)
    else:
        trial = Trial(mesh, sensor, options, take_sample(mesh, options))
    base = Plan(visibility="exact" if surface else "none", weight=options.weight)
    single = [replace(sight, weight=options.weight) for sight in sights(surface=surface)]
    single += [replace(base, vertices_kept=kept) for kept in VERTICES_KEPT if surface and kept < 1]
    if options.range_exponent:
        single.append(replace(base, range_law="frame"))
    single.append(replace(base, beyond="drop"))
    if surface:
        single += [replace(base, mask_reuse_m=reach_m) for reach_m in MASK_REUSE_M]
    single = [plan for plan in single if plan != base]
    rates = [replace(base, frame_rate_factor=factor) for factor in FRAME_RATE_FACTORS]
    total = len(single) + 2 * len(rates) + 2
    done = 0

    def step() -> None:
        nonlocal done
        done += 1
        progress(done, total)

    def within(*_: int) -> None:
        progress(done, total)

    runs = trial.sample.chosen_on
    reference = trial.reference(runs, progress=within)
    step()
    survey = Survey(trial, base, look_at(trial, within))
    trial.load_kernels(within)
    step()
    for plan in rates:
        found = trial.columns(plan, runs, progress=within)
        survey.change[plan] = relative_l1(found.smooth, reference.smooth)
        step()
    # Counting alone, over many frames at once: it is too quick for a few.
    for plan in (*rates, *(plan for plan in single if plan.range_law == "frame")):
        cheap = replace(plan, visibility="facing" if surface else "none")
        # The first time prepares what only this plan needs.
        survey.count_ms[plan] = min(
            trial.milliseconds(cheap, threads=1, progress=within) for _ in range(2)
        )
    step()
    against = trial.columns(base, runs, progress=within)
    quick_ms = survey.count_ms[base]
    survey.mask_ms[base] = max(against.milliseconds - quick_ms, 0.0)
    for plan in single:
        found = trial.columns(plan, runs, progress=within)
        truth = against.twice() if plan.mask_reuse_m else against
        survey.change[plan] = relative_l1(found.smooth, truth.smooth)
        survey.mask_ms[plan] = max(found.milliseconds - quick_ms, 0.0)
        step()
    return survey


def _sight_of(plan: Plan, base: Plan) -> Plan:
    return replace(
        base,
        visibility=plan.visibility,
        depth_resolution=plan.depth_resolution,
        mask_stride=plan.mask_stride,
    )
