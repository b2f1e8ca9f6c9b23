"""Survey of a scene: error and cost of each setting of a counting plan alone."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import pairwise, product
from typing import Any

import numpy as np

from sd2core.accuracy.cost_model import modelled_ns
from sd2core.accuracy.plans import FRAME_RATE_FACTORS, AccuracyPlan, visibility_plans
from sd2core.accuracy.sample import take_sample
from sd2core.accuracy.trial import Trial
from sd2core.doppler.options import SynthesisOptions
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import worker_count
from sd2core.progress import Progress, silent
from sd2core.sensor import VirtualSensor

_COUNTING_REPEATS = 4

_SIGHT = ("visibility", "depth_resolution", "mask_stride")
_ALONE = (_SIGHT, ("vertices_kept",), ("range_law",), ("beyond",), ("mask_reuse_m",))
"""Settings that are lowered alone; frame rates are held against the reference instead."""

_WORTH_TAKING = 1.05
_NEGLIGIBLE_NS = 2000.0
"""Per frame: a millisecond for a clip of some hundred frames."""


@dataclass(frozen=True)
class SceneFacts:
    """Motion and distance of the vertices in the sampled frames, all counted alike."""

    still_share: float  # vertices that never leave the nulled bins
    beyond_share: float  # velocities beyond the axis
    range_spread: float
    """From the 5th to the 95th percentile of the ranges within a frame, relative to their median;
    median over frames."""
    motion_bins: float
    """Bins by which a velocity changes from one frame to the next; mean over the vertices that
    leave the nulled bins."""
    empty: bool  # nothing that is seen leaves the nulled bins


@dataclass(eq=False)
class Survey:
    """Error and cost of single settings on one scene."""

    trial: Trial
    base: AccuracyPlan
    """Highest accuracy in every setting but the frame rate, which would slow down all others."""
    facts: SceneFacts
    change: dict[AccuracyPlan, float] = field(default_factory=dict)
    """Relative L1 after smoothing on the frames to choose on: of ``base`` with one setting
    lowered, against ``base``; of ``base`` at several frame rates, against the reference."""
    mask_ms: dict[AccuracyPlan, float] = field(default_factory=dict)
    """Milliseconds of processor time per frame for visibility."""
    count_ms: dict[AccuracyPlan, float] = field(default_factory=dict)  # the same for counting
    others_change: float | None = None
    """Relative L1 of the map of the first body alone; None where there is no other."""
    cost_share: dict[float, float] = field(default_factory=lambda: {1.0: 1.0})
    """Cost of a share of the vertices, as a share of the cost of all."""

    def forecast_error(self, plan: AccuracyPlan) -> float:
        """Sum of the errors of a plan's settings: more than their error together."""
        lowered = (names for names in _ALONE if self._differs(plan, names))
        down = [self.change[self._taking(plan, *names)] for names in lowered]
        down += [self.change[replace(self.base, left_out=(part,))] for part in plan.left_out]
        return self.change[self._taking(plan, "frame_rate_factor")] + sum(down)

    def forecast_ms(self, plan: AccuracyPlan) -> float:
        """Milliseconds per frame that a plan should take when all cores share the work."""
        mask_ms = 0.0 if plan.mask_reuse_m else self.mask_ms[self._taking(plan, *_SIGHT)]
        count_ms = self.count_ms[self._taking(plan, "frame_rate_factor")]
        if plan.range_law == "frame":
            per_vertex = self.count_ms[self.base]
            saved = per_vertex - self.count_ms[self._taking(plan, "range_law")]
            count_ms -= min(max(saved, 0.0), 0.9 * per_vertex)
        spent = self._modelled_ns(plan) / self._modelled_ns(replace(plan, left_out=()))
        return self.cost_share[plan.vertices_kept] * spent * (mask_ms + count_ms) / worker_count()

    def cost_key(self, plan: AccuracyPlan) -> tuple[int, int]:
        """Sort key: cost in steps of 5 %, then the number of settings that differ from the base.

        The cost is a model's, since measured times differ each time.
        """
        cost_ns = self._modelled_ns(plan) + _NEGLIGIBLE_NS
        return round(math.log(cost_ns) / math.log(_WORTH_TAKING)), self.settings_changed(plan)

    def _modelled_ns(self, plan: AccuracyPlan) -> float:
        mesh, moving = self.trial.mesh, 1.0 - self.facts.still_share
        walls = 0 if mesh.surroundings is None else len(mesh.surroundings.walls)
        return modelled_ns(plan, mesh.vertex_count, moving, self.trial.scene_parts, walls)

    def settings_changed(self, plan: AccuracyPlan) -> int:
        """Number of settings in which a plan differs from the base."""
        lowered = sum(self._differs(plan, names) for names in (*_ALONE, ("frame_rate_factor",)))
        return lowered + len(plan.left_out)

    def _differs(self, plan: AccuracyPlan, names: tuple[str, ...]) -> bool:
        return any(getattr(plan, name) != getattr(self.base, name) for name in names)

    def _taking(self, plan: AccuracyPlan, *names: str) -> AccuracyPlan:
        """The base with some settings of a plan."""
        taken: dict[str, Any] = {name: getattr(plan, name) for name in names}
        return replace(self.base, **taken)


def survey_scene(
    mesh: MeshSequence,
    sensor: VirtualSensor,
    options: SynthesisOptions,
    progress: Progress = silent,
    *,
    trial: Trial | None = None,
) -> Survey:
    """Measure error and cost of each setting alone.

    Parameters
    ----------
    mesh, sensor : MeshSequence, VirtualSensor
        The scene.
    options : SynthesisOptions
        For what a plan does not choose.
    progress : Progress
        Counts the tries; may raise Cancelled.
    trial : Trial, optional
        One of the same scene, if there is one already; that of another place, with
        :meth:`Trial.at` this one, saves sampling and decimating again.
    """
    surface = mesh.faces is not None
    if trial is None:
        trial = Trial(mesh, sensor, options, take_sample(mesh, sensor, options))
    base = AccuracyPlan(visibility="exact" if surface else "none", weight=options.weight)
    single = [replace(sight, weight=options.weight) for sight in visibility_plans(surface=surface)]
    single += [replace(base, vertices_kept=kept) for kept in trial.vertices_kept if kept < 1]
    if options.range_exponent:
        single.append(replace(base, range_law="frame"))
    single.append(replace(base, beyond="drop"))
    single += [replace(base, left_out=(part,)) for part in trial.scene_parts]
    single = [plan for plan in single if plan != base]
    rates = [replace(base, frame_rate_factor=factor) for factor in FRAME_RATE_FACTORS]
    total = len(single) + len(rates) + 2 + bool(mesh.others)
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
    survey = Survey(trial, base, scene_facts(trial, within))
    at_rate = {}
    for plan in rates:
        at_rate[plan] = trial.columns(plan, runs, progress=within)
        survey.change[plan] = at_rate[plan].off(reference)
        step()
    # In turns, so that a busy machine slows all alike; the first time prepares what only this
    # plan needs.
    counted = (*rates, *(plan for plan in single if plan.range_law == "frame"))
    for _, plan in product(range(_COUNTING_REPEATS), counted):
        cheap = replace(plan, visibility="facing" if surface else "none")
        spent_ms = trial.milliseconds(cheap, threads=1, runs=runs, progress=within)
        survey.count_ms[plan] = min(survey.count_ms.get(plan, spent_ms), spent_ms)
    for fewer, more in pairwise(rates):
        # More moments take longer, whatever a clock says of microseconds.
        survey.count_ms[more] = max(survey.count_ms[fewer], survey.count_ms[more])
    step()
    against = at_rate[base]
    again = trial.columns(base, runs, progress=within)
    base_ms = min(against.milliseconds, again.milliseconds)
    quick_ms = survey.count_ms[base]
    survey.mask_ms[base] = max(base_ms - quick_ms, 0.0)
    for plan in single:
        columns = trial.columns(plan, runs, progress=within)
        survey.change[plan] = columns.off(against)
        spent_ms = columns.milliseconds
        if plan.vertices_kept < 1 or spent_ms > base_ms:
            # The first time loads and prepares what only this plan needs.
            again = trial.columns(plan, runs, progress=within)
            spent_ms = min(spent_ms, again.milliseconds)
        survey.mask_ms[plan] = max(spent_ms - quick_ms, 0.0)
        if plan.vertices_kept < 1:
            share = spent_ms / base_ms if base_ms > 0 else 1.0
            survey.cost_share[plan.vertices_kept] = min(max(share, plan.vertices_kept), 1.0)
        step()
    if mesh.others:
        alone = Trial(replace(mesh, others=()), sensor, options, trial.sample)
        columns = alone.columns(base, runs, progress=within)
        survey.others_change = columns.off(against)
        step()
    return survey


def scene_facts(trial: Trial, progress: Progress = silent) -> SceneFacts:
    """Collect velocities and ranges of every vertex in the frames to choose on."""
    options = trial.options
    axis = options.axis
    synthesizer = trial.synthesizer(
        AccuracyPlan(visibility="none", weight=options.weight),
        runs=trial.sample.chosen_on,
        progress=progress,
    )
    live = [np.zeros(one.mesh.vertex_count, np.bool_) for one in synthesizer.bodies]
    beyond: list[float] = []
    spreads: list[float] = []
    changes: list[float] = []
    nulled = np.array([bin_number in options.null_bins for bin_number in range(axis.bins)])
    for run, (number, body) in product(trial.sample.chosen_on, enumerate(synthesizer.bodies)):
        before = None
        for frame in range(run.start, run.stop):
            progress(frame - run.start, run.stop - run.start)
            if not body.mesh.presence.measured[frame]:
                before = None
                continue
            seen = body.frame(trial.sensor, frame, "none")
            place = np.floor((seen.velocity_mps / axis.v_max_mps + 1) * 0.5 * axis.bins)
            outside = np.abs(seen.velocity_mps) > axis.v_max_mps
            moves = outside | ~nulled[np.clip(place, 0, axis.bins - 1).astype(int)]
            live[number] |= moves
            beyond.append(float(outside.mean()))
            low, middle, high = np.percentile(seen.range_m, (5, 50, 95))
            spreads.append(float((high - low) / middle) if middle > 0 else 0.0)
            if before is not None and moves.any():
                step_mps = np.abs(seen.velocity_mps - before)[moves]
                changes.append(float(step_mps.mean()) / axis.bin_width_mps)
            before = seen.velocity_mps
    return SceneFacts(
        still_share=1.0 - float(np.concatenate(live).mean()),
        beyond_share=float(np.mean(beyond)) if beyond else 0.0,
        range_spread=float(np.median(spreads)) if spreads else 0.0,
        motion_bins=float(np.mean(changes)) if changes else 0.0,
        empty=not trial.reference(trial.sample.chosen_on).raw.any(),
    )
