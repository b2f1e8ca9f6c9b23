"""Batches that the lifter learns from: takes cut, mirrored, turned and reversed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.lifter import FEET
from sd2core.body.lifter_features import Seen, backwards, features, mirrored, rate, typical_size
from sd2core.body.track import MIRRORED, TORSO_CORNERS
from tools.train_lifter.emulate import Emulator, Walk
from tools.train_lifter.takes import Take

Singles = NDArray[np.float32]

_TURN_DEG = 8.0
_GAP_SHARE = 0.15
_LONGEST_GAP = 8
_STANDING = 0.12
"""Statures per second below which a foot stands still."""
_OTHER_FEET = [FEET.index(MIRRORED[row]) for row in FEET]


class Example(NamedTuple):
    """One take as the lifter sees it, and its truth."""

    seen: Seen  # (T, ...)
    places: Singles  # (T, 33, 3), keypoints in statures, in the camera frame
    standing: Singles  # (T, 4), 1 where a foot stands still, otherwise 0


class Batch(NamedTuple):
    """Input and wanted output of the network."""

    features: Singles  # (N, T, C)
    root: Singles  # (N, T), logarithm of the centre's depth times the typical size
    depth: Singles  # (N, T, 33)
    velocity: Singles  # (N, T, 33)
    # (N, T, 33, 2), keypoints beside the landmarks in the picture, in typical apparent sizes.
    across: Singles
    size: Singles  # (N,), the typical apparent size
    standing: Singles  # (N, T, 4), see Example


def example(take: Take) -> Example:
    """Example from a drawn take."""
    camera = take.camera
    seen = Seen(
        camera.slopes(take.image_px.astype(np.float64)).astype(np.float32),
        (take.depth_px / camera.focal_px).astype(np.float32),
        take.world_m,
        take.visibility,
        take.confidence,
    )
    places = take.keypoints_m / np.float32(take.stature_m)
    return Example(seen, places, _standing(places))


def emulated(rng: np.random.Generator, emulator: Emulator, walk: Walk) -> Example:
    """Example from a motion without pictures."""
    seen = emulator.seen(rng, walk)
    seen = Seen(*(np.asarray(part, np.float32) for part in seen))
    return Example(seen, walk.places, _standing(walk.places))


def _standing(places: Singles) -> Singles:
    """Where feet stand still, of places (T, 33, 3) in statures."""
    speed = np.linalg.norm(rate(places[:, list(FEET)], 0), axis=-1)
    return (speed < _STANDING).astype(np.float32)


def batch(examples: Sequence[Example]) -> Batch:
    """Whole examples of equal length, as they are."""
    seen = Seen(*(np.stack(parts) for parts in zip(*(e.seen for e in examples), strict=True)))
    places = np.stack([e.places for e in examples])
    truth = places[..., 2]
    centre = truth[..., list(TORSO_CORNERS)].mean(axis=-1)
    size = typical_size(seen.slopes)
    root = np.log(centre * size[:, None])
    across = (places[..., :2] / truth[..., None] - seen.slopes) / size[:, None, None, None]
    return Batch(
        features(seen),
        root.astype(np.float32),
        truth - centre[..., None],
        np.asarray(rate(truth, 1), np.float32),
        across.astype(np.float32),
        size.astype(np.float32),
        np.stack([e.standing for e in examples]),
    )


def varied(rng: np.random.Generator, one: Example, length: int) -> Example:
    """A part of an example, perhaps mirrored, reversed, turned, with a gap."""
    view = another_view(rng, one.seen, length)
    seen, places, standing = view.seen, one.places[view.cut], one.standing[view.cut]
    if view.is_mirrored:
        places = places[:, list(MIRRORED)] * np.array([-1.0, 1.0, 1.0], np.float32)
        standing = standing[:, _OTHER_FEET]
    if view.is_reversed:
        places, standing = places[::-1], standing[::-1]
    places = np.concatenate([places[..., :2] @ view.turn, places[..., 2:]], axis=-1)
    if rng.random() < _GAP_SHARE:
        seen = _bridged(rng, seen)
    return Example(seen, places, standing)


class Variation(NamedTuple):
    """A part of a stretch, perhaps its mirror image, perhaps played backwards, a little turned."""

    seen: Seen
    cut: slice
    is_mirrored: bool
    is_reversed: bool
    turn: Singles  # (2, 2), of places in the picture, from the right


def another_view(rng: np.random.Generator, seen: Seen, length: int) -> Variation:
    """A random variation of a stretch."""
    start = int(rng.integers(0, len(seen.sure) - length + 1))
    cut = slice(start, start + length)
    view = Seen(*(np.array(part[cut]) for part in seen))
    is_mirrored, is_reversed = rng.random() < 0.5, rng.random() < 0.5
    view = mirrored(view) if is_mirrored else view
    view = backwards(view) if is_reversed else view
    angle = np.radians(_TURN_DEG * rng.uniform(-1.0, 1.0))
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]], np.float32)
    world = np.asarray(view.world_m)
    turned = np.concatenate([world[..., :2] @ turn, world[..., 2:]], axis=-1)
    view = view._replace(slopes=np.asarray(view.slopes) @ turn, world_m=turned)
    return Variation(view, cut, is_mirrored, is_reversed, turn)


def _bridged(rng: np.random.Generator, seen: Seen) -> Seen:
    """Some frames lost and interpolated, as the tracker does it."""
    count = len(seen.sure)
    gap = int(rng.integers(1, _LONGEST_GAP + 1))
    first = int(rng.integers(1, count - gap - 1))
    share = (np.arange(1, gap + 1) / (gap + 1)).astype(np.float32)
    parts = []
    for part in seen:
        part = np.array(part)
        weight = share.reshape(-1, *(1,) * (part.ndim - 1))
        part[first : first + gap] = (1 - weight) * part[first - 1] + weight * part[first + gap]
        parts.append(part)
    parts[-1][first : first + gap] = 0.0
    return Seen(*parts)
