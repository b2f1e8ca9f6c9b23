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
    """Poses of a clip, fitted window by window, and kept in a store as they come.

    ``spans`` holds of each window its start, its stop and the frames shared with the one before.
    """

    def __init__(self, present: NDArray[np.bool_], store: ArrayStore) -> None:
        self.spans = [span for stretch in runs(present) for span in _windows(*stretch)]
        self._known = np.flatnonzero(present)
        self._starts = np.array([start for start, _, _ in self.spans])
        self._store = store
        self._poses: list[Pose] = []

    def keep(self, part: Evidence, pose: Pose) -> None:
        """Keep the pose that was found for the next window's evidence."""
        evidence = {name: getattr(part, name) for name in _EVIDENCE}
        self._store.write(_name(len(self._poses)), evidence | pose._asdict())
        self._poses.append(pose)

    def resumed(self, part: Evidence) -> bool:
        """True if an earlier run has finished the next window, with the same evidence."""
        kept = self._store.read(_name(len(self._poses)))
        if kept is None or not {*_EVIDENCE, *Pose._fields} <= kept.keys():
            return False
        if not all(np.array_equal(kept[name], getattr(part, name)) for name in _EVIDENCE):
            return False
        self._poses.append(Pose(*(kept[name] for name in Pose._fields)))
        return True

    def poses(self, frames: NDArray[np.intp]) -> Pose:
        """The pose in each of some frames (n,), of windows that are kept.

        Empty frames hold the last known pose, those before it the first.
        """
        before = np.searchsorted(self._known, frames, side="right") - 1
        held, place = np.unique(self._known[np.clip(before, 0, None)], return_inverse=True)
        pose = Pose(np.empty((len(held), len(JOINTS), 3, 3)), np.empty((len(held), 3)))
        if not len(held):
            return pose
        first = int(np.searchsorted(self._starts, held[0], side="right")) - 1
        last = int(np.searchsorted(self._starts, held[-1], side="right"))
        # A window that the first frame shares with the one after it is needed as well.
        for number in range(max(first - 1, 0), last):
            self._lay(pose, held, number)
        return pose.at(place)

    def _lay(self, pose: Pose, frames: NDArray[np.intp], number: int) -> None:
        """Write a window's pose, blended with the one before where they overlap."""
        start, stop, overlap = self.spans[number]
        low, middle, high = np.searchsorted(frames, [start, start + overlap, stop])
        if low == high:
            return
        fitted = self._poses[number].at(frames[low:high] - start)
        if middle > low:
            shared = slice(int(low), int(middle))
            share = np.linspace(0.0, 1.0, overlap + 2)[1:-1][frames[shared] - start]
            share = share**3 * (10.0 + share * (6.0 * share - 15.0))  # no kink in velocity
            other = fitted.at(slice(0, int(middle - low)))
            between = to_vector(transposed(pose.turns[shared]) @ other.turns)
            pose.turns[shared] = pose.turns[shared] @ from_vector(share[:, None, None] * between)
            pose.translation_m[shared] += share[:, None] * (
                other.translation_m - pose.translation_m[shared]
            )
        pose.turns[middle:high] = fitted.turns[middle - low :]
        pose.translation_m[middle:high] = fitted.translation_m[middle - low :]


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
