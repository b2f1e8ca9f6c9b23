"""A track of landmarks of any length lifted, in blocks, as it is read."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.camera import PinholeCamera
from sd2core.body.lifted import LiftedTrack
from sd2core.body.lifter import OUTPUTS, POINTS, Lifter, Singles, spread
from sd2core.body.lifter_features import RATE_HZ, Seen, typical_size
from sd2core.body.track import PART_FRAMES, Landmarks, LandmarkTrack, parts
from sd2core.errors import Sd2Error
from sd2core.mesh.presence import runs
from sd2core.timebase import Timebase

Floats = NDArray[np.float64]

_SAME_RATE = 0.1
_BESIDE = 4
"""Frames more than a tick away that still matter where a track is resampled."""


class _Block(NamedTuple):
    """Frames that are lifted together, of a stretch with a person throughout."""

    first: int
    start: int
    stop: int
    last: int


class _View(NamedTuple):
    """A block as the network sees it.

    Parameters
    ----------
    seen : Seen
        At its own rate.
    ticks : intp array, shape (n,)
        Numbers of these moments, counted from the beginning of the stretch.
    place : float64 array
        Where the block's frames are among them.
    end : float
        Where the frames of the next block begin.
    """

    seen: Seen
    ticks: NDArray[np.intp]
    place: Floats
    end: float


class LiftedInParts:
    """Depth and motion along the line of sight; see :class:`~sd2core.body.lifted.Lifted`.

    Parameters
    ----------
    lifter : Lifter
    track : Landmarks
    camera : PinholeCamera
        Of the same picture.

    Raises
    ------
    Sd2Error
        When the camera's picture has another size than the track's.
    """

    def __init__(self, lifter: Lifter, track: Landmarks, camera: PinholeCamera) -> None:
        if (camera.width, camera.height) != (track.width, track.height):
            raise Sd2Error(
                f"The camera takes pictures of {camera.width} × {camera.height}",
                f"{track.width} × {track.height}, as the landmarks were found in",
            )
        self._lifter, self._track, self._camera = lifter, track, camera
        self._blocks = [
            _Block(first, first + start, first + stop, last)
            for first, last in runs(track.present)
            for start, stop in parts(last - first)
        ]
        self._lifted = lru_cache(maxsize=2)(self._lift)
        self._sample = lru_cache(maxsize=1)(self._sampled)

    def part(self, start: int, stop: int) -> LiftedTrack:
        """Frames ``start`` to ``stop``; NaN where there is nobody."""
        raw, size = np.full((stop - start, OUTPUTS), np.nan), np.full(stop - start, np.nan)
        for block in self._blocks:
            first, last = max(block.start, start), min(block.stop, stop)
            if first < last:
                outputs, typical = self._lifted(block)
                size[first - start : last - start] = typical
                raw[first - start : last - start] = outputs[first - block.start :][: last - first]
        return _lifted(Timebase(self._track.timebase.times_s[start:stop]), raw, size)

    def _lift(self, block: _Block) -> tuple[Floats, float]:
        """What the network says of a block, and the typical size in its stretch."""
        view = self._view(block)
        # Of a stretch that is one block, the block itself.
        whole = (block.start, block.stop) == (block.first, block.last)
        sample = view.seen if whole else self._sample(block.first, block.last)
        outputs = self._lifter.outputs(view.seen, sample)
        size = float(typical_size(sample.slopes))
        return _interpolated(outputs, view.place - view.ticks[0]), size

    def _sampled(self, first: int, last: int) -> Seen:
        """Ticks of a long stretch, evenly spread."""
        blocks = [block for block in self._blocks if first <= block.start < last]
        every = -(-(last - first) // PART_FRAMES)
        seen = []
        for block in blocks:
            view = self._view(block)
            own = (view.ticks >= view.place[0]) & (view.ticks < view.end)
            rows = np.flatnonzero(own & (view.ticks % every == 0))
            seen.append([np.asarray(values)[rows] for values in view.seen])
        return Seen(*(np.concatenate(values) for values in zip(*seen, strict=True)))

    def _view(self, block: _Block) -> _View:
        """A block at the network's rate, with as much around it as matters."""
        times_s = self._track.timebase.times_s[block.first : block.last]
        steps = np.diff(times_s) * RATE_HZ
        frames = len(times_s)
        same = not len(steps) or bool((np.abs(steps - 1.0) < _SAME_RATE).all())
        place = np.arange(frames, dtype=np.float64) if same else (times_s - times_s[0]) * RATE_HZ
        inner = place[block.start - block.first : block.stop - block.first]
        end = np.inf if block.stop == block.last else place[block.stop - block.first]
        reach = self._lifter.network.reach + 2
        ticks = np.arange(
            max(int(inner[0]) - reach, 0),
            min(int(inner[-1]) + 1 + reach, int(place[-1] + 1e-6)) + 1,
        )
        if same:
            first, last = int(ticks[0]), int(ticks[-1]) + 1
        else:
            first = max(int(np.searchsorted(place, ticks[0] - 1)) - _BESIDE, 0)
            last = min(int(np.searchsorted(place, ticks[-1] + 1)) + _BESIDE, frames)
        seen = _seen(self._track.part(block.first + first, block.first + last), self._camera)
        if not same:
            near = place[first:last]
            seen = Seen(*(_resampled(np.asarray(part), near, ticks) for part in seen))
        return _View(seen, ticks, inner, end)


def _seen(track: LandmarkTrack, camera: PinholeCamera) -> Seen:
    return Seen(
        camera.slopes(track.image_px.astype(np.float64)),
        track.depth_px / camera.focal_px,
        track.world_m.astype(np.float64),
        track.visibility.astype(np.float64),
        np.where(track.bridged, 0.0, track.confidence),
    )


def _resampled(values: Floats, place: Floats, ticks: NDArray[np.intp]) -> Floats:
    """Values (T, ...) at increasing places, at consecutive whole numbers.

    Where frames are closer than a tick each tick is their mean, weighted by a
    triangle of one tick to each side; elsewhere a monotone cubic goes through them.
    """
    from scipy.interpolate import PchipInterpolator

    flat = values.reshape(len(values), -1)
    result = PchipInterpolator(place, flat, axis=0)(np.minimum(ticks, place[-1]))
    low = np.minimum(place.astype(np.intp), ticks[-1])
    total, weight = np.zeros((len(ticks) + 1, flat.shape[1])), np.zeros(len(ticks) + 1)
    for tick, share in ((low, 1.0 - (place - low)), (low + 1, place - low)):
        share = np.clip(share, 0.0, 1.0)
        near = tick >= ticks[0]
        row = tick[near] - ticks[0]
        np.add.at(total, row, share[near, None] * flat[near])
        np.add.at(weight, row, share[near])
    crowded = weight[:-1] > 1.3
    result[crowded] = total[:-1][crowded] / weight[:-1][crowded, None]
    return np.asarray(result.reshape(len(ticks), *values.shape[1:]))


def _interpolated(outputs: Singles, place: Floats) -> Floats:
    """Rows of outputs at fractional places."""
    low = np.clip(place.astype(np.intp), 0, max(len(outputs) - 2, 0))
    share = np.clip(place - low, 0.0, 1.0)[:, None]
    high = np.minimum(low + 1, len(outputs) - 1)
    return np.asarray((1.0 - share) * outputs[low] + share * outputs[high])


def _lifted(timebase: Timebase, raw: Floats, size: Floats) -> LiftedTrack:
    root, root_spread, rest = raw[:, 0], raw[:, 1], raw[:, 2:].reshape(len(raw), 4, POINTS)
    centre = np.exp(root) / size
    return LiftedTrack(
        timebase,
        centre,
        centre * spread(root_spread),
        rest[:, 0],
        spread(rest[:, 1]),
        rest[:, 2],
        spread(rest[:, 3]),
    )
