"""What a scene requires, in words with numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from sd2core.accuracy.plans import AccuracyPlan
from sd2core.accuracy.results import Reason, percent
from sd2core.accuracy.trial import Trial
from sd2core.progress import Progress, silent


@dataclass(frozen=True)
class SceneFacts:
    """Of the sampled frames, all vertices counted alike.

    Parameters
    ----------
    still_share : float
        Vertices that never leave the nulled bins.
    beyond_share : float
        Velocities that lie beyond the axis.
    range_spread : float
        From the 5th to the 95th percentile of the ranges within a frame, relative
        to their median; median over frames.
    motion_bins : float
        By how many bins a velocity changes from one frame to the next; mean over
        the vertices that leave the nulled bins.
    empty : bool
        Nothing of what is seen leaves the nulled bins.
    """

    still_share: float
    beyond_share: float
    range_spread: float
    motion_bins: float
    empty: bool


def look_at(trial: Trial, progress: Progress = silent) -> SceneFacts:
    """Velocities and ranges of every vertex in the frames to choose on."""
    options = trial.options
    axis = options.axis
    synthesizer = trial.synthesizer(
        AccuracyPlan(visibility="none", weight=options.weight), progress=progress
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


def reasons_for(
    plan: AccuracyPlan,
    base: AccuracyPlan,
    change: Mapping[AccuracyPlan, float],
    facts: SceneFacts,
    v_max_mps: float,
) -> tuple[Reason, ...]:
    """Why a plan is what it is.

    Parameters
    ----------
    plan : AccuracyPlan
        The one chosen.
    base : AccuracyPlan
        The top of every rung but the frame rate.
    change : mapping
        Relative L1 after smoothing of what was tried: of plans that differ from
        ``base`` in one rung, and of frame rates.
    v_max_mps : float
        End of the axis.
    """
    found = [_static(facts)]
    if base.visibility != "none":
        found.append(_occlusion(plan, base, change))
        found += _mask_age(plan, base, change)
        found += _mask_reuse(plan, base, change)
        found += _geometry(plan, base, change)
    found += _range_law(plan, base, change, facts)
    found += [
        _aliasing(plan, base, change, facts, v_max_mps),
        _motion(plan, base, change, facts),
    ]
    return tuple(found)


def _static(facts: SceneFacts) -> Reason:
    if facts.empty:
        text = "this map is empty: nothing that is seen leaves the nulled bins"
        return Reason("static", False, facts.still_share, text)
    share = percent(facts.still_share)
    return Reason(
        "static",
        facts.still_share <= 0,
        facts.still_share,
        f"{share} of the vertices never leave the nulled bins: not modelled"
        if facts.still_share > 0
        else "every vertex leaves the nulled bins: all are modelled",
    )


def _occlusion(
    plan: AccuracyPlan, base: AccuracyPlan, change: Mapping[AccuracyPlan, float]
) -> Reason:
    facing = change[replace(base, visibility="facing")]
    every = change[replace(base, visibility="none")]
    # What no other visibility can do: inside a body the facing test hides all of it.
    needed = min(facing, every)
    text = f"what stands in between changes this map by {percent(needed)}"
    if plan.visibility == "exact":
        return Reason("occlusion", True, needed, f"{text}: occlusion is modelled exactly")
    if plan.visibility == "depth":
        at = change[replace(base, visibility="depth", depth_resolution=plan.depth_resolution)]
        how = f"a depth buffer of {plan.depth_resolution} pixels, off by {percent(at)}"
        return Reason("occlusion", True, needed, f"{text}: occlusion is modelled by {how}")
    if plan.visibility == "facing":
        text = f"what stands in between changes this map by {percent(facing)}"
        return Reason("occlusion", False, facing, f"{text}: occlusion is not modelled")
    return Reason(
        "occlusion", False, every, f"hidden vertices change this map by {percent(every)}: all count"
    )


def _mask_age(
    plan: AccuracyPlan, base: AccuracyPlan, change: Mapping[AccuracyPlan, float]
) -> list[Reason]:
    if plan.visibility not in ("depth", "exact") or plan.mask_reuse_m:
        return []
    if plan.mask_stride > 1:
        off = change[replace(base, mask_stride=plan.mask_stride)]
        text = (
            f"visibility of every {_ordinal(plan.mask_stride)} frame serves its neighbours: that"
            f" changes the map by {percent(off)}"
        )
        return [Reason("mask_age", False, off, text)]
    off = change[replace(base, mask_stride=2)]
    text = f"visibility of every 2nd frame changes the map by {percent(off)}: made for each frame"
    return [Reason("mask_age", True, off, text)]


def _mask_reuse(
    plan: AccuracyPlan, base: AccuracyPlan, change: Mapping[AccuracyPlan, float]
) -> list[Reason]:
    if plan.visibility not in ("depth", "exact"):
        return []
    tried = [other for other in change if other == replace(base, mask_reuse_m=other.mask_reuse_m)]
    reused = [other for other in tried if other.mask_reuse_m > 0]
    if not reused:
        return []
    if plan.mask_reuse_m:
        reused = [other for other in reused if other.mask_reuse_m == plan.mask_reuse_m] or reused
    widest = max(reused, key=lambda other: other.mask_reuse_m)
    off = change[widest]
    text = f"a mask kept while the sensor moves {widest.mask_reuse_m:g} m changes the map by"
    use = "kept" if plan.mask_reuse_m else "made anew at rest"
    return [Reason("mask_reuse", not plan.mask_reuse_m, off, f"{text} {percent(off)}: {use}")]


def _geometry(
    plan: AccuracyPlan, base: AccuracyPlan, change: Mapping[AccuracyPlan, float]
) -> list[Reason]:
    tried = sorted(
        (other for other in change if other == replace(base, vertices_kept=other.vertices_kept)),
        key=lambda other: -other.vertices_kept,
    )
    coarser = [other for other in tried if other.vertices_kept < 1]
    if not coarser:
        return []
    if plan.vertices_kept < 1:
        off = change[replace(base, vertices_kept=plan.vertices_kept)]
        text = f"{percent(plan.vertices_kept)} of the vertices change the map by {percent(off)}"
        return [Reason("geometry", False, off, f"{text}: they are enough")]
    off = change[coarser[0]]
    text = f"{percent(coarser[0].vertices_kept)} of the vertices change the map by {percent(off)}"
    return [Reason("geometry", True, off, f"{text}: the full mesh is used")]


def _range_law(
    plan: AccuracyPlan, base: AccuracyPlan, change: Mapping[AccuracyPlan, float], facts: SceneFacts
) -> list[Reason]:
    by_frame = replace(base, range_law="frame")
    if by_frame not in change:
        return []
    off = change[by_frame]
    text = (
        f"range varies by {percent(facts.range_spread)} over the body: the range law vertex by"
        f" vertex changes the map by {percent(off)}"
    )
    modelled = plan.range_law == "vertex"
    use = "modelled" if modelled else "one range per frame"
    return [Reason("range_law", modelled, off, f"{text}: {use}")]


def _aliasing(
    plan: AccuracyPlan,
    base: AccuracyPlan,
    change: Mapping[AccuracyPlan, float],
    facts: SceneFacts,
    v_max_mps: float,
) -> Reason:
    off = change[replace(base, beyond="drop")]
    if facts.beyond_share <= 0:
        text = f"no velocity passes {v_max_mps:g} m/s: aliasing does not matter"
        return Reason("aliasing", False, 0.0, text)
    text = (
        f"{percent(facts.beyond_share)} of the velocities pass {v_max_mps:g} m/s and change the"
        f" map by {percent(off)}"
    )
    wrapped = plan.beyond == "wrap"
    use = "aliasing matters, wrapped" if wrapped else "aliasing is left out, dropped"
    return Reason("aliasing", wrapped, off, f"{text}: {use}")


def _motion(
    plan: AccuracyPlan, base: AccuracyPlan, change: Mapping[AccuracyPlan, float], facts: SceneFacts
) -> Reason:
    off = change[replace(base, frame_rate_factor=1)]
    text = (
        f"velocities change by {facts.motion_bins:.2g} bins from frame to frame, which changes the"
        f" map by {percent(off)}"
    )
    if plan.frame_rate_factor == 1:
        return Reason("motion", False, off, f"{text}: one moment per frame is enough")
    use = f"frame rate raised {plan.frame_rate_factor} times"
    return Reason("motion", True, off, f"{text}: {use}")


def _ordinal(number: int) -> str:
    return f"{number}{ {2: 'nd', 3: 'rd'}.get(number, 'th') }"
