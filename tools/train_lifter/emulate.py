"""Emulated output of the landmark network for people who are not drawn.

Measured on drawn takes: where each landmark lies beside our keypoint, fixed to its
bone; how the network's metres and depth follow the truth; and what is left over. What
is left over is taken as it is from a drawn take of a similar motion, so that it keeps
its correlation in time and between landmarks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.body.lifter_features import Seen
from sd2core.body.rotations import applied
from sd2core.body.track import LANDMARKS
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
