"""Which way frames are worked out: as a hand needs them, or as the tolerance asks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from sd2app.accuracy.text import InUse, deviation, short
from sd2app.maps.partial_map import AS_DRAGGED, FINAL
from sd2app.maps.refine import Way
from sd2app.maps.synthesizers import Carriers
from sd2core.sensor import VirtualSensor

if TYPE_CHECKING:
    from sd2core.accuracy.plans import AccuracyPlan

_MAP_BUDGET_MS = 15.0
"""For one map while a hand moves the sensor and the video plays: 20 of them a second, with most
of the time left to drawing."""


def budget_ms(frames: int) -> float:
    """Per frame, in steps, so that a little zooming asks for no other plan."""
    steps = math.ceil(2 * math.log2(max(frames, 1)))
    return float(_MAP_BUDGET_MS / 2 ** (steps / 2))


def distance_m(one: VirtualSensor | None, other: VirtualSensor) -> float:
    """How far two places are from each other; infinity without the first."""
    return math.inf if one is None else math.dist(one.position_m, other.position_m)


def rough_way(
    carriers: Carriers, plan: AccuracyPlan | None, dragging: InUse | None, moved_m: float
) -> Way:
    """For a moving sensor, and where nothing is known yet.

    Parameters
    ----------
    plan : AccuracyPlan or None
        In use at rest: its masks serve until one for dragging is known.
    dragging : InUse or None
    moved_m : float
        From where masks for dragging were made.
    """
    carrier = carriers.ready(dragging.plan) if dragging is not None else None
    if dragging is not None and carrier is not None:
        words = f"while dragging: {short(dragging.plan)}, {deviation(dragging.error)}"
        if dragging.plan.mask_reuse_m == 0:
            return Way(lambda: carrier, AS_DRAGGED, words)
        if moved_m <= dragging.plan.mask_reuse_m:
            return Way(lambda: carrier, AS_DRAGGED, words, "frozen")
    newest = carriers.ready(plan) or carriers.full
    if carriers.options.visibility == "none":
        return Way(lambda: newest, AS_DRAGGED, "all vertices of the point cloud", "none")
    if dragging is not None:
        return Way(lambda: newest, AS_DRAGGED, "preview: vertices facing the sensor", "facing")
    return Way(lambda: newest, AS_DRAGGED, "preview: visibility of the nearest place", "frozen")


def final_way(carriers: Carriers, plan: AccuracyPlan | None, in_use: InUse | None) -> Way:
    """As the plan says; without one, as well as it gets."""
    return Way(lambda: carriers.of(plan), FINAL, final_words(carriers, in_use))


def final_words(carriers: Carriers, in_use: InUse | None) -> str:
    """What a map of the plan in use is worth."""
    if in_use is not None:
        return f"{short(in_use.plan)}, {deviation(in_use.error)}"
    cloud = carriers.options.visibility == "none"
    return "all vertices of the point cloud" if cloud else "exact visibility"
