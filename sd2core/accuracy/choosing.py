"""Choice of the cheapest plan that holds a tolerance on a scene."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import pairwise, product
from typing import Any

from sd2core.accuracy.cost_model import modelled_ns
from sd2core.accuracy.plans import (
    FRAME_RATE_FACTORS,
    MASK_REUSE_M,
    AccuracyPlan,
    counting_plans,
    visibility_plans,
)
from sd2core.accuracy.reasons import Chosen, SceneFacts, reasons_for, scene_facts
from sd2core.accuracy.results import Choice, Errors
from sd2core.accuracy.sample import take_sample
from sd2core.accuracy.trial import Trial
from sd2core.doppler.options import PRESETS, DepthResolution, SynthesisOptions, Visibility
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import worker_count
from sd2core.numerics.map_accuracy import relative_l1
from sd2core.progress import Progress, silent
from sd2core.sensor import VirtualSensor

_COUNTING_REPEATS = 4


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
    cost_share: dict[float, float] = field(default_factory=lambda: {1.0: 1.0})
    """Cost of a share of the vertices, as a share of the cost of all."""

    def try_kept_masks(self, progress: Progress = silent) -> None:
        """Add the changes by masks that are kept while the sensor moves: only a drag asks."""
        if self.base.visibility != "exact":
            return
        kept = [replace(self.base, mask_reuse_m=reach_m) for reach_m in MASK_REUSE_M]
        runs = self.trial.sample.chosen_on
        against = None
        for done, plan in enumerate(kept):
            progress(done, len(kept))
            if plan not in self.change:
                against = against or self.trial.columns(self.base, runs, progress=progress).twice()
                found = self.trial.columns(plan, runs, progress=progress)
                self.change[plan] = relative_l1(found.smooth, against.smooth)

    def forecast_error(self, plan: AccuracyPlan) -> float:
        """Sum of the errors of a plan's settings: more than their error together."""
        rate = _with(self.base, "frame_rate_factor", plan.frame_rate_factor)
        down = (self.change[alone] for alone in self._alone(plan) if alone != self.base)
        return self.change[rate] + sum(down)

    def forecast_ms(self, plan: AccuracyPlan) -> float:
        """Milliseconds per frame that a plan should take when all cores share the work."""
        base = self.base
        mask_ms = 0.0 if plan.mask_reuse_m else self.mask_ms[_sight_of(plan, base)]
        count_ms = self.count_ms[_with(base, "frame_rate_factor", plan.frame_rate_factor)]
        if plan.range_law == "frame":
            per_vertex = self.count_ms[base]
            saved = per_vertex - self.count_ms[_with(base, "range_law", "frame")]
            count_ms -= min(max(saved, 0.0), 0.9 * per_vertex)
        return self.cost_share[plan.vertices_kept] * (mask_ms + count_ms) / worker_count()

    def modelled_ns(self, plan: AccuracyPlan) -> float:
        """Cost by which plans are ordered: a model, since measured times differ each time."""
        moving = 1.0 - self.facts.still_share
        return modelled_ns(plan, self.trial.mesh.vertex_count, moving)

    def settings_changed(self, plan: AccuracyPlan) -> int:
        """Number of settings in which a plan differs from the base."""
        rate = _with(self.base, "frame_rate_factor", plan.frame_rate_factor)
        return sum(other != self.base for other in (*self._alone(plan), rate))

    def _alone(self, plan: AccuracyPlan) -> Iterator[AccuracyPlan]:
        """Yield the base with each setting of a plan alone; frame rates are not among them."""
        yield _sight_of(plan, self.base)
        for setting in ("vertices_kept", "range_law", "beyond"):
            yield _with(self.base, setting, getattr(plan, setting))
        if plan.mask_reuse_m:
            yield _with(self.base, "mask_reuse_m", plan.mask_reuse_m)


def survey_scene(
    mesh: MeshSequence,
    sensor: VirtualSensor,
    options: SynthesisOptions,
    progress: Progress = silent,
    *,
    like: Survey | None = None,
    trial: Trial | None = None,
) -> Survey:
    """Measure error and cost of each setting alone.

    ``options`` are for what a plan does not choose. ``like`` is a survey of the same mesh
    with the same options from another place: it saves sampling and decimating again.
    ``trial`` is one of the same scene, if there is one already. Progress counts the tries
    and may raise Cancelled.
    """
    surface = mesh.faces is not None
    if trial is None and like is not None:
        trial = like.trial.at(sensor)
    elif trial is None:
        trial = Trial(mesh, sensor, options, take_sample(mesh, options))
    base = AccuracyPlan(visibility="exact" if surface else "none", weight=options.weight)
    single = [replace(sight, weight=options.weight) for sight in visibility_plans(surface=surface)]
    single += [replace(base, vertices_kept=kept) for kept in trial.vertices_kept if kept < 1]
    if options.range_exponent:
        single.append(replace(base, range_law="frame"))
    single.append(replace(base, beyond="drop"))
    single = [plan for plan in single if plan != base]
    rates = [replace(base, frame_rate_factor=factor) for factor in FRAME_RATE_FACTORS]
    total = len(single) + len(rates) + 3
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
    trial.load_kernels(within)
    step()
    at_rate = {}
    for plan in rates:
        at_rate[plan] = trial.columns(plan, runs, progress=within)
        survey.change[plan] = relative_l1(at_rate[plan].smooth, reference.smooth)
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
    quick_ms = survey.count_ms[base]
    survey.mask_ms[base] = max(against.milliseconds - quick_ms, 0.0)
    for plan in single:
        found = trial.columns(plan, runs, progress=within)
        survey.change[plan] = relative_l1(found.smooth, against.smooth)
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
    return _seen_by(base, plan.visibility, plan.depth_resolution, plan.mask_stride)


# Kept, because every combination of settings asks for the few plans that it is forecast from.
@lru_cache(maxsize=1024)
def _seen_by(
    base: AccuracyPlan, visibility: Visibility, depth_resolution: DepthResolution, mask_stride: int
) -> AccuracyPlan:
    return replace(
        base, visibility=visibility, depth_resolution=depth_resolution, mask_stride=mask_stride
    )


@lru_cache(maxsize=1024)
def _with(base: AccuracyPlan, setting: str, value: object) -> AccuracyPlan:
    changes: dict[str, Any] = {setting: value}
    return replace(base, **changes)


_MOST_TRIALS = 8
_MORE_TRIALS = 4

_FREE_SHARE = 0.1
"""A setting without cost is modelled when it changes the map by this share of the tolerance."""

_SLACK = 1.5
"""Errors of single settings add up to more than a plan's error; by this factor at most."""

_WORTH_TAKING = 1.05
_NEGLIGIBLE_NS = 2000.0
"""Per frame: a millisecond for a clip of some hundred frames."""

_USUAL_TOLERANCE = 0.02
"""Where a budget rules: for what costs nothing."""


def choose(
    mesh: MeshSequence,
    sensor: VirtualSensor,
    *,
    tolerance: float | None = None,
    budget_ms: float | None = None,
    dragging: bool = True,
    options: SynthesisOptions | None = None,
    survey: Survey | None = None,
    progress: Progress = silent,
) -> Choice:
    """Choose the cheapest counting plan within a tolerance, or the best within a budget.

    Each setting is lowered alone on some frames, which gives the reasons and a
    forecast for every combination. The most promising ones are tried, on those frames
    and on others, until one holds. Errors and a model of the cost decide between the plans
    that hold a tolerance, so that the choice is the same each time; a budget is compared with
    measured times.

    Parameters
    ----------
    tolerance : float
        Relative L1 of the map after smoothing against the reference plan in double
        precision, on frames that were not used to choose.
    budget_ms : float
        Milliseconds per frame on all cores, after a move of the sensor.
    dragging : bool
        True if a budget also considers plans that keep a mask while the sensor moves: such a
        plan saves nothing for a single map.
    options : SynthesisOptions
        For what a plan does not choose; the paper's by default.
    survey : Survey
        Survey of this scene, if there is one already.
    progress : Progress
        May raise Cancelled.

    Returns
    -------
    Choice
        With ``holds`` False the best available plan.

    Raises
    ------
    Sd2Error
        Unless one of tolerance and budget is given, the tolerance above 0 and up to 1, the
        budget positive; or when the options take Vid2Doppler's velocities.
    """
    started = time.perf_counter()
    check_wish(tolerance, budget_ms)
    if survey is None:
        survey = survey_scene(mesh, sensor, check_options(mesh, options), progress)
    tried: dict[AccuracyPlan, Errors] = {}
    if tolerance is not None:
        plan, holds, errors = _by_tolerance(survey, tolerance, tried, progress)
    else:
        assert budget_ms is not None
        plan, holds, errors = _by_budget(survey, budget_ms, dragging, progress)
    return Choice(
        plan=plan,
        holds=holds,
        errors=errors,
        cost_ms=survey.forecast_ms(plan),
        reasons=reasons_for(
            Chosen(
                plan,
                holds,
                errors.l1,
                tolerance,
                lambda lower: _why_not(survey, plan, lower, tried),
            ),
            survey.base,
            survey.change,
            survey.facts,
            survey.trial.options.axis.v_max_mps,
        ),
        tolerance=tolerance,
        budget_ms=budget_ms,
        spent_s=time.perf_counter() - started,
        unseen=set(survey.trial.sample.chosen_on).isdisjoint(survey.trial.sample.checked_on),
    )


def check_options(mesh: MeshSequence, options: SynthesisOptions | None) -> SynthesisOptions:
    """Options for which plans can be compared: the paper's unless others are given.

    Raises Sd2Error for Vid2Doppler's velocities, which have no settings to choose from.
    """
    options = options or PRESETS["paper"]
    if options.velocity != "central":
        raise Sd2Error(
            f"The options take the velocities of {options.velocity}",
            "central differences: that tool's arithmetic has no settings to choose from",
        )
    if mesh.faces is None:
        options = replace(options, visibility="none")
    return options


def check_wish(tolerance: float | None, budget_ms: float | None = None) -> None:
    """Raise Sd2Error unless one of the two is given, and can be wished for."""
    if (tolerance is None) == (budget_ms is None):
        raise Sd2Error(
            f"The tolerance is {tolerance} and the budget {budget_ms} ms", "one of the two"
        )
    if tolerance is not None and not 0 < tolerance <= 1:
        raise Sd2Error(
            f"The tolerance is {tolerance:g}", "a share above 0 and up to 1", "Take 0.02 for 2 %"
        )
    if budget_ms is not None and not 0 < budget_ms < float("inf"):
        raise Sd2Error(f"The budget is {budget_ms} ms", "a number above 0")


def _by_tolerance(
    survey: Survey, tolerance: float, tried: dict[AccuracyPlan, Errors], progress: Progress
) -> tuple[AccuracyPlan, bool, Errors]:
    """Cheapest plan that holds, else the one of smallest error; ``tried`` gets all errors."""
    plans = sorted(_candidates(survey, tolerance), key=lambda plan: _dearness(survey, plan))
    forecast = {plan: survey.forecast_error(plan) for plan in plans}
    safe = [plan for plan in plans if forecast[plan] <= tolerance]
    # What must hold if anything does.
    safe.append(min(plans, key=lambda plan: (forecast[plan], survey.settings_changed(plan))))
    failed: list[tuple[AccuracyPlan, Errors]] = []
    for plan in (*safe[: _MOST_TRIALS - 1], safe[-1]):
        errors = tried[plan] = _tried(survey, plan, tolerance, progress)
        if errors.l1 <= tolerance:
            break
        failed.append((plan, errors))
    else:
        nearest, errors = min(failed, key=lambda trial: trial[1].l1)
        return nearest, False, errors
    # Changes do not quite add up: some of the cheaper plans may hold as well.
    cheaper = [
        other
        for other in plans[: plans.index(plan)]
        if tolerance < forecast[other] <= _SLACK * tolerance
    ]
    for other in sorted(cheaper, key=forecast.__getitem__)[:_MORE_TRIALS]:
        found = tried[other] = _tried(survey, other, tolerance, progress)
        if found.l1 <= tolerance and plans.index(other) < plans.index(plan):
            plan, errors = other, found
    return plan, True, errors


def _by_budget(
    survey: Survey, budget_ms: float, dragging: bool, progress: Progress
) -> tuple[AccuracyPlan, bool, Errors]:
    plans = _candidates(survey, _USUAL_TOLERANCE)
    if dragging:
        survey.try_kept_masks(progress)
    reach_m = _reach_m(survey) if dragging else None
    if reach_m is not None:
        plans += [
            replace(plan, mask_reuse_m=reach_m)
            for plan in plans
            if plan.visibility == "exact" and plan.mask_stride == 1
        ]
    within = [plan for plan in plans if survey.forecast_ms(plan) <= budget_ms]
    if within:
        plan = min(within, key=lambda plan: (survey.forecast_error(plan), _dearness(survey, plan)))
    else:
        plan = min(plans, key=survey.forecast_ms)
    errors = survey.trial.errors(plan, survey.trial.sample.checked_on, progress=progress)
    return plan, bool(within), errors


def _dearness(survey: Survey, plan: AccuracyPlan) -> tuple[int, int]:
    """Sort key: cost in steps of 5 %, then the number of settings that differ from the base."""
    step = math.log(survey.modelled_ns(plan) + _NEGLIGIBLE_NS) / math.log(_WORTH_TAKING)
    return round(step), survey.settings_changed(plan)


def _why_not(
    survey: Survey, plan: AccuracyPlan, lower: AccuracyPlan, tried: Mapping[AccuracyPlan, Errors]
) -> float | None:
    """Error that a plan with one setting lowered has, or is forecast; None if it saves nothing."""
    if _dearness(survey, lower) >= _dearness(survey, plan):
        return None
    return tried[lower].l1 if lower in tried else survey.forecast_error(lower)


def _reach_m(survey: Survey) -> float | None:
    """Longest move of the sensor after which a kept mask is better than the facing test."""
    if survey.base.visibility != "exact":
        return None
    facing = survey.change[replace(survey.base, visibility="facing")]
    kept = [
        reach_m
        for reach_m in MASK_REUSE_M
        if survey.change[replace(survey.base, mask_reuse_m=reach_m)] < facing
    ]
    return max(kept, default=None)


def _tried(survey: Survey, plan: AccuracyPlan, tolerance: float, progress: Progress) -> Errors:
    """Errors on the frames to check on; if already too large on those to choose on, there."""
    sample = survey.trial.sample
    errors = survey.trial.errors(plan, sample.chosen_on, progress=progress)
    if errors.l1 > tolerance:
        return errors
    return survey.trial.errors(plan, sample.checked_on, progress=progress)


def _candidates(survey: Survey, tolerance: float) -> list[AccuracyPlan]:
    options = survey.trial.options
    dropped = survey.change[replace(survey.base, beyond="drop")]
    return [
        replace(plan, beyond="wrap" if dropped > _FREE_SHARE * tolerance else "drop")
        for plan in counting_plans(
            options.weight,
            surface=survey.base.visibility != "none",
            range_law=options.range_exponent > 0,
            vertices_kept=survey.trial.vertices_kept,
        )
    ]
