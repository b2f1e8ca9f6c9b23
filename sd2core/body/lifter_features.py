"""Features of every frame for the lifter's network."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.track import LANDMARKS, MIRRORED, TORSO_CORNERS

Floats = NDArray[np.floating]
Singles = NDArray[np.float32]

RATE_HZ = 30.0
"""Frames per second that the network is trained on; other tracks are resampled."""

_SAME_RATE = 0.1

_SHOULDERS, _HIPS = list(TORSO_CORNERS[:2]), list(TORSO_CORNERS[2:])
_TORSO_M = 0.5
"""A torso's length, which the landmark model's own metres are brought to."""


def _rows(*names: str) -> list[int]:
    return [LANDMARKS.index(name) for name in names]


# From, to (each the mean of some landmarks), and length in torsos.
_BONES = (
    *(
        bone
        for side in "LR"
        for bone in (
            (_rows(f"shoulder.{side}"), _rows(f"elbow.{side}"), 0.57),
            (_rows(f"elbow.{side}"), _rows(f"wrist.{side}"), 0.50),
            (_rows(f"wrist.{side}"), _rows(f"index.{side}", f"pinky.{side}"), 0.22),
            (_rows(f"hip.{side}"), _rows(f"knee.{side}"), 0.88),
            (_rows(f"knee.{side}"), _rows(f"ankle.{side}"), 0.92),
            (_rows(f"shoulder.{side}"), _rows(f"wrist.{side}"), 1.07),
        )
    ),
    (_HIPS, _SHOULDERS, 1.0),
    (_SHOULDERS, _rows("nose"), 0.45),
    (_rows("shoulder.R"), _rows("shoulder.L"), 0.75),
    (_rows("hip.R"), _rows("hip.L"), 0.45),
)
_UNSURE = 0.15
"""Sine of a bone's angle to the view below which its sign is hardly known."""


class Seen(NamedTuple):
    """One stretch of a track at :data:`RATE_HZ`, as slopes instead of pixels.

    Leading axes of any number may stand before T.
    """

    slopes: Floats  # (..., T, 33, 2) x / z and y / z of every landmark
    depth: Floats  # (..., T, 33) the landmark model's depth in pixels over focal length
    world_m: Floats  # (..., T, 33, 3)
    visibility: Floats  # (..., T, 33)
    sure: Floats  # (..., T) confidence; 0 in bridged frames


def mirrored(seen: Seen) -> Seen:
    """Mirror image of a stretch: left and right change places."""
    sides, x = list(MIRRORED), np.array([-1.0, 1.0], np.float32)
    return Seen(
        seen.slopes[..., sides, :] * x,
        seen.depth[..., sides],
        seen.world_m[..., sides, :] * np.append(x, np.float32(1.0)),
        seen.visibility[..., sides],
        seen.sure,
    )


def backwards(seen: Seen) -> Seen:
    """A stretch played backwards."""
    return Seen(*(np.asarray(part)[::-1] for part in seen))


def apparent_size(slopes: Floats) -> Floats:
    """Apparent length of the torso: slope between middle of shoulders and of hips, (..., T)."""
    torso = slopes[..., _SHOULDERS, :].mean(axis=-2) - slopes[..., _HIPS, :].mean(axis=-2)
    return np.asarray(np.sqrt((torso**2).sum(axis=-1) + 1e-8))


def typical_size(slopes: Floats) -> Floats:
    """Median apparent size of a whole stretch, (...,): the unit of slopes."""
    return np.asarray(np.median(apparent_size(slopes), axis=-1))


class Scale(NamedTuple):
    """Units of a whole stretch."""

    size: Floats  # (...,) see typical_size
    torso_m: Floats  # (...,) median torso length in the landmark model's own metres
    longest: Floats  # (..., 1, bones) 95 % quantile of each bone's apparent length


def scale_of(seen: Seen) -> Scale:
    """Units of a stretch, from all its frames or a sample of them."""
    size = typical_size(np.asarray(seen.slopes))
    world = np.asarray(seen.world_m)
    torso = world[..., _SHOULDERS, :].mean(axis=-2) - world[..., _HIPS, :].mean(axis=-2)
    torso_m = np.median(np.sqrt((torso**2).sum(axis=-1)), axis=-1)
    length, _, _ = _foreshortening(*_measured(seen, size, torso_m))
    return Scale(size, torso_m, np.quantile(length, 0.95, axis=-2, keepdims=True))


def features(seen: Seen, scale: Scale | None = None) -> Singles:
    """Features of every frame, (..., T, C).

    All but the direction of the body and its size is free of where the person stands and how far
    away. ``scale`` is that of a longer stretch that this is part of.
    """
    scale = scale_of(seen) if scale is None else scale
    slopes = np.asarray(seen.slopes)
    size = apparent_size(slopes)  # (..., T)
    unit = scale.size[..., None]  # (..., 1)
    centre = slopes[..., list(TORSO_CORNERS), :].mean(axis=-2)  # (..., T, 2)
    around, world = _measured(seen, scale.size, scale.torso_m)
    depth = seen.depth / unit[..., None]
    apparent = np.log(size / unit)[..., None]
    length, ahead, signed = _foreshortening(around, world)
    flat = (*slopes.shape[:-2], -1)
    columns = [
        around.reshape(flat),
        rate(around, -3).reshape(flat),
        depth,
        rate(depth, -2),
        world.reshape(flat),
        rate(world[..., 2], -2),
        length,
        rate(length, -2),
        np.broadcast_to(scale.longest, length.shape),
        ahead,
        signed,
        rate(signed, -2),
        seen.visibility,
        np.asarray(seen.sure)[..., None],
        centre,
        rate(centre / unit[..., None], -2),
        apparent,
        rate(apparent, -2),
        np.broadcast_to(np.log(unit)[..., None], apparent.shape),
    ]
    return np.concatenate(columns, axis=-1).astype(np.float32)


def _measured(seen: Seen, size: Floats, torso_m: Floats) -> tuple[Floats, Floats]:
    """Slopes around the body's centre and the model's own places, in a stretch's units."""
    slopes = np.asarray(seen.slopes)
    centre = slopes[..., list(TORSO_CORNERS), :].mean(axis=-2)
    around = (slopes - centre[..., None, :]) / size[..., None][..., None, None]
    metres = (_TORSO_M / np.maximum(torso_m, 0.05))[..., None, None, None]
    return around, np.asarray(seen.world_m) * metres


def _foreshortening(around: Floats, world_m: Floats) -> tuple[Floats, Floats, Floats]:
    """Apparent length of the bones, their depth by the model, and their depth by foreshortening.

    The depth of a bone of known length follows from its length in the picture; the landmark model's
    own depth, however weak, gives the sign. All (..., T, bones), as shares of the bones' lengths.
    """
    length, ahead = [], []
    for near, far, torsos in _BONES:
        across = around[..., far, :].mean(axis=-2) - around[..., near, :].mean(axis=-2)
        length.append(np.sqrt((across**2).sum(axis=-1) + 1e-6) / torsos)
        away = world_m[..., far, 2].mean(axis=-1) - world_m[..., near, 2].mean(axis=-1)
        ahead.append(away / (torsos * _TORSO_M))
    seen, sine = np.stack(length, axis=-1), np.stack(ahead, axis=-1)
    lacking = np.sqrt(np.maximum(1.0 - seen**2, 0.0) + 0.01)
    return seen, sine, np.asarray(sine / np.sqrt(sine**2 + _UNSURE**2) * lacking)


def rate(values: Floats, axis: int) -> Floats:
    """Derivative per second: central differences along one axis, one-sided at its ends."""
    if values.shape[axis] < 2:
        return np.zeros_like(values)
    return np.asarray(RATE_HZ * np.gradient(values, axis=axis))


def nearly_at_rate(times_s: Floats) -> bool:
    """True if frames follow each other at :data:`RATE_HZ`, within a tenth of a frame."""
    return bool((np.abs(np.diff(times_s) * RATE_HZ - 1.0) < _SAME_RATE).all())


def resampled(values: Floats, place: Floats, ticks: NDArray[np.intp]) -> Floats:
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


def interpolated(outputs: NDArray[np.floating], place: Floats) -> NDArray[np.float64]:
    """Rows of outputs at fractional places."""
    low = np.clip(place.astype(np.intp), 0, max(len(outputs) - 2, 0))
    share = np.clip(place - low, 0.0, 1.0)[:, None]
    high = np.minimum(low + 1, len(outputs) - 1)
    return np.asarray((1.0 - share) * outputs[low] + share * outputs[high])
