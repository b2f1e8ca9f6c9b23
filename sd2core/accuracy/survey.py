"""Each rung taken down alone: what that changes on a scene, and what it saves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise, product

from sd2core.accuracy.deviation import relative_l1
from sd2core.accuracy.plans import FRAME_RATE_FACTORS, MASK_REUSE_M, AccuracyPlan, sights
from sd2core.accuracy.reasons import SceneFacts, look_at
from sd2core.accuracy.sample import take_sample
from sd2core.accuracy.trial import Trial
from sd2core.doppler.options import SynthesisOptions
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import worker_count
from sd2core.progress import Progress, silent
from sd2core.sensor import VirtualSensor

_COUNTING_REPEATS = 4


@dataclass(eq=False)
class Survey:
    """What single rungs are worth on one scene.

    Parameters
    ----------
    base : AccuracyPlan
        Every rung at its top but the frame rate, which would make all others dear.
    change : dict of AccuracyPlan to float
        Relative L1 after smoothing on the frames to choose on: of ``base`` with one
        rung taken down, against ``base``; of ``base`` at several frame rates, against
        the reference.
    mask_ms, count_ms : dict of AccuracyPlan to float
        Milliseconds of processor time per frame for visibility, and for counting.
    cost_share : dict of float to float
        What a share of the vertices costs, of what all of them cost.
    """

    trial: Trial
    base: AccuracyPlan
    facts: SceneFacts
    change: dict[AccuracyPlan, float] = field(default_factory=dict)
    mask_ms: dict[AccuracyPlan, float] = field(default_factory=dict)
    count_ms: dict[AccuracyPlan, float] = field(default_factory=dict)
    cost_share: dict[float, float] = field(default_factory=lambda: {1.0: 1.0})

    def forecast_error(self, plan: AccuracyPlan) -> float:
        """What the rungs of a plan change, added up: more than they do together."""
        rate = replace(self.base, frame_rate_factor=plan.frame_rate_factor)
        down = (self.change[alone] for alone in self._alone(plan) if alone != self.base)
        return self.change[rate] + sum(down)

    def forecast_ms(self, plan: AccuracyPlan) -> float:
        """Milliseconds per frame that a plan should take when all cores share the work."""
        base = self.base
        mask_ms = 0.0 if plan.mask_reuse_m else self.mask_ms[_sight_of(plan, base)]
        count_ms = self.count_ms[replace(base, frame_rate_factor=plan.frame_rate_factor)]
        if plan.range_law == "frame":
            per_vertex = self.count_ms[base]
            saved = per_vertex - self.count_ms[replace(base, range_law="frame")]
            count_ms -= min(max(saved, 0.0), 0.9 * per_vertex)
        return self.cost_share[plan.vertices_kept] * (mask_ms + count_ms) / worker_count()

    def rungs_down(self, plan: AccuracyPlan) -> int:
        """In how many rungs a plan differs from the base."""
        alone = [*self._alone(plan), replace(self.base, frame_rate_factor=plan.frame_rate_factor)]
        return sum(other != self.base for other in alone)

    def _alone(self, plan: AccuracyPlan) -> Iterator[AccuracyPlan]:
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
    trial: Trial | None = None,
) -> Survey:
    """Take down each rung alone.

    Parameters
    ----------
    options : SynthesisOptions
        For what a plan does not choose.
    progress : Progress
        Counts what was tried; may raise Cancelled.
    like : Survey, optional
        Of the same mesh with the same options from another place: saves sampling and
        decimating again.
    trial : Trial, optional
        Of this very scene, where plans have been tried on it already.
    """
    surface = mesh.faces is not None
    if trial is None and like is not None:
        trial = like.trial.at(sensor)
    elif trial is None:
        trial = Trial(mesh, sensor, options, take_sample(mesh, options))
    base = AccuracyPlan(visibility="exact" if surface else "none", weight=options.weight)
    single = [replace(sight, weight=options.weight) for sight in sights(surface=surface)]
    single += [replace(base, vertices_kept=kept) for kept in trial.vertices_kept if kept < 1]
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
    # Counting alone, over many frames at once: it is too quick for a few. In turns, so that a
    # busy machine slows all alike; the first time prepares what only this plan needs.
    counted = (*rates, *(plan for plan in single if plan.range_law == "frame"))
    for _, plan in product(range(_COUNTING_REPEATS), counted):
        cheap = replace(plan, visibility="facing" if surface else "none")
        spent_ms = trial.milliseconds(cheap, threads=1, progress=within)
        survey.count_ms[plan] = min(survey.count_ms.get(plan, spent_ms), spent_ms)
    for fewer, more in pairwise(rates):
        # More moments take longer, whatever a clock says of microseconds.
        survey.count_ms[more] = max(survey.count_ms[fewer], survey.count_ms[more])
    step()
    against = trial.columns(base, runs, progress=within)
    quick_ms = survey.count_ms[base]
    survey.mask_ms[base] = max(against.milliseconds - quick_ms, 0.0)
    for plan in single:
        found = trial.columns(plan, runs, progress=within)
        truth = against.twice() if plan.mask_reuse_m else against
        survey.change[plan] = relative_l1(found.smooth, truth.smooth)
        survey.mask_ms[plan] = max(found.milliseconds - quick_ms, 0.0)
        if plan.vertices_kept < 1:
            # The first time prepares what only this mesh needs.
            again = trial.columns(plan, runs, progress=within)
            spent_ms = min(found.milliseconds, again.milliseconds)
            share = spent_ms / against.milliseconds if against.milliseconds > 0 else 1.0
            survey.cost_share[plan.vertices_kept] = min(max(share, plan.vertices_kept), 1.0)
        step()
    return survey


def _sight_of(plan: AccuracyPlan, base: AccuracyPlan) -> AccuracyPlan:
    return replace(
        base,
        visibility=plan.visibility,
        depth_resolution=plan.depth_resolution,
        mask_stride=plan.mask_stride,
    )
