"""Long clips in stretches of frames, so that memory does not grow with their length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sd2core.presence import Presence
from sd2core.spectrum import DopplerMap
from sd2core.timebase import Timebase

LONGEST_FRAMES = 18_000
"""Of a stretch: ten minutes at 30 frames/s, whose maps are a few MB."""

Stretch = tuple[int, int]
"""Half-open, in frames of the clip."""


def stretches_of(frames: int, longest: int = LONGEST_FRAMES) -> list[Stretch]:
    """A clip in as few stretches as may be, of nearly equal lengths."""
    count = max(1, -(-frames // longest))
    edges = [frames * number // count for number in range(count + 1)]
    return [(edges[number], edges[number + 1]) for number in range(count)]


def joined(maps: Sequence[DopplerMap]) -> DopplerMap:
    """Maps that follow one another in time as one; what it says of itself is the first's.

    Parameters
    ----------
    maps : sequence of DopplerMap
        On one axis.
    """
    if len(maps) == 1:
        return maps[0]
    present = [Presence.of(one.present, len(one.timebase)).there for one in maps]
    return replace(
        maps[0],
        values=np.concatenate([one.values for one in maps], axis=1),
        timebase=Timebase(np.concatenate([one.times_s for one in maps])),
        present=np.concatenate(present),
        uncertainty=None,
    )
