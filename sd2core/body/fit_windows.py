"""Windows in which a long clip is fitted, and the blending of their poses."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sd2core.body.array_store import ArrayStore
from sd2core.body.evidence import Evidence
from sd2core.body.initial import Pose
from sd2core.body.rig import JOINTS
from sd2core.body.rotations import from_vector, to_vector, transposed
from sd2core.mesh.presence import runs

_WINDOW_FRAMES = 600
_OVERLAP_FRAMES = 60
"""Less than half of any window: no frame is in three of them."""

_EVIDENCE = ("slopes", "depth_m", "trunk_m")
"""Arrays by which a kept window is known to be fitted to the same evidence."""


class Windows:
    """The pose of a clip, fitted window by window, and kept in a store as they come.

    ``spans`` holds of each window its start, its stop and the frames shared with the one before.
    """

    def __init__(self, present: NDArray[np.bool_], store: ArrayStore) -> None:
        self.spans = [span for stretch in runs(present) for span in _windows(*stretch)]
        self._present, self._store = present, store
        self._pose = Pose(np.empty((len(present), len(JOINTS), 3, 3)), np.empty((len(present), 3)))
        self._done = 0

    def keep(self, part: Evidence, pose: Pose) -> None:
        """Keep the pose that was found for the next window's evidence."""
        evidence = {name: getattr(part, name) for name in _EVIDENCE}
        self._store.write(_name(self._done), evidence | pose._asdict())
        self._lay(pose)

    def resumed(self, part: Evidence) -> bool:
        """True if an earlier run has finished the next window, with the same evidence."""
        kept = self._store.read(_name(self._done))
        if kept is None or not {*_EVIDENCE, *Pose._fields} <= kept.keys():
            return False
        if not all(np.array_equal(kept[name], getattr(part, name)) for name in _EVIDENCE):
            return False
        self._lay(Pose(*(kept[name] for name in Pose._fields)))
        return True

    def pose(self) -> Pose:
        """The pose in every frame; empty ones hold the last known pose, those before it the first.

        All windows must be kept.
        """
        known, empty = np.flatnonzero(self._present), np.flatnonzero(~self._present)
        held = known[(np.searchsorted(known, empty) - 1).clip(0)]
        for values in self._pose:
            values[empty] = values[held]
        return self._pose

    def _lay(self, fitted: Pose) -> None:
        """Write the next window's pose, blended with the one before where they overlap."""
        start, stop, overlap = self.spans[self._done]
        turns, translation_m = self._pose
        if overlap:
            shared = slice(start, start + overlap)
            share = np.linspace(0.0, 1.0, overlap + 2)[1:-1]
            share = share**3 * (10.0 + share * (6.0 * share - 15.0))  # no kink in velocity
            other = fitted.at(slice(0, overlap))
            between = to_vector(transposed(turns[shared]) @ other.turns)
            turns[shared] = turns[shared] @ from_vector(share[:, None, None] * between)
            translation_m[shared] += share[:, None] * (other.translation_m - translation_m[shared])
        own = slice(start + overlap, stop)
        turns[own], translation_m[own] = fitted.at(slice(overlap, None))
        self._done += 1


def _name(number: int) -> str:
    return f"pose-{number:05d}.npz"


def _windows(start: int, stop: int) -> Iterator[tuple[int, int, int]]:
    """Windows (start, stop, frames shared with the one before) of one stretch."""
    step = _WINDOW_FRAMES - _OVERLAP_FRAMES
    count = max(-(-(stop - start - _OVERLAP_FRAMES) // step), 1)
    size = -(-(stop - start + (count - 1) * _OVERLAP_FRAMES) // count)
    for number in range(count):
        first = start + number * (size - _OVERLAP_FRAMES)
        yield first, min(first + size, stop), _OVERLAP_FRAMES if number else 0
