"""The background pass over a clip: rough where nothing is known, then as good as it gets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2app.jobs.latest import Emit
from sd2app.models.canvas import FINAL, RANK, View, pieces
from sd2core.doppler.synthesizer import Stretch, Synthesizer, Visibility
from sd2core.sensor import VirtualSensor

AT_ONCE = 12_000_000
"""Vertices times frames that are swept roughly in one go: a few ms up to some 20 ms."""
_EXACT_PARTS = 16


@dataclass(frozen=True, eq=False)
class Part:
    """A computed stretch on its way to the window."""

    synthesizer: Synthesizer
    sensor: VirtualSensor
    start: int
    stretch: Stretch


def sweep(
    synthesizer: Synthesizer, sensor: VirtualSensor, view: View, visibility: Visibility
) -> Part:
    """One rough pass: over the whole clip when it is short, else over what is in view."""
    frames = synthesizer.mesh.frame_count
    whole = synthesizer.mesh.vertex_count * frames <= AT_ONCE
    start, stop = (0, frames) if whole else view
    return Part(synthesizer, sensor, start, synthesizer.stretch(sensor, start, stop, visibility))


def refine(
    synthesizer: Synthesizer,
    sensor: VirtualSensor,
    rank: NDArray[np.uint8],
    view: View,
    rough: Visibility,
    *,
    to_the_end: bool,
    emit: Emit,
) -> None:
    """Raise the rank of every frame, what is in view first.

    Parameters
    ----------
    rank : uint8 array, shape (T,)
        What is known already; raised in place.
    view : tuple of int
        Frames on screen: these first, then those that follow, then those before.
    rough : Visibility
        For frames of which nothing is known.
    to_the_end : bool
        Go on to the visibility of the synthesizer's options.
    emit : callable
        Receives each :class:`Part`, and ``(done, total)`` frames; raises to stop.
    """
    final = synthesizer.options.visibility
    rough_size = max(AT_ONCE // synthesizer.mesh.vertex_count, 64)
    final_size = min(max(len(rank) // _EXACT_PARTS, 8), max(rough_size // 16, 8))
    done, total = 0, int((rank < FINAL).sum())

    def run(below: int, part: View, size: int, visibility: Visibility) -> None:
        nonlocal done
        for start, stop in pieces(rank, below, *part, size):
            stretch = synthesizer.stretch(sensor, start, stop, visibility, lambda *_: emit(None))
            rank[start:stop] = RANK[stretch.quality]
            emit(Part(synthesizer, sensor, start, stretch))
            if visibility == final:
                done += stop - start
                emit((done, total))

    for part in (view, (view[1], len(rank)), (0, view[0])):
        if rough != final:
            run(RANK["facing"], part, rough_size, rough)
        if to_the_end:
            run(FINAL, part, final_size, final)
