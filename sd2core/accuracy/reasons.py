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
        setting: str, modelled: bool, value: float, text: str, lower: AccuracyPlan | None = None
    ) -> None:
        text += _because(chosen, modelled, value, lower)
        found.append(Reason(setting, modelled, value, text))

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
        occluded = plan.visibility in ("depth", "exact")
        less: Visibility = "facing" if facing <= every else "none"
        lower = replace(plan, visibility=less, mask_stride=1, mask_reuse_m=0.0)
        add("occlusion", occluded, needed, sight, lower)
        if occluded and not plan.mask_reuse_m:
            stride = max(plan.mask_stride, 2)
            off = alone(mask_stride=stride)
            of = f"visibility of every {_ordinal(stride)} frame"
            age = f"{of} changes the map by {percent(off)}: made for each frame"
            if plan.mask_stride > 1:
                age = f"{of} serves its neighbours: that changes the map by {percent(off)}"
            add("mask_age", plan.mask_stride == 1, off, age, replace(plan, mask_stride=stride))
        reaches_m = [
            other.mask_reuse_m
            for other in change
            if other.mask_reuse_m > 0 and other == replace(base, mask_reuse_m=other.mask_reuse_m)
        ]
        if occluded and reaches_m:
            kept = plan.mask_reuse_m
            reach_m = kept if kept in reaches_m else max(reaches_m)
            off = alone(mask_reuse_m=reach_m)
            reused = (
                f"a mask kept while the sensor moves {reach_m:g} m changes the map by"
                f" {percent(off)}: {'kept' if kept else 'made again at rest'}"
            )
            add("mask_reuse", not kept, off, reused)
        shares = [
            other.vertices_kept
            for other in change
            if other.vertices_kept < 1 and other == replace(base, vertices_kept=other.vertices_kept)
        ]
        if shares:
            whole = plan.vertices_kept == 1
            share = max(shares) if whole else plan.vertices_kept
            off = alone(vertices_kept=share)
            fewer = (
                f"{percent(share)} of the vertices change the map by {percent(off)}:"
                f" {'the full mesh is used' if whole else 'they are enough'}"
            )
            add("geometry", whole, off, fewer, replace(plan, vertices_kept=share))
    if replace(base, range_law="frame") in change:
        modelled, off = plan.range_law == "vertex", alone(range_law="frame")
        law = (
            f"range varies by {percent(facts.range_spread)} over the body: the range law vertex by"
            f" vertex changes the map by {percent(off)}:"
            f" {'modelled' if modelled else 'one range per frame'}"
        )
        add("range_law", modelled, off, law, replace(plan, range_law="frame"))
    if facts.beyond_share <= 0:
        passed = f"no velocity passes {v_max_mps:g} m/s: aliasing does not matter"
        add("aliasing", False, 0.0, passed)
    else:
        off = alone(beyond="drop")
        matters = chosen.tolerance is None or off > chosen.tolerance
        use = "aliasing matters, wrapped" if matters else "wrapped, which costs nothing"
        if plan.beyond != "wrap":
            use = "aliasing is left out, dropped"
        passed = (
            f"{percent(facts.beyond_share)} of the velocities pass {v_max_mps:g} m/s and change the"
            f" map by {percent(off)}: {use}"
        )
        add("aliasing", plan.beyond == "wrap", off, passed)
    factor, off = plan.frame_rate_factor, alone(frame_rate_factor=1)
    use = "one moment per frame is enough" if factor == 1 else f"frame rate raised {factor} times"
    motion = (
        f"velocities change by {facts.motion_bins:.2g} bins from frame to frame, which changes the"
        f" map by {percent(off)}: {use}"
    )
    add("motion", factor > 1, off, motion, replace(plan, frame_rate_factor=1))
    return tuple(found)


def _ordinal(number: int) -> str:
    return f"{number}{ {2: 'nd', 3: 'rd'}.get(number, 'th') }"
