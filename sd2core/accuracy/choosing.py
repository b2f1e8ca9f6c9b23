"""What this scene requires: the cheapest plan that holds a tolerance, and why."""

from __future__ import annotations

import math
import time
from dataclasses import replace

from sd2core.accuracy.plans import MASK_REUSE_M, AccuracyPlan, counting_plans
from sd2core.accuracy.reasons import reasons_for
from sd2core.accuracy.results import Choice, Errors
from sd2core.accuracy.survey import Survey, survey_scene
from sd2core.doppler.options import PRESETS, SynthesisOptions
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import Progress, silent
from sd2core.sensor import VirtualSensor

_MOST_TRIALS = 8
_MORE_TRIALS = 4

_FREE_SHARE = 0.1
"""What costs nothing is modelled when it changes the map by this share of the tolerance."""

_SLACK = 1.5
"""Changes of single rungs add up to more than a plan's error: how much more is let pass."""

_WORTH_TAKING = 1.05
_NEGLIGIBLE_MS = 0.002
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
    """The cheapest counting plan within a tolerance, or the best within a budget.

    Each rung is taken down alone on some frames, which gives the reasons and a
    forecast for every combination. The most promising ones are tried, on those frames
    and on others, until one holds.

    Parameters
    ----------
    tolerance : float
        Relative L1 of the map after smoothing against the reference plan in double
        precision, on frames that were not used to choose.
    budget_ms : float
        Milliseconds per frame on all cores, after a move of the sensor.
    dragging : bool
        Whether plans that keep a mask while the sensor moves are among those that a
        budget considers: such a plan saves nothing for a single map.
    options : SynthesisOptions
        For what a plan does not choose; the paper's by default.
    survey : Survey
        Of this scene, when it has been made already.
    progress : Progress
        May raise Cancelled.

    Returns
    -------
    Choice
        With ``holds`` False the best that can be had.

    Raises
    ------
    Sd2Error
        Unless one of tolerance and budget is given and positive, or when the
        options take Vid2Doppler's velocities.
    """
    started = time.perf_counter()
    _check(tolerance, budget_ms)
    if survey is None:
        survey = survey_scene(mesh, sensor, checked_options(mesh, options), progress)
    if tolerance is not None:
        plan, holds, errors = _by_tolerance(survey, tolerance, progress)
    else:
        assert budget_ms is not None
        plan, holds, errors = _by_budget(survey, budget_ms, dragging, progress)
    return Choice(
        plan=plan,
        holds=holds,
        errors=errors,
        cost_ms=survey.forecast_ms(plan),
        reasons=reasons_for(
            plan, survey.base, survey.change, survey.facts, survey.trial.options.axis.v_max_mps
        ),
        tolerance=tolerance,
        budget_ms=budget_ms,
        spent_s=time.perf_counter() - started,
        unseen=set(survey.trial.sample.chosen_on).isdisjoint(survey.trial.sample.checked_on),
    )


def checked_options(mesh: MeshSequence, options: SynthesisOptions | None) -> SynthesisOptions:
    """Options that the ladder can work with: the paper's unless others are given.

    Raises
    ------
    Sd2Error
        For Vid2Doppler's velocities, which have no rungs.
    """
    options = options or PRESETS["paper"]
    if options.velocity != "central":
        raise Sd2Error(
            f"The options take the velocities of {options.velocity}",
            "central differences: that tool's arithmetic has no rungs to choose from",
        )
    if mesh.faces is None:
        options = replace(options, visibility="none")
    return options


def _check(tolerance: float | None, budget_ms: float | None) -> None:
    if (tolerance is None) == (budget_ms is None):
        raise Sd2Error(
            f"The tolerance is {tolerance} and the budget {budget_ms} ms", "one of the two"
        )
    wanted = tolerance if tolerance is not None else budget_ms
    if wanted is None or not 0 < wanted < float("inf"):
        name = "tolerance" if tolerance is not None else "budget"
        raise Sd2Error(f"The {name} is {wanted}", "a number above 0")


def _by_tolerance(
    survey: Survey, tolerance: float, progress: Progress
) -> tuple[AccuracyPlan, bool, Errors]:
    """The cheapest of those tried that holds; else the nearest of them."""
    plans = sorted(_candidates(survey, tolerance), key=lambda plan: _dearness(survey, plan))
    forecast = {plan: survey.forecast_error(plan) for plan in plans}
    safe = [plan for plan in plans if forecast[plan] <= tolerance]
    # What must hold if anything does.
    safe.append(min(plans, key=forecast.__getitem__))
    failed: list[tuple[AccuracyPlan, Errors]] = []
    for plan in (*safe[: _MOST_TRIALS - 1], safe[-1]):
        errors = _tried(survey, plan, tolerance, progress)
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
        found = _tried(survey, other, tolerance, progress)
        if found.l1 <= tolerance and plans.index(other) < plans.index(plan):
            plan, errors = other, found
    return plan, True, errors


def _by_budget(
    survey: Survey, budget_ms: float, dragging: bool, progress: Progress
) -> tuple[AccuracyPlan, bool, Errors]:
    plans = _candidates(survey, _USUAL_TOLERANCE)
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
    """Cost in steps that are worth taking, and within a step how much is unlike the base.

    A rung that saves nothing to speak of is not taken down.
    """
    step = math.log(survey.forecast_ms(plan) + _NEGLIGIBLE_MS) / math.log(_WORTH_TAKING)
    return round(step), survey.rungs_down(plan)


def _reach_m(survey: Survey) -> float | None:
    """How far the sensor may move while a kept mask is better than the facing test."""
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
    """Errors on the frames to check on; on those to choose on, if they are too large there."""
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
