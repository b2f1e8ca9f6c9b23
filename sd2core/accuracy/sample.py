"""Sample of the frames of a clip on which plans are tried."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sd2core.accuracy.plans import MASK_STRIDES
from sd2core.doppler.options import SynthesisOptions
from sd2core.mesh.sequence import MeshSequence, refuse_missing
from sd2core.timebase import Timebase

KEPT = 10
"""Frames of a run that are compared; more are read around them."""

_CANDIDATES, _MOST_CANDIDATES = 24, 240
_EVERY_FRAMES = 75
"""Of a long clip one candidate: some recordings are gestures with long pauses between them."""

_LIVELY_SHARE = 0.01
"""Of the liveliest candidate's squared speed: what moves less hardly counts in the map."""

_MIN_MARGIN = 5
_SMOOTHING_REACH = 5.0
_PROBED_VERTICES = 500
_SHORTEST_RUN = 5
_MIN_STARTS = 2
"""One to choose on and one to check on."""


@dataclass(frozen=True)
class Run:
    """Consecutive frames ``start`` to ``stop`` (exclusive) of the sampled mesh.

    ``first`` is the number of the first of them in the clip.
    """

    start: int
    stop: int
    first: int

    @property
    def frames(self) -> range:
        """Numbers of the frames in the clip."""
        return range(self.first, self.first + self.stop - self.start)


@dataclass(frozen=True, eq=False)
class Sample:
    """Runs of frames, from the liveliest to the quieter ones of a clip."""

    frames: NDArray[np.intp]
    """Frames of the clip that are read: every run with the frames around it, which its velocities,
    smoothing and reused masks look at."""
    chosen_on: tuple[Run, ...]  # runs to choose a plan on
    checked_on: tuple[Run, ...]
    """Runs to check it on; the same run in a clip of fewer than ten frames."""

    @property
    def runs(self) -> tuple[Run, ...]:
        """Runs to choose on and to check on, each once."""
        return tuple(dict.fromkeys((*self.chosen_on, *self.checked_on)))

    def of(self, mesh: MeshSequence) -> MeshSequence:
        """Sampled frames of a mesh in memory, one run after the other at their own times.

        Raises Sd2Error, with the frame in the clip, if a vertex is not finite.
        """
        cuts = np.flatnonzero(np.diff(self.frames) > 1) + 1
        stretches = []
        for part in np.split(self.frames, cuts):
            vertices = mesh.read(int(part[0]), int(part[-1]) + 1)
            refuse_missing(vertices, int(part[0]), mesh.source)
            stretches.append(vertices)
        return replace(
            mesh,
            vertices=np.concatenate(stretches),
            timebase=Timebase(mesh.times_s[self.frames]),
            present=mesh.presence.present[self.frames],
            uncertainty=None
            if mesh.uncertainty is None
            else mesh.uncertainty.of_frames(self.frames),
            others=tuple(self.of(body) for body in mesh.others),
        )


def take_sample(mesh: MeshSequence, options: SynthesisOptions, runs: int = 6) -> Sample:
    """Choose frames on which plans are compared: ``runs`` of ten frames, half of them to choose on.

    Every second run in order of liveliness is to check on. A clip that is too short for
    them is used whole. Smoothing of the vertices' paths widens the margins of the runs.
    """
    frames = mesh.frame_count
    margin = _MIN_MARGIN
    if options.trajectory_smoothing_s > 0 and frames > 1:
        step_s = float(np.median(np.diff(mesh.times_s)))
        margin = max(margin, math.ceil(_SMOOTHING_REACH * options.trajectory_smoothing_s / step_s))
    # Masks serve every n-th frame of what is sampled: no frame may be served from
    # another run.
    every = math.lcm(*MASK_STRIDES)
    length = -(-(KEPT + 2 * margin) // every) * every
    if frames < 2 * length:
        return _whole(frames)
    candidates = min(max(_CANDIDATES, frames // _EVERY_FRAMES), _MOST_CANDIDATES)
    starts = np.unique(np.linspace(0, frames - length, candidates).astype(int) // every * every)
    present = np.logical_or.reduce([body.presence.present for body in mesh.bodies])
    with_person = [bool(present[start : start + length].all()) for start in starts.tolist()]
    peopled = _apart(starts[with_person], length)
    starts = peopled if len(peopled) >= _MIN_STARTS else _apart(starts, length)
    middles = (starts + length // 2).tolist()
    speed = np.array([sum(_speed(body, middle) for body in mesh.bodies) for middle in middles])
    order = starts[np.argsort(-speed, kind="stable")]
    # From the liveliest down to those of middling liveliness, where so many move at all.
    moving = int((speed >= _LIVELY_SHARE * speed.max()).sum())
    pool = order[: max(min(len(order) * 2 // 3, moving), runs)]
    lively = pool[np.unique(np.linspace(0, len(pool) - 1, runs).astype(int))]
    ascending = np.sort(lively)
    before = (length - KEPT) // 2
    placed = {
        int(start): Run(
            position * length + before, position * length + before + KEPT, int(start) + before
        )
        for position, start in enumerate(ascending)
    }
    return Sample(
        np.concatenate([np.arange(start, start + length) for start in ascending]),
        tuple(placed[int(start)] for start in lively[::2]),
        tuple(placed[int(start)] for start in lively[1::2]),
    )


def _whole(frames: int) -> Sample:
    """Sample of a whole short clip, cut into runs that take turns."""
    count = max(1, min(8, frames // _SHORTEST_RUN))
    edges = np.linspace(0, frames, count + 1).astype(int).tolist()
    runs = [Run(a, b, a) for a, b in itertools.pairwise(edges)]
    return Sample(
        np.arange(frames), tuple(runs[::2]), tuple(runs[1::2]) if count > 1 else tuple(runs)
    )


def _apart(starts: NDArray[np.intp], length: int) -> NDArray[np.intp]:
    """Starts of the runs that do not overlap with the one before."""
    kept: list[int] = []
    for start in starts.tolist():
        if not kept or start >= kept[-1] + length:
            kept.append(start)
    return np.array(kept, dtype=np.intp)


def _speed(mesh: MeshSequence, frame: int) -> float:
    """Mean squared speed of some vertices, in (m/s)²; 0 without a person."""
    if not mesh.presence.present[frame : frame + 2].all():
        return 0.0
    two = mesh.read(frame, frame + 2).astype(np.float64)
    refuse_missing(two, frame, mesh.source)
    probed = two[:, :: max(1, mesh.vertex_count // _PROBED_VERTICES)]
    step = probed[1] - probed[0]
    duration_s = mesh.times_s[frame + 1] - mesh.times_s[frame]
    return float((step**2).sum(axis=1).mean() / duration_s**2)
