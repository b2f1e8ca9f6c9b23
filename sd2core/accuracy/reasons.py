"""Reasons for the settings of a plan, in words with numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from sd2core.accuracy.plans import MASK_REUSE_M, AccuracyPlan
from sd2core.accuracy.results import Errors, Reason
from sd2core.accuracy.survey import Survey
from sd2core.numerics.map_accuracy import percent
from sd2core.options.synthesis import Visibility


def reasons_for(
    survey: Survey,
    plan: AccuracyPlan,
    tried: Mapping[AccuracyPlan, Errors],
    tolerance: float | None,
) -> tuple[Reason, ...]:
    """Explain the settings of a chosen plan.

    Where a setting alone would be within the tolerance and is not lowered, or the reverse, the
    sentence says what decided.

    Parameters
    ----------
    survey : Survey
        Of the scene that the plan was chosen for.
    plan : AccuracyPlan
        The chosen one.
    tried : mapping of AccuracyPlan to Errors
        Errors of the plan and of others that were tried.
    tolerance : float or None
        Relative L1 after smoothing; None where a budget decided.
    """
    base, facts, change = survey.base, survey.facts, survey.change
    reasons: list[Reason] = []

    def add(setting: str, modelled: bool, value: float, text: str, **lowered: Any) -> None:
        """Add a reason; ``lowered`` are the settings without what it is about."""
        if lowered and tolerance is not None and modelled == (value <= tolerance):
            text += _because(survey, plan, tried, tolerance, replace(plan, **lowered), modelled)
        reasons.append(Reason(setting, modelled, value, text))

    def alone(**setting: Any) -> float:
        return change[replace(base, **setting)]

    share = facts.still_share
    still = f"{percent(share)} of the vertices never leave the nulled bins: not modelled"
    if facts.empty:
        still = "this map is empty: nothing that is seen leaves the nulled bins"
    elif share <= 0:
        still = "every vertex leaves the nulled bins: all are modelled"
    add("static", not facts.empty and share <= 0, share, still)
    if base.visibility != "none":
        facing, every = alone(visibility="facing"), alone(visibility="none")
        # Inside a body the facing test hides all of it: what no cheaper visibility can do.
        needed = {"none": every, "facing": facing}.get(plan.visibility, min(facing, every))
        between = f"what stands in between changes this map by {percent(needed)}: occlusion is"
        if plan.visibility == "none":
            sight = f"hidden vertices change this map by {percent(needed)}: all count"
        elif plan.visibility == "facing":
            sight = f"{between} not modelled"
        elif plan.visibility == "exact":
            sight = f"{between} modelled exactly"
        else:
            pixels = plan.depth_resolution
            apart = percent(alone(visibility="depth", depth_resolution=pixels))
            sight = f"{between} modelled by a depth buffer of {pixels} pixels, off by {apart}"
        occluded, kept_m = plan.visibility in ("depth", "exact"), plan.mask_reuse_m
        less: Visibility = "facing" if facing <= every else "none"
        without = {"visibility": less, "depth_resolution": base.depth_resolution}
        add("occlusion", occluded, needed, sight, mask_stride=1, mask_reuse_m=0.0, **without)
        if occluded and not kept_m:
            stride = max(plan.mask_stride, 2)
            off = alone(mask_stride=stride)
            of = f"visibility of every {_ordinal(stride)} frame"
            age = f"{of} changes the map by {percent(off)}: made for each frame"
            if plan.mask_stride > 1:
                age = f"{of} serves its neighbours: that changes the map by {percent(off)}"
            add("mask_age", plan.mask_stride == 1, off, age, mask_stride=stride)
        reaches_m = [reach for reach in MASK_REUSE_M if replace(base, mask_reuse_m=reach) in change]
        if occluded and reaches_m:
            reach_m = kept_m or max(reaches_m)
            off = alone(mask_reuse_m=reach_m)
            reused = (
                f"a mask kept while the sensor moves {reach_m:g} m changes the map by"
                f" {percent(off)}: {'kept' if kept_m else 'made again at rest'}"
            )
            add("mask_reuse", not kept_m, off, reused)
    shares = [share for share in survey.trial.vertices_kept if share < 1]
    if shares:
        whole = plan.vertices_kept == 1
        share = max(shares) if whole else plan.vertices_kept
        off = alone(vertices_kept=share)
        fewer = (
            f"{percent(share)} of the vertices change the map by {percent(off)}:"
            f" {'the full mesh is used' if whole else 'they are enough'}"
        )
        add("geometry", whole, off, fewer, vertices_kept=share)
    if replace(base, range_law="frame") in change:
        modelled, off = plan.range_law == "vertex", alone(range_law="frame")
        law = (
            f"range varies by {percent(facts.range_spread)} over the body: the range law vertex by"
            f" vertex changes the map by {percent(off)}:"
            f" {'modelled' if modelled else 'one range per frame'}"
        )
        add("range_law", modelled, off, law, range_law="frame")
    for part in survey.trial.scene_parts:
        modelled, off = part not in plan.left_out, alone(left_out=(part,))
        what, verb = (f"the {part}", "changes") if part == "beam" else (part, "change")
        use = "modelled" if modelled else "not modelled"
        if tolerance is not None and not modelled:
            use += f" at a tolerance of {percent(tolerance)}"
        use = f"{what} {verb} this map by {percent(off)}: {use}"
        add(part, modelled, off, use, left_out=(*plan.left_out, part))
    if (off_alone := survey.others_change) is not None:
        people = f"other people change this map by {percent(off_alone)}: modelled"
        reasons.append(Reason("people", True, off_alone, people))
    edge_mps = survey.trial.options.axis.v_max_mps
    if facts.beyond_share <= 0:
        add(
            "aliasing", False, 0.0, f"no velocity passes {edge_mps:g} m/s: aliasing does not matter"
        )
    else:
        off = alone(beyond="drop")
        matters = tolerance is None or off > tolerance
        use = "aliasing matters, wrapped" if matters else "wrapped, which costs nothing"
        passed = (
            f"{percent(facts.beyond_share)} of the velocities pass {edge_mps:g} m/s and change the"
            f" map by {percent(off)}: {use}"
        )
        add("aliasing", True, off, passed)
    factor, off = plan.frame_rate_factor, alone(frame_rate_factor=1)
    use = "one moment per frame is enough" if factor == 1 else f"frame rate raised {factor} times"
    motion = (
        f"velocities change by {facts.motion_bins:.2g} bins from frame to frame, which changes the"
        f" map by {percent(off)}: {use}"
    )
    add("motion", factor > 1, off, motion, frame_rate_factor=1)
    return tuple(reasons)


def _because(
    survey: Survey,
    plan: AccuracyPlan,
    tried: Mapping[AccuracyPlan, Errors],
    tolerance: float,
    lower: AccuracyPlan,
    modelled: bool,
) -> str:
    """Clause for a change that alone would have decided the other way."""
    if not modelled:
        off = percent(tried[plan].l1)
        return f", but with the rest of the plan the map is off by {off} only"
    if not survey.trial.tells:
        return ", since more may move in frames that were not tried"
    held = f"the tolerance of {percent(tolerance)}"
    if tried[plan].l1 > tolerance:
        return f", since no plan holds {held}"
    if survey.cost_key(lower) >= survey.cost_key(plan):
        return ", since less would save nothing"
    error = tried[lower].l1 if lower in tried else survey.forecast_error(lower)
    if error > tolerance:
        return f", since less would be over {held} with the rest of the plan: {percent(error)}"
    return ", since of the plans with less none that was tried holds"


def _ordinal(number: int) -> str:
    return f"{number}{ {2: 'nd', 3: 'rd'}.get(number, 'th') }"
