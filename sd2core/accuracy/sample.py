"""Sample of the frames of a clip on which plans are tried."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sd2core.accuracy.plans import MASK_STRIDES
from sd2core.doppler.options import SynthesisOptions
from sd2core.doppler.synthesizer import Synthesizer
from sd2core.mesh.sequence import MeshSequence, refuse_missing
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

KEPT = 10
"""Frames of a run that are compared; more are read around them."""

_RUNS = 8
_CHOOSING_RUNS = 2
_CANDIDATES, _MOST_CANDIDATES = 48, 240
_EVERY_FRAMES = 75
"""Of a long clip one candidate: some recordings are gestures with long pauses between them."""

_QUIET_SHARE = 0.1
"""Of the mean candidate's part in the map, what each is taken to have at least: what the facing
test says of a few frames is not all."""

_MIN_MARGIN = 5
_SMOOTHING_REACH = 5.0
_SHORTEST_RUN = 5


@dataclass(frozen=True)
class Run:
    """Consecutive frames ``start`` to ``stop`` (exclusive) of the sampled mesh.

    ``first`` is the number of the first of them in the clip; ``weight`` is in proportion to how
    many frames of the clip each of them stands for.
    """

    start: int
    stop: int
    first: int
    weight: float = 1.0

    @property
    def frames(self) -> range:
        """Numbers of the frames in the clip."""
        return range(self.first, self.first + self.stop - self.start)


@dataclass(frozen=True, eq=False)
class Sample:
    """Runs of frames, from those with the most to those with the least in a map."""

    frames: NDArray[np.intp]
    """Frames of the clip that are read: every run with the frames around it, which its velocities,
    smoothing and reused masks look at."""
    runs: tuple[Run, ...]  # that stand for the clip together
    chosen_on: tuple[Run, ...]  # some of them, on which settings are tried one by one

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


def take_sample(
    mesh: MeshSequence, sensor: VirtualSensor, options: SynthesisOptions, runs: int = _RUNS
) -> Sample:
    """Choose frames on which plans are compared: some ``runs`` of ten frames.

    How often a run is drawn is in proportion to what the sensor receives in it, at a glance, and
    its weight to the reverse: together they tell of the whole map, whatever moves where it is not
    received. A clip that is too short for them is used whole. Smoothing of the vertices' paths
    widens the margins of the runs.

    Parameters
    ----------
    mesh : MeshSequence
        The clip.
    sensor : VirtualSensor
        Whose map the plans make.
    options : SynthesisOptions
        For what a plan does not choose.
    runs : int
        At most.
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
    count = min(max(_CANDIDATES, frames // _EVERY_FRAMES), _MOST_CANDIDATES)
    starts = np.unique(np.linspace(0, frames - length, count).astype(int) // every * every)
    before = (length - KEPT) // 2
    # With the clip's first frames, and its last: at its ends paths may be of another kind.
    firsts = np.where(starts == 0, 0, starts + before)
    stops = np.where(starts + length > frames - every, frames, starts + before + KEPT)
    present = np.logical_or.reduce([body.presence.present for body in mesh.bodies])
    peopled = [present[a:b].any() for a, b in zip(firsts.tolist(), stops.tolist(), strict=True)]
    numbers = np.flatnonzero(peopled) if any(peopled) else np.arange(len(starts))
    weights = np.ones(len(numbers))
    if len(numbers) > runs:
        drawn, weights = _drawn(_received(mesh, sensor, options, firsts[numbers]), runs)
        numbers = numbers[drawn]
    spans = [(starts[n], firsts[n], stops[n]) for n in numbers]
    read = np.unique(
        np.concatenate([np.arange(start, max(start + length, stop)) for start, _, stop in spans])
    )
    kept = []
    for (_, first, stop), weight in zip(spans, weights.tolist(), strict=True):
        position = int(np.searchsorted(read, first))
        kept.append(Run(position, position + int(stop - first), int(first), weight))
    apart = max(len(kept) // _CHOOSING_RUNS, 1)
    return Sample(read, tuple(kept), tuple(kept[apart // 2 :: apart][:_CHOOSING_RUNS]))


def _drawn(
    received: NDArray[np.float64], runs: int
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Numbers of the runs that are drawn in proportion to what is received, and their weights."""
    expected = received + (_QUIET_SHARE * received.mean() or 1.0)
    order = np.argsort(-expected, kind="stable")
    up_to = np.cumsum(expected[order])
    places = np.searchsorted(up_to, up_to[-1] * (np.arange(runs) + 0.5) / runs)
    ranks, times = np.unique(places, return_counts=True)
    return order[ranks], times / expected[order[ranks]]


def _received(
    mesh: MeshSequence, sensor: VirtualSensor, options: SynthesisOptions, firsts: NDArray[np.intp]
) -> NDArray[np.float64]:
    """What the map has in two frames of each run, when only the facing test is made."""
    quick = replace(
        options,
        visibility="none" if mesh.faces is None else "facing",
        trajectory_smoothing_s=0.0,
        velocity_sigma_bins=0.0,
        time_sigma_s=0.0,
        beyond="wrap",
    )
    maps = Synthesizer(mesh, quick, block_frames=1)

    def at(frame: int) -> float:
        return float(maps.stretch(sensor, frame, frame + 1, shares=False).raw.sum())

    return np.array([at(first + KEPT // 4) + at(first + 3 * KEPT // 4) for first in firsts])


def _whole(frames: int) -> Sample:
    """Sample of a whole short clip, cut into runs; settings are tried on every other one."""
    count = max(1, min(8, frames // _SHORTEST_RUN))
    edges = np.linspace(0, frames, count + 1).astype(int).tolist()
    runs = tuple(Run(a, b, a) for a, b in itertools.pairwise(edges))
    return Sample(np.arange(frames), runs, runs[::2])
