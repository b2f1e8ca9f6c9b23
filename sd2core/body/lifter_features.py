"""What the lifter's network is told of every frame."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.track import LANDMARKS

Floats = NDArray[np.floating]
Singles = NDArray[np.float32]

RATE_HZ = 30.0
"""Frames per second that the network is trained on; other tracks are resampled."""

CENTRE = tuple(LANDMARKS.index(name) for name in ("shoulder.L", "shoulder.R", "hip.L", "hip.R"))
"""The body's centre is the mean of these."""

_SHOULDERS, _HIPS = list(CENTRE[:2]), list(CENTRE[2:])
_TORSO_M = 0.5
"""A torso's length, which the landmark model's own metres are brought to."""


class Seen(NamedTuple):
    """One stretch of a track at :data:`RATE_HZ`, as slopes instead of pixels.

    Leading axes of any number may stand before T.

    Parameters
    ----------
    slopes : array, shape (..., T, 33, 2)
        X / z and y / z of every landmark.
    depth : array, shape (..., T, 33)
        The landmark model's depth in pixels, divided by the focal length.
    world_m : array, shape (..., T, 33, 3)
    visibility : array, shape (..., T, 33)
    sure : array, shape (..., T)
        Confidence; 0 in bridged frames.
    """

    slopes: Floats
    depth: Floats
    world_m: Floats
    visibility: Floats
    sure: Floats


def apparent_size(slopes: Floats) -> Floats:
    """How long the torso looks: slope between the middles of shoulders and hips, (..., T)."""
    torso = slopes[..., _SHOULDERS, :].mean(axis=-2) - slopes[..., _HIPS, :].mean(axis=-2)
    return np.asarray(np.sqrt((torso**2).sum(axis=-1) + 1e-8))


def typical_size(slopes: Floats) -> Floats:
    """The apparent size of a whole stretch, (...,): what slopes are measured in."""
    return np.asarray(np.median(apparent_size(slopes), axis=-1))


def features(seen: Seen) -> Singles:
    """What the network is told of every frame, (..., T, C).

    All but the direction of the body and its size is free of where the person
    stands and how far away.
    """
    slopes = np.asarray(seen.slopes)
    size = apparent_size(slopes)  # (..., T)
    unit = typical_size(slopes)[..., None]  # (..., 1)
    centre = slopes[..., list(CENTRE), :].mean(axis=-2)  # (..., T, 2)
    around = (slopes - centre[..., None, :]) / unit[..., None, None]
    depth = seen.depth / unit[..., None]
    world = np.asarray(seen.world_m)
    torso = world[..., _SHOULDERS, :].mean(axis=-2) - world[..., _HIPS, :].mean(axis=-2)
    length = np.median(np.sqrt((torso**2).sum(axis=-1)), axis=-1)
    world = world * (_TORSO_M / np.maximum(length, 0.05))[..., None, None, None]
    apparent = np.log(size / unit)[..., None]
    flat = (*slopes.shape[:-2], -1)
    columns = [
        around.reshape(flat),
        rate(around, -3).reshape(flat),
        depth,
        rate(depth, -2),
        world.reshape(flat),
        rate(world[..., 2], -2),
        seen.visibility,
        np.asarray(seen.sure)[..., None],
        centre,
        rate(centre / unit[..., None], -2),
        apparent,
        rate(apparent, -2),
        np.broadcast_to(np.log(unit)[..., None], apparent.shape),
    ]
    return np.concatenate(columns, axis=-1).astype(np.float32)


def rate(values: Floats, axis: int) -> Floats:
    """Per second: central differences along one axis, one-sided at its ends."""
    values = np.moveaxis(np.asarray(values), axis, 0)
    if len(values) < 2:
        return np.moveaxis(np.zeros_like(values), 0, axis)
    inner = (values[2:] - values[:-2]) / 2.0
    ends = values[1] - values[0], values[-1] - values[-2]
    return np.moveaxis(RATE_HZ * np.concatenate([ends[0][None], inner, ends[1][None]]), 0, axis)
