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
    """One take as the lifter sees it, and its truth.

    Parameters
    ----------
    seen : Seen
        (T, ...).
    depth : float32 array, shape (T, 33)
        Z of the keypoints in statures.
    standing : float32 array, shape (T, 4)
        1 where a foot stands still, otherwise 0.
    """

    seen: Seen
    depth: Singles
    standing: Singles


class Batch(NamedTuple):
    """Input and wanted output of the network.

    Parameters
    ----------
    told : float32 array, shape (N, T, C)
    root : float32 array, shape (N, T)
        Logarithm of the centre's depth times the typical size.
    depth, velocity : float32 array, shape (N, T, 33)
    size : float32 array, shape (N,)
        The typical apparent size.
    standing : float32 array, shape (N, T, 4)
        See :class:`Example`.
    """

    told: Singles
    root: Singles
    depth: Singles
    velocity: Singles
    size: Singles
    standing: Singles


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
    return Example(seen, places[..., 2], _standing(places))


def emulated(rng: np.random.Generator, emulator: Emulator, walk: Walk) -> Example:
    """Example from a motion without pictures."""
    seen = emulator.seen(rng, walk)
    seen = Seen(*(np.asarray(part, np.float32) for part in seen))
    return Example(seen, walk.places[..., 2], _standing(walk.places))


def _standing(places: Singles) -> Singles:
    """Where feet stand still, of places (T, 33, 3) in statures."""
    speed = np.linalg.norm(rate(places[:, list(FEET)], 0), axis=-1)
    return (speed < _STANDING).astype(np.float32)


def batch(examples: Sequence[Example]) -> Batch:
    """Whole examples of equal length, as they are."""
    seen = Seen(*(np.stack(parts) for parts in zip(*(e.seen for e in examples), strict=True)))
    truth = np.stack([e.depth for e in examples])
    centre = truth[..., list(TORSO_CORNERS)].mean(axis=-1)
    size = typical_size(seen.slopes)
    root = np.log(centre * size[:, None])
    return Batch(
        features(seen),
        root.astype(np.float32),
        truth - centre[..., None],
        np.asarray(rate(truth, 1), np.float32),
        size.astype(np.float32),
        np.stack([e.standing for e in examples]),
    )


def varied(rng: np.random.Generator, one: Example, length: int) -> Example:
    """A part of an example, perhaps mirrored, reversed, turned, with a gap."""
    cut, seen, is_mirrored, is_reversed = another_view(rng, one.seen, length)
    truth, standing = one.depth[cut], one.standing[cut]
    if is_mirrored:
        truth, standing = truth[:, list(MIRRORED)], standing[:, _OTHER_FEET]
    if is_reversed:
        truth, standing = truth[::-1], standing[::-1]
    if rng.random() < _GAP_SHARE:
        seen = _bridged(rng, seen)
    return Example(seen, truth, standing)


def another_view(
    rng: np.random.Generator, seen: Seen, length: int
) -> tuple[slice, Seen, bool, bool]:
    """A part of a stretch, perhaps its mirror image, perhaps played backwards, a little turned.

    Returns which part, what is seen of it, and whether it is mirrored and reversed.
    """
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
    return cut, view, is_mirrored, is_reversed


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
