"""Which way frames are worked out: as a hand needs them, or as the tolerance asks."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sd2app.accuracy.text import InUse, deviation, short
from sd2app.background.latest import Emit
from sd2app.maps.partial_map import AS_DRAGGED, FINAL, ROUGH, Part, View, pieces
from sd2app.maps.synthesizers import Carriers
from sd2core.doppler.synthesizer import Synthesizer, Visibility
from sd2core.sensor import VirtualSensor

if TYPE_CHECKING:
    from sd2core.accuracy.plans import AccuracyPlan

_MAP_BUDGET_MS = 15.0
"""For one map while a hand moves the sensor and the video plays: 20 of them a second, with most
of the time left to drawing."""

AT_ONCE = 12_000_000
"""Vertices times frames that are swept roughly in one go: a few ms up to some 20 ms."""
_EXACT_PARTS = 16
_ROUGH_WORDS = "preview: vertices facing the sensor"
Companion = Callable[[int, NDArray[np.float32]], Any]
"""Makes something more of a stretch, given its first frame and its values (bins, frames), in
the same background task."""


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


@dataclass(frozen=True, eq=False)
class Way:
    """How frames are worked out.

    Parameters
    ----------
    synthesizer : callable
        Gives the synthesizer; the first call may take long.
    rank : int
        What the frames are worth.
    words : str
        The same for people.
    visibility : str, optional
        Otherwise that of the synthesizer's options.
    """

    synthesizer: Callable[[], Synthesizer]
    rank: int
    words: str
    visibility: Visibility | None = None


def worked_out(
    way: Way,
    sensor: VirtualSensor,
    start: int,
    stop: int,
    proceed: Callable[[], None] = lambda: None,
    companion: Companion | None = None,
) -> Part:
    """Frames ``start`` to ``stop``; ``proceed`` is called on the way and may raise."""
    synthesizer = way.synthesizer()
    stretch = synthesizer.stretch(sensor, start, stop, way.visibility, lambda *_: proceed())
    rank, words = way.rank, way.words
    if way.visibility == "frozen" and stretch.quality == "facing":
        # No mask is kept.
        rank, words = ROUGH, _ROUGH_WORDS
    more = companion(start, stretch.values) if companion is not None else None
    return Part(sensor, start, stretch, rank, words, synthesizer.unit, more)


def is_swept_whole(vertices: int, frames: int) -> bool:
    """Whether a clip is so short that a hand moves all of it, not only what is in view."""
    return vertices * frames <= AT_ONCE


def refine(
    sensor: VirtualSensor,
    rank: NDArray[np.uint8],
    view: View,
    rough: Way,
    final: Way | None,
    vertices: int,
    emit: Emit,
    *,
    only_view: bool = False,
) -> None:
    """Raise the rank of every frame, what is in view first.

    Parameters
    ----------
    rank : uint8 array, shape (T,)
        What is known already; raised in place.
    view : tuple of int
        Frames on screen: these first, then those that follow, then those before.
    rough : Way
        For frames of which nothing is known.
    final : Way, optional
        What every frame ends as; None stops at rough ones.
    vertices : int
        How many the mesh has: decides how much is done at once.
    emit : callable
        Receives each :class:`Part`, and ``(done, total)`` frames; raises to stop.
    only_view : bool
        Leave the others for later.
    """
    rough_size = max(AT_ONCE // vertices, 64)
    final_size = min(max(len(rank) // _EXACT_PARTS, 8), max(rough_size // 16, 8))
    done, total = 0, int((rank < FINAL).sum())

    def run(below: int, part: View, size: int, way: Way) -> None:
        nonlocal done
        for start, stop in pieces(rank, below, *part, size):
            made = worked_out(way, sensor, start, stop, lambda: emit(None))
            rank[start:stop] = made.rank
            emit(made)
            if way.rank == FINAL:
                done += stop - start
                emit((done, total))

    others = () if only_view else ((view[1], len(rank)), (0, view[0]))
    for part in (view, *others):
        if rough.rank < FINAL:
            run(ROUGH, part, rough_size, rough)
        if final is not None:
            run(FINAL, part, final_size, final)
