"""Reasons for the settings of a plan, in words with numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sd2core.accuracy.plans import AccuracyPlan
from sd2core.accuracy.results import Reason
from sd2core.accuracy.trial import Trial
from sd2core.doppler.options import Visibility
from sd2core.numerics.map_accuracy import percent
from sd2core.progress import Progress, silent


@dataclass(frozen=True)
class Chosen:
    """Chosen plan, and what decided for it."""

    plan: AccuracyPlan
    holds: bool
    error: float  # of its map, relative L1 after smoothing
    tolerance: float | None  # None where a budget decided
    lowered: Callable[[AccuracyPlan], float | None] = lambda lower: None
    """Error of the plan with one setting lowered; None if that saves nothing."""


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


def scene_facts(trial: Trial, progress: Progress = silent) -> SceneFacts:
    """Collect velocities and ranges of every vertex in the frames to choose on."""
    options = trial.options
    axis = options.axis
    synthesizer = trial.synthesizer(
        AccuracyPlan(visibility="none", weight=options.weight),
        runs=trial.sample.chosen_on,
        progress=progress,
    )
    live = np.zeros(synthesizer.mesh.vertex_count, np.bool_)
    beyond: list[float] = []
    spreads: list[float] = []
    changes: list[float] = []
    nulled = np.array([bin_number in options.null_bins for bin_number in range(axis.bins)])
    for run in trial.sample.chosen_on:
        before = None
        for frame in range(run.start, run.stop):
            progress(frame - run.start, run.stop - run.start)
            if not synthesizer.mesh.presence.measured[frame]:
                before = None
                continue
            seen = synthesizer.frame(trial.sensor, frame, "none")
            place = np.floor((seen.velocity_mps / axis.v_max_mps + 1) * 0.5 * axis.bins)
            outside = np.abs(seen.velocity_mps) > axis.v_max_mps
            moves = outside | ~nulled[np.clip(place, 0, axis.bins - 1).astype(int)]
            live |= moves
            beyond.append(float(outside.mean()))
            low, middle, high = np.percentile(seen.range_m, (5, 50, 95))
            spreads.append(float((high - low) / middle) if middle > 0 else 0.0)
            if before is not None and moves.any():
                step_mps = np.abs(seen.velocity_mps - before)[moves]
                changes.append(float(step_mps.mean()) / axis.bin_width_mps)
            before = seen.velocity_mps
    return SceneFacts(
        still_share=1.0 - float(live.mean()),
        beyond_share=float(np.mean(beyond)) if beyond else 0.0,
        range_spread=float(np.median(spreads)) if spreads else 0.0,
        motion_bins=float(np.mean(changes)) if changes else 0.0,
        empty=not trial.reference(trial.sample.chosen_on).raw.any(),
    )


_SENTENCES = {
    "empty": "this map is empty: nothing that is seen leaves the nulled bins",
    "some still": "{value} of the vertices never leave the nulled bins: not modelled",
    "none still": "every vertex leaves the nulled bins: all are modelled",
    "occlusion exact": "{between}: occlusion is modelled exactly",
    "occlusion depth": (
        "{between}: occlusion is modelled by a depth buffer of {pixels} pixels, off by {off}"
    ),
    "occlusion facing": "{between}: occlusion is not modelled",
    "occlusion none": "hidden vertices change this map by {value}: all count",
    "mask of each frame": (
        "visibility of every 2nd frame changes the map by {value}: made for each frame"
    ),
    "mask of some frames": (
        "visibility of every {ordinal} frame serves its neighbours: that changes the map by {value}"
    ),
    "mask reused": (
        "a mask kept while the sensor moves {reach_m:g} m changes the map by {value}: {use}"
    ),
    "geometry": "{share} of the vertices change the map by {value}: {use}",
    "range law": (
        "range varies by {spread} over the body: the range law vertex by vertex changes the map by"
        " {value}: {use}"
    ),
    "no aliasing": "no velocity passes {v_max_mps:g} m/s: aliasing does not matter",
    "aliasing": (
        "{beyond} of the velocities pass {v_max_mps:g} m/s and change the map by {value}: {use}"
    ),
    "motion": (
        "velocities change by {bins:.2g} bins from frame to frame, which changes the map by"
        " {value}: {use}"
    ),
}


def _because(chosen: Chosen, modelled: bool, value: float, lower: AccuracyPlan | None) -> str:
    """Clause for a change that alone would have decided the other way, else nothing."""
    tolerance = chosen.tolerance
    if tolerance is None or lower is None or modelled != (value <= tolerance):
        return ""
    if not modelled:
        return f", but with the rest of the plan the map is off by {percent(chosen.error)} only"
    held = f"the tolerance of {percent(tolerance)}"
    if not chosen.holds:
        return f", since no plan holds {held}"
    error = chosen.lowered(lower)
    if error is None:
        return ", since less would save nothing"
    if error > tolerance:
        return f", since less would be over {held} with the rest of the plan: {percent(error)}"
    return ", since of the plans with less none that was tried holds"


def reasons_for(
    chosen: Chosen,
    base: AccuracyPlan,
    change: Mapping[AccuracyPlan, float],
    facts: SceneFacts,
    v_max_mps: float,
) -> tuple[Reason, ...]:
    """Explain the settings of a chosen plan.

    Where a setting alone would be within the tolerance and is not lowered, or the reverse, the
    sentence says what decided. ``base`` and ``change`` are those of
    :class:`~sd2core.accuracy.choosing.Survey`; ``v_max_mps`` is the end of the axis.
    """
    found: list[Reason] = []
    plan = chosen.plan

    def add(
        setting: str,
        modelled: bool,
        value: float,
        key: str,
        lower: AccuracyPlan | None = None,
        **numbers: object,
    ) -> None:
        text = _SENTENCES[key].format(value=percent(value), **numbers)
        text += _because(chosen, modelled, value, lower)
        found.append(Reason(setting, modelled, value, text))

    def alone(**setting: Any) -> float:
        return change[replace(base, **setting)]

    still = "empty" if facts.empty else "some still" if facts.still_share > 0 else "none still"
    add("static", not facts.empty and facts.still_share <= 0, facts.still_share, still)
    if base.visibility != "none":
        facing, every = alone(visibility="facing"), alone(visibility="none")
        # Inside a body the facing test hides all of it: what no cheaper visibility can do.
        needed = {"none": every, "facing": facing}.get(plan.visibility, min(facing, every))
        numbers = {"between": f"what stands in between changes this map by {percent(needed)}"}
        if plan.visibility == "depth":
            pixels = plan.depth_resolution
            off = alone(visibility="depth", depth_resolution=pixels)
            numbers |= {"pixels": str(pixels), "off": percent(off)}
        occluded = plan.visibility in ("depth", "exact")
        less: Visibility = "facing" if facing <= every else "none"
        lower = replace(plan, visibility=less, mask_stride=1, mask_reuse_m=0.0)
        add("occlusion", occluded, needed, f"occlusion {plan.visibility}", lower, **numbers)
        if occluded and not plan.mask_reuse_m:
            stride = plan.mask_stride
            key = "mask of some frames" if stride > 1 else "mask of each frame"
            off = alone(mask_stride=stride if stride > 1 else 2)
            lower = replace(plan, mask_stride=max(stride, 2))
            add("mask_age", stride == 1, off, key, lower, ordinal=_ordinal(stride))
        reaches_m = [
            other.mask_reuse_m
            for other in change
            if other.mask_reuse_m > 0 and other == replace(base, mask_reuse_m=other.mask_reuse_m)
        ]
        if occluded and reaches_m:
            kept = plan.mask_reuse_m
            reach_m = kept if kept in reaches_m else max(reaches_m)
            use = "kept" if kept else "made again at rest"
            off = alone(mask_reuse_m=reach_m)
            add("mask_reuse", not kept, off, "mask reused", reach_m=reach_m, use=use)
        shares = [
            other.vertices_kept
            for other in change
            if other.vertices_kept < 1 and other == replace(base, vertices_kept=other.vertices_kept)
        ]
        if shares:
            whole = plan.vertices_kept == 1
            share = max(shares) if whole else plan.vertices_kept
            use = "the full mesh is used" if whole else "they are enough"
            off = alone(vertices_kept=share)
            lower = replace(plan, vertices_kept=share)
            add("geometry", whole, off, "geometry", lower, share=percent(share), use=use)
    if replace(base, range_law="frame") in change:
        modelled = plan.range_law == "vertex"
        use = "modelled" if modelled else "one range per frame"
        spread = percent(facts.range_spread)
        off, lower = alone(range_law="frame"), replace(plan, range_law="frame")
        add("range_law", modelled, off, "range law", lower, spread=spread, use=use)
    if facts.beyond_share <= 0:
        add("aliasing", False, 0.0, "no aliasing", v_max_mps=v_max_mps)
    else:
        wrapped = plan.beyond == "wrap"
        beyond, off = percent(facts.beyond_share), alone(beyond="drop")
        matters = chosen.tolerance is None or off > chosen.tolerance
        use = "aliasing matters, wrapped" if matters else "wrapped, which costs nothing"
        use = use if wrapped else "aliasing is left out, dropped"
        add("aliasing", wrapped, off, "aliasing", beyond=beyond, v_max_mps=v_max_mps, use=use)
    factor = plan.frame_rate_factor
    use = "one moment per frame is enough" if factor == 1 else f"frame rate raised {factor} times"
    off = alone(frame_rate_factor=1)
    lower = replace(plan, frame_rate_factor=1)
    add("motion", factor > 1, off, "motion", lower, bins=facts.motion_bins, use=use)
    return tuple(found)


def _ordinal(number: int) -> str:
    return f"{number}{ {2: 'nd', 3: 'rd'}.get(number, 'th') }"
