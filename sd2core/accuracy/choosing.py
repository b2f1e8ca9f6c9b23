"""Choice of the cheapest plan that holds a tolerance on a scene."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

from sd2core.accuracy.plans import FRAME_RATE_FACTORS, MASK_REUSE_M, AccuracyPlan, counting_plans
from sd2core.accuracy.reasons import reasons_for
from sd2core.accuracy.results import Choice, Errors
from sd2core.accuracy.survey import Survey, survey_scene
from sd2core.doppler.options import PRESETS, SynthesisOptions
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import Progress, silent
from sd2core.sensor import VirtualSensor

_MAX_TRIALS = 8
_MORE_TRIALS = 4

_BETTER = 0.7
"""Of a failed plan's forecast error, what that of the next one that is tried is at most."""

_SLACK = 1.5
"""Errors of single settings add up to more than a plan's error; by this factor at most."""


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
        Relative L1 of the whole clip's map after smoothing against the reference plan in
        double precision, as some frames tell of it.
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
    check_request(tolerance, budget_ms)
    if survey is None:
        survey = survey_scene(mesh, sensor, check_options(mesh, options), progress)
    tried: dict[AccuracyPlan, Errors] = {}
    if tolerance is not None:
        plan = _cheapest(survey, tolerance, tried, progress)
        holds = tried[plan].l1 <= tolerance
    else:
        assert budget_ms is not None
        plan = _most_accurate(survey, budget_ms, dragging, progress)
        holds = survey.forecast_ms(plan) <= budget_ms
        tried[plan] = survey.trial.errors(plan, progress=progress)
    return Choice(
        plan=plan,
        holds=holds,
        errors=tried[plan],
        cost_ms=survey.forecast_ms(plan),
        reasons=reasons_for(survey, plan, tried, tolerance),
        tolerance=tolerance,
        budget_ms=budget_ms,
        spent_s=time.perf_counter() - started,
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


def check_request(tolerance: float | None, budget_ms: float | None = None) -> None:
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


def _cheapest(
    survey: Survey, tolerance: float, tried: dict[AccuracyPlan, Errors], progress: Progress
) -> AccuracyPlan:
    """Cheapest plan that holds, else the one of smallest error.

    ``tried`` gets the errors of those that are not too far off on the frames to choose on already.
    """
    trial, sample = survey.trial, survey.trial.sample
    reference = trial.reference(sample.chosen_on, progress=progress)

    def holds(plan: AccuracyPlan) -> bool:
        if trial.columns(plan, sample.chosen_on, progress=progress).off(reference) > tolerance:
            return False
        tried[plan] = trial.errors(plan, progress=progress)
        return tried[plan].l1 <= tolerance

    most_accurate = replace(survey.base, frame_rate_factor=max(FRAME_RATE_FACTORS))
    if not trial.tells and holds(most_accurate):
        return most_accurate
    plans = sorted(_candidates(survey), key=survey.cost_key)
    forecast = {plan: survey.forecast_error(plan) for plan in plans}
    # What must hold if anything does.
    safest = min(plans, key=lambda plan: (forecast[plan], survey.settings_changed(plan)))

    def promising() -> Iterator[AccuracyPlan]:
        """Plans that should hold, cheapest first: if one fails, those hardly better would, too."""
        limit = tolerance
        for plan in plans:
            if forecast[plan] <= limit:
                yield plan
                limit = _BETTER * forecast[plan]

    to_try = (*islice(promising(), _MAX_TRIALS - 1), safest)
    safe_plan = next(filter(holds, to_try), None)
    if safe_plan is None:
        tried.setdefault(safest, trial.errors(safest, progress=progress))
        return min(tried, key=lambda plan: tried[plan].l1)
    # Changes do not quite add up: some of the cheaper plans may hold as well.
    cheaper = plans[: plans.index(safe_plan)]
    near = [plan for plan in cheaper if tolerance < forecast[plan] <= _SLACK * tolerance]
    near = sorted(near, key=forecast.__getitem__)[:_MORE_TRIALS]
    return min((safe_plan, *filter(holds, near)), key=plans.index)


def _most_accurate(
    survey: Survey, budget_ms: float, dragging: bool, progress: Progress
) -> AccuracyPlan:
    """Plan of smallest forecast error within a budget, else the fastest."""
    plans = _candidates(survey)
    reach_m = _reach_m(survey, progress) if dragging else None
    if reach_m is not None:
        plans += [
            replace(plan, mask_reuse_m=reach_m)
            for plan in plans
            if plan.visibility == "exact" and plan.mask_stride == 1
        ]

    def beyond_budget_then_error(plan: AccuracyPlan) -> tuple[float, float, tuple[int, int]]:
        cost_ms = max(survey.forecast_ms(plan), budget_ms)
        lowered = survey.forecast_error if survey.trial.tells else survey.settings_changed
        return cost_ms, lowered(plan), survey.cost_key(plan)

    return min(plans, key=beyond_budget_then_error)


def _reach_m(survey: Survey, progress: Progress) -> float | None:
    """Longest move of the sensor after which a kept mask is better than the facing test."""
    base, trial = survey.base, survey.trial
    if base.visibility != "exact":
        return None
    runs, against = trial.sample.chosen_on, None
    for done, reach_m in enumerate(sorted(MASK_REUSE_M, reverse=True)):
        progress(done, len(MASK_REUSE_M))
        plan = replace(base, mask_reuse_m=reach_m)
        if plan not in survey.change:
            against = against or trial.columns(base, runs, progress=progress).twice()
            columns = trial.columns(plan, runs, progress=progress)
            survey.change[plan] = columns.off(against)
        if survey.change[plan] < survey.change[replace(base, visibility="facing")]:
            return reach_m
    return None


def _candidates(survey: Survey) -> list[AccuracyPlan]:
    """Plans to choose from; all wrap: that costs nothing, and more may be beyond elsewhere."""
    options = survey.trial.options
    # What changes least is left out first.
    parts = sorted(
        survey.trial.scene_parts,
        key=lambda part: survey.change[replace(survey.base, left_out=(part,))],
    )
    return [
        replace(plan, left_out=tuple(parts[:count]))
        for count in range(len(parts) + 1)
        for plan in counting_plans(
            options.weight,
            surface=survey.base.visibility != "none",
            range_law=options.range_exponent > 0,
            vertices_kept=survey.trial.vertices_kept,
        )
    ]
