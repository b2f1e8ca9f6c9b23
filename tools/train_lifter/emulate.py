"""Examples that the lifter learns from, also of people who are not drawn.

Measured on drawn takes, the output of the landmark network is emulated: where each landmark lies
beside our keypoint, fixed to its bone; how the network's metres and depth follow the truth; and
what is left over. What is left over is taken as it is from a drawn take of a similar motion, so
that it keeps its correlation in time and between landmarks. Batches are takes cut, mirrored, turned
and reversed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.lifter import FEET
from sd2core.body.lifter_features import Seen, backwards, features, mirrored, rate, typical_size
from sd2core.body.rotations import applied
from sd2core.body.track import LANDMARKS, MIRRORED, TORSO_CORNERS
from sd2core.mocap.body_motion import BodyMotion
from tools.train_lifter.deeds import Manner
from tools.train_lifter.takes import Stage, Take

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

_HIPS = [LANDMARKS.index("hip.L"), LANDMARKS.index("hip.R")]
_SHOULDERS = [LANDMARKS.index("shoulder.L"), LANDMARKS.index("shoulder.R")]
_WRISTS = [LANDMARKS.index("wrist.L"), LANDMARKS.index("wrist.R")]
_ANKLES = [LANDMARKS.index("ankle.L"), LANDMARKS.index("ankle.R")]
_WALK = 2  # takes have 0 and 1 in this place
_CAPTURED = 3
_MANNERS: tuple[Manner, ...] = ("any", "natural", "gestures", "forearms")
"""Manners of the motions, in turn."""
_CANDIDATES = 24
_ROBUST = 0.06
"""Statures; residuals beyond count less."""


def landmark_offsets(takes: Sequence[Take]) -> Floats:
    """Offsets of the landmarks from our keypoints, at rest, in statures, (33, 3).

    A robust fit to what is seen across the view while the bones turn.
    """
    normal = np.zeros((33, 3, 3))
    right = np.zeros((33, 3))
    offsets = np.zeros((33, 3))
    for _ in range(4):
        normal[:], right[:] = 1e-3 * np.eye(3), 0.0
        for take in takes:
            seen = _across(take)
            turns = take.bone_turns[..., :2, :].astype(np.float64)
            left = seen - (turns @ offsets[:, :, None])[..., 0]
            sure = take.visibility * (take.confidence > 0.5)[:, None]
            weight = sure / (1.0 + (left**2).sum(axis=-1) / _ROBUST**2) ** 2
            normal += np.einsum("tk,tkai,tkaj->kij", weight, turns, turns)
            right += np.einsum("tk,tkai,tka->ki", weight, turns, seen)
        offsets[:] = np.linalg.solve(normal, right[..., None])[..., 0]
    return offsets


def _across(take: Take) -> Floats:
    """Landmarks beside keypoints across the view, in statures, (T, 33, 2)."""
    places = take.keypoints_m.astype(np.float64)
    off = take.camera.slopes(take.image_px.astype(np.float64)) - places[..., :2] / places[..., 2:]
    return np.asarray(off * places[..., 2:] / take.stature_m)


@dataclass(frozen=True, eq=False)
class Walk:
    """Motion before a camera, without pictures of it."""

    places: Singles  # (T, 33, 3), of the keypoints in statures, camera frame
    apparent: Singles  # (T, 33, 3), of the landmarks


class Emulator:
    """Draws what the landmark network would say.

    Parameters
    ----------
    takes : sequence of Take
        Of equal length.
    """

    def __init__(self, takes: Sequence[Take]) -> None:
        self.offsets = landmark_offsets(takes)
        walks = [self.walk(take.keypoints_m, take.bone_turns, take.stature_m) for take in takes]
        across, world, depth, regressors = [], [], [], []
        for take, walk in zip(takes, walks, strict=True):
            slopes = take.camera.slopes(take.image_px.astype(np.float64))
            ideal = walk.apparent[..., :2] / walk.apparent[..., 2:]
            across.append((slopes - ideal) * walk.places[..., 2:])
            regressors.append(_regressors(walk.places))
            world.append(take.world_m)
            depth.append(take.depth_px / take.camera.focal_px * walk.places[..., 2])
        self._across = np.array(across, np.float32)  # (N, T, 33, 2)
        known = np.array(regressors, np.float32)  # (N, T, 33, K)
        outputs = np.concatenate([np.array(world), np.array(depth)[..., None]], axis=-1)
        self._gains = np.empty((33, known.shape[-1], 4), np.float32)
        for k in range(33):
            x, y = known[:, :, k].reshape(-1, known.shape[-1]), outputs[:, :, k].reshape(-1, 4)
            gram = x.T @ x + 1e-3 * len(x) * np.eye(x.shape[1])
            self._gains[k] = np.linalg.solve(gram, x.T @ y)
        self._left = (outputs - np.einsum("ntki,kio->ntko", known, self._gains)).astype(np.float32)
        self._visibility = np.array([take.visibility for take in takes])
        self._sure = np.array([take.confidence for take in takes])
        self._marks = np.array([_marks(walk.places) for walk in walks])
        self._spread = self._marks.std(axis=0) + 1e-6

    def walk(self, keypoints_m: NDArray[Any], bone_turns: NDArray[Any], stature_m: float) -> Walk:
        """A motion in statures, with the places of the landmarks."""
        places = keypoints_m / stature_m
        moved = applied(bone_turns.astype(np.float64), self.offsets)
        return Walk(places.astype(np.float32), (places + moved).astype(np.float32))

    def seen(self, rng: np.random.Generator, walk: Walk) -> Seen:
        """Plausible output of the network for a motion."""
        drawn = rng.integers(0, len(self._marks), _CANDIDATES)
        far = (((self._marks[drawn] - _marks(walk.places)) / self._spread) ** 2).sum(axis=1)
        donor = int(drawn[np.argmin(far)])
        size = np.float32(rng.uniform(0.3, 1.0))
        part = slice(len(walk.places))
        depth = walk.places[..., 2]
        slopes = walk.apparent[..., :2] / walk.apparent[..., 2:]
        slopes = slopes + size * self._across[donor, part] / depth[..., None]
        outputs = np.einsum("tki,kio->tko", _regressors(walk.places), self._gains)
        outputs += size * self._left[donor, part]
        return Seen(
            slopes,
            outputs[..., 3] / depth,
            outputs[..., :3],
            self._visibility[donor, part],
            self._sure[donor, part],
        )


def random_walks(emulator: Emulator, count: int, seed: int) -> list[Walk]:
    """Motions of random people, not drawn."""
    stage, walks = Stage(), []
    for number in range(count):
        rng = np.random.default_rng((seed, _WALK, number))
        manner = _MANNERS[number % len(_MANNERS)]
        scene = stage.scene(rng, manner=manner, elbows_rest=manner == "natural")
        walks.append(emulator.walk(scene.keypoints_m, scene.bone_turns, scene.shape.stature_m))
    return walks


def captured_walks(
    emulator: Emulator, motions: Sequence[BodyMotion], count: int, seed: int
) -> list[Walk]:
    """Motions of random bodies that move as real people did, not drawn."""
    stage, walks = Stage(motions), []
    for number in range(count):
        scene = stage.captured(np.random.default_rng((seed, _CAPTURED, number)))
        walks.append(emulator.walk(scene.keypoints_m, scene.bone_turns, scene.shape.stature_m))
    return walks


def _regressors(places: Singles) -> Singles:
    """Predictors of the network's metres: place from the hips, direction of the trunk."""
    hips = places[:, _HIPS].mean(axis=1, keepdims=True)
    shoulders = places[:, _SHOULDERS]
    across = np.broadcast_to((shoulders[:, :1] - shoulders[:, 1:]), places.shape)
    trunk = np.broadcast_to(shoulders.mean(axis=1, keepdims=True) - hips, places.shape)
    ones = np.ones((*places.shape[:2], 1), np.float32)
    return np.concatenate([places - hips, across, trunk, ones], axis=-1).astype(np.float32)


def _marks(places: Singles) -> Floats:
    """By what motions are alike: facing, distance, speed of hands and feet, place of the hands."""
    shoulders, wrists = places[:, _SHOULDERS], places[:, _WRISTS]
    across = shoulders[:, 0] - shoulders[:, 1]
    facing = np.arctan2(across[:, 2].mean(), across[:, 0].mean())
    ends = places[:, _WRISTS + _ANKLES]
    speed = np.log(0.03 + 30.0 * np.abs(np.diff(ends, axis=0)).mean(axis=(0, 2)))
    ahead = (wrists - shoulders)[..., 1:].mean(axis=0).ravel()
    distance = np.log(places[:, :, 2].mean())
    wide = [2.0 * np.cos(facing), 2.0 * np.sin(facing), 2.0 * distance]
    return np.concatenate([wide, 1.5 * speed, ahead])


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
