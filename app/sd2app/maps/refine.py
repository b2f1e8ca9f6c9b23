"""The background pass over a clip: rough where nothing is known, then as good as it gets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2app.background.latest import Emit
from sd2app.maps.partial_map import FINAL, ROUGH, View, pieces
from sd2core.doppler.synthesizer import Stretch, Synthesizer, Visibility
from sd2core.sensor import VirtualSensor

AT_ONCE = 12_000_000
"""Vertices times frames that are swept roughly in one go: a few ms up to some 20 ms."""
_EXACT_PARTS = 16
_ROUGH_WORDS = "preview: vertices facing the sensor"


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


Companion = Callable[[int, NDArray[np.float32]], Any]
"""Makes something more of a stretch, given its first frame and its values (bins, frames), in
the same background task."""


@dataclass(frozen=True, eq=False)
class Part:
    """A computed stretch on its way to the window.

    ``more`` is what a companion made of it.
    """

    sensor: VirtualSensor
    start: int
    stretch: Stretch
    rank: int
    words: str
    unit: str
    more: Any = None


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
