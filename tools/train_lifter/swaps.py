"""Stretches in which parts of the body are mirrored: as they are in takes, and put in."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.lifter_features import RATE_HZ, Seen, apparent_size, resampled
from sd2core.body.raw_track import RawTrack
from sd2core.body.sides import SIDED_PARTS, undo_side_swaps
from sd2core.body.track import LANDMARK, MIRRORED
from tools.train_lifter.emulate import another_view, example
from tools.train_lifter.takes import Take

Singles = NDArray[np.float32]

_PARTS = tuple(SIDED_PARTS.values())
_TOGETHER = ((0, 1, 2), (0, 1, 2), (0, 1), (0,), (1,), (2,), (2,))
"""Parts that are mirrored at once."""
_TOLD_BY = tuple(
    [LANDMARK[f"{name}.{side}"] for name in names for side in "LR"]
    for names in (("shoulder", "hip", "ear"), ("elbow", "wrist"), ("knee", "ankle"))
)
"""Landmarks whose truth tells whether each part is mirrored."""
_CLEAR = 0.05
"""Share of the person's height by which one side must be nearer than the other."""
_UNTOUCHED = 0.3
_MAX_STRETCHES = 3
_THINNED = 0.3
_SAME_VISIBILITY = 0.15
_JITTER = 0.02
"""Of a landmark, at most, in lengths of the torso."""
_FOUND = 0.5
_FOCAL_PX = 600.0


class Known(NamedTuple):
    """What the landmark model saw, and which parts it mirrored."""

    seen: Seen
    mirrored: Singles  # (T, 3), 1 where a part is mirrored
    weight: Singles  # (T, 3), from 0, where both sides are in one place, to 1


def known_of(take: Take) -> Known:
    """What is mirrored in a drawn take, by its truth."""
    places_px = take.camera.project(take.keypoints_m.astype(np.float64))
    height_px = np.median(np.ptp(places_px[..., 1], axis=1))
    wrong, weight = [], []
    for rows in _TOLD_BY:
        own, other = (
            np.linalg.norm(places_px[:, order] - take.image_px[:, rows], axis=-1).mean(axis=1)
            for order in (rows, [MIRRORED[row] for row in rows])
        )
        wrong.append(other < own)
        weight.append(np.clip(np.abs(other - own) / (_CLEAR * height_px), 0.0, 1.0))
    return Known(
        example(take).seen,
        np.stack(wrong, axis=1).astype(np.float32),
        np.stack(weight, axis=1).astype(np.float32),
    )


def varied(rng: np.random.Generator, one: Known, frames: int) -> Known:
    """A part of a stretch, perhaps its mirror image, reversed and turned."""
    view = another_view(rng, one.seen, frames)
    wrong, weight = one.mirrored[view.cut], one.weight[view.cut]
    if view.is_reversed:
        wrong, weight = wrong[::-1], weight[::-1]
    return Known(view.seen, wrong, weight)


def spoilt(rng: np.random.Generator, one: Known) -> Known:
    """Perhaps with mirrored stretches put in, and as a slower camera would have seen it."""
    if rng.random() >= _UNTOUCHED:
        one = _put_in(rng, one)
    seen, wrong, weight = one
    seen = seen._replace(
        visibility=_reported(rng, np.asarray(seen.visibility)),
        slopes=_jittered(rng, np.asarray(seen.slopes)),
    )
    if rng.random() < _THINNED:
        step, ticks = int(rng.integers(2, 4)), np.arange(len(wrong))
        kept = ticks[::step]
        nearest = kept[np.clip(np.round(ticks / step).astype(int), 0, len(kept) - 1)]
        place = kept.astype(np.float64)
        seen = Seen(*(resampled(np.asarray(part)[kept], place, ticks) for part in seen))
        wrong, weight = wrong[nearest], weight[nearest]
    return Known(Seen(*(np.asarray(part, np.float32) for part in seen)), wrong, weight)


def _reported(rng: np.random.Generator, visibility: Singles) -> Singles:
    """Visibility as another landmark model might tell it, or none at all."""
    if rng.random() < _SAME_VISIBILITY:
        return np.full_like(visibility, rng.uniform(0.5, 1.0))
    power, most = np.exp(rng.uniform(-1.0, 1.0)), rng.uniform(0.8, 1.0)
    return (most * np.clip(visibility, 0.0, 1.0) ** power).astype(np.float32)


def _jittered(rng: np.random.Generator, slopes: Singles) -> Singles:
    """Places in the picture with noise that is independent from frame to frame, perhaps none."""
    size = float(np.median(apparent_size(slopes)))
    jitter = _JITTER * size * max(rng.uniform(-1.0, 1.0), 0.0)
    return np.asarray(slopes + jitter * rng.standard_normal(slopes.shape), np.float32)


def _put_in(rng: np.random.Generator, one: Known) -> Known:
    """One to three mirrored stretches of any length, of the whole body or of parts."""
    seen, wrong = Seen(*(np.array(part) for part in one.seen)), one.mirrored.copy()
    frames = len(wrong)
    for _ in range(int(rng.integers(1, _MAX_STRETCHES + 1))):
        length = int(np.exp(rng.uniform(0.0, np.log(frames + 1))))
        start = int(rng.integers(-(length // 2), frames))
        stretch = slice(max(start, 0), max(start + length, 0))
        for part in _TOGETHER[int(rng.integers(len(_TOGETHER)))]:
            rows = list(_PARTS[part])
            others = [MIRRORED[row] for row in rows]
            for values in seen[:4]:
                values[stretch, rows] = values[stretch, others]
            wrong[stretch, part] = 1.0 - wrong[stretch, part]
    return Known(seen, wrong, one.weight)


# -- The score -------------------------------------------------------------------------------------


class SidesScore(NamedTuple):
    """Share of the frames in which a part is on the wrong side, where that is clear."""

    # As the landmark model gives it, and when swaps are undone.
    before: float
    after: float
    # The same, with more mirrored stretches put in.
    before_put_in: float
    after_put_in: float


def score_sides(takes: Sequence[Take], seed: int = 0) -> dict[str, SidesScore]:
    """How well swaps are undone in takes, for each part of the body."""
    rng = np.random.default_rng(seed)
    counts = np.zeros((4, len(SIDED_PARTS)))
    clear = np.zeros(len(SIDED_PARTS))
    for take in takes:
        known = known_of(take)
        sure = (known.weight >= 1.0) & (take.confidence > _FOUND)[:, None]
        clear += sure.sum(axis=0)
        for row, one in ((0, known), (2, _put_in(rng, known))):
            wrong = one.mirrored > 0.5
            undone = undo_side_swaps(_track(one.seen, take.confidence > _FOUND))[1]
            left = wrong != np.stack(list(undone.values()), axis=1)
            counts[row] += (wrong & sure).sum(axis=0)
            counts[row + 1] += (left & sure).sum(axis=0)
    shares = (counts / clear).T.tolist()
    return {part: SidesScore(*row) for part, row in zip(SIDED_PARTS, shares, strict=True)}


def _track(seen: Seen, present: NDArray[np.bool_]) -> RawTrack:
    """A stretch as the landmark model gives it, in pixels of a camera of any focal length."""
    pixels = {"image_px": seen.slopes, "depth_px": seen.depth}
    return RawTrack(
        times_s=np.arange(len(present)) / RATE_HZ,
        present=present,
        bridged=np.zeros(len(present), bool),
        world_m=np.asarray(seen.world_m, np.float32),
        visibility=np.asarray(seen.visibility, np.float32),
        **{name: (_FOCAL_PX * np.asarray(v)).astype(np.float32) for name, v in pixels.items()},
    )
