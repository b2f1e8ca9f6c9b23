"""Measurements that a body is fitted to: landmarks in the picture and their lifted depth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from sd2core.body.camera import PinholeCamera
from sd2core.body.lifter import Lifted, LiftedTrack
from sd2core.body.rig import Rig
from sd2core.body.rotations import Floats
from sd2core.body.track import LANDMARK, TORSO_CORNERS, Landmarks, LandmarkTrack, parts

_PICTURE_SD = 0.006
"""Standard deviation of a well visible landmark, in apparent statures: 3 pixels of 480."""
_LEAST_VISIBILITY = 0.05
DEPTH_CAUTION = 2.0
VELOCITY_CAUTION = 4.0
"""Neighbouring frames err alike, so each tells less than it seems to."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """Measurements of a stretch of frames, in the camera frame, with standard deviations."""

    times_s: Floats  # (T,)
    slopes: Floats  # (T, 33, 2) x / z and y / z of each landmark
    slopes_sd: Floats  # (T, 33)
    trunk: tuple[int, ...]  # landmarks whose mean is the middle of the trunk
    depth_m: Floats  # (T, 33) behind the middle of the trunk
    depth_sd_m: Floats  # (T, 33)
    trunk_m: Floats  # (T,) depth of the middle of the trunk
    trunk_sd_m: Floats  # (T,)
    velocity_mps: Floats  # (T, 33) change of depth_m, positive away
    velocity_sd_mps: Floats  # (T, 33)

    @property
    def points_m(self) -> Floats:
        """Places of the landmarks by slopes and depths, (T, 33, 3)."""
        depth = (self.trunk_m[:, None] + self.depth_m)[..., None]
        return np.concatenate([self.slopes * depth, depth], axis=-1)

    def __getitem__(self, frames: slice | NDArray[np.intp]) -> Evidence:
        """Evidence of some frames."""
        parts = {
            field.name: getattr(self, field.name)[frames]
            for field in fields(self)
            if field.name != "trunk"
        }
        return Evidence(trunk=self.trunk, **parts)


def evidence_of(
    track: LandmarkTrack, lifted: LiftedTrack, camera: PinholeCamera, stature_m: float
) -> Evidence:
    """Landmarks and depths of the same frames in metres and seconds, scaled by the stature."""
    # How the trunk moves is told better by how the person grows in the picture.
    trunk = lifted.velocity[:, TORSO_CORNERS].mean(axis=1, keepdims=True)
    visibility = np.clip(track.visibility.astype(np.float64), _LEAST_VISIBILITY, 1.0)
    depth_m = stature_m * lifted.centre_depth
    return Evidence(
        times_s=np.array(track.timebase.times_s),
        slopes=camera.slopes(track.image_px.astype(np.float64)),
        slopes_sd=_PICTURE_SD * (stature_m / depth_m)[:, None] / visibility,
        trunk=TORSO_CORNERS,
        depth_m=stature_m * lifted.depth,
        depth_sd_m=DEPTH_CAUTION * stature_m * lifted.depth_sigma,
        trunk_m=depth_m,
        trunk_sd_m=DEPTH_CAUTION * stature_m * lifted.centre_sigma,
        velocity_mps=stature_m * (lifted.velocity - trunk),
        velocity_sd_mps=VELOCITY_CAUTION * stature_m * lifted.velocity_sigma,
    )


class EvidenceInParts:
    """Evidence of a clip of any length, made part by part."""

    def __init__(
        self, track: Landmarks, lifted: Lifted, camera: PinholeCamera, stature_m: float
    ) -> None:
        self._track, self._lifted = track, lifted
        self._camera, self._stature_m = camera, stature_m

    def part(self, start: int, stop: int) -> tuple[Evidence, LandmarkTrack, LiftedTrack]:
        """Evidence of frames ``start`` to ``stop``, with its track and lifted track."""
        track, lifted = self._track.part(start, stop), self._lifted.part(start, stop)
        return evidence_of(track, lifted, self._camera, self._stature_m), track, lifted

    def chosen(
        self, frames: NDArray[np.intp], looked: Callable[[int], None]
    ) -> tuple[Evidence, Floats]:
        """Evidence of some frames (ascending), and their visibility (n, 33).

        ``looked`` is called with the number of parts that were read.
        """
        pieces, trust = [], []
        for number, (start, stop) in enumerate(parts(len(self._track))):
            looked(number)
            rows = frames[(frames >= start) & (frames < stop)] - start
            if len(rows):
                evidence, track, _ = self.part(start, stop)
                pieces.append(evidence[rows])
                trust.append(track.visibility[rows].astype(np.float64))
        joined = {
            field.name: np.concatenate([getattr(piece, field.name) for piece in pieces])
            for field in fields(Evidence)
            if field.name != "trunk"
        }
        return Evidence(trunk=pieces[0].trunk, **joined), np.concatenate(trust)


# -- Depth of the arms -----------------------------------------------------------------------------
#
# A limb that looks shorter than it is points towards the camera or away from it. For upper arm
# and forearm that makes four cases per frame; the likeliest sequence of them (Viterbi) lies near
# the lifted depths, moves little along the line of sight, and keeps arms in front of the chest.

_CASES = np.array([[u, f] for u in (-1.0, 1.0) for f in (-1.0, 1.0)])  # upper arm, forearm

_SPEED_MPS = 1.5
"""Standard deviation of what elbows and wrists do along the line of sight."""
_COMMON_M = 0.03
_BEHIND_SD_M = 0.03
_LEAN_SD_M = 0.06
_MOST = 3.0
"""Standard deviations at which depths and habits stop to count more."""


def resolve_arm_depths(evidence: Evidence, rig: Rig) -> Evidence:
    """Replace depths of elbows, wrists and hands by those that the arms' lengths allow, ± 6 cm."""
    points_m = evidence.points_m
    back = _back(points_m)
    for side in "LR":
        _lean(points_m, evidence, rig, back, side)
    arms = [
        LANDMARK[f"{part}.{side}"]
        for part in ("elbow", "wrist", "pinky", "index", "thumb")
        for side in "LR"
    ]
    depth_m, depth_sd_m = evidence.depth_m.copy(), evidence.depth_sd_m.copy()
    depth_m[:, arms] = points_m[:, arms, 2] - evidence.trunk_m[:, None]
    depth_sd_m[:, arms] = _LEAN_SD_M
    return replace(evidence, depth_m=depth_m, depth_sd_m=depth_sd_m)


def _back(points_m: Floats) -> Floats:
    """Unit vectors out of the back, (T, 3)."""
    left, right = points_m[:, LANDMARK["shoulder.L"]], points_m[:, LANDMARK["shoulder.R"]]
    hips = 0.5 * (points_m[:, LANDMARK["hip.L"]] + points_m[:, LANDMARK["hip.R"]])
    # x to the person's left, y down: their cross product points backwards.
    back = np.cross(left - right, hips - 0.5 * (left + right))
    return np.asarray(back / np.linalg.norm(back, axis=1, keepdims=True))


def _lean(points_m: Floats, evidence: Evidence, rig: Rig, back: Floats, side: str) -> None:
    rows = [LANDMARK[f"{part}.{side}"] for part in ("shoulder", "elbow", "wrist")]
    rest = rig.keypoints.rest_m[rows]
    lengths_m = np.linalg.norm(np.diff(rest, axis=0), axis=1)
    shoulder = points_m[:, rows[0]]
    rays = np.concatenate(
        [evidence.slopes[:, rows], np.ones((len(points_m), 3, 1))], axis=2
    )  # (T, 3, 3)
    elbow = _on_ray(shoulder[:, None], rays[:, None, 1], lengths_m[0], _CASES[:, 0])
    wrist = _on_ray(elbow, rays[:, None, 2], lengths_m[1], _CASES[:, 1])  # (T, 4, 3)
    chosen = _likeliest(points_m, evidence, back, rows, elbow, wrist)
    frames = np.arange(len(points_m))
    points_m[:, rows[1]] = elbow[frames, chosen]
    shift = wrist[frames, chosen] - points_m[:, rows[2]]
    for part in ("wrist", "pinky", "index", "thumb"):
        points_m[:, LANDMARK[f"{part}.{side}"]] += shift


def _on_ray(start: Floats, ray: Floats, length_m: float, sign: Floats) -> Floats:
    """Point of a ray at a distance from a start, before or behind it; else the nearest point."""
    square = (ray * ray).sum(axis=-1)
    nearest = (ray * start).sum(axis=-1) / square
    short = length_m**2 - (start * start).sum(axis=-1) + nearest**2 * square
    depth = nearest + sign * np.sqrt(np.maximum(short, 0.0) / square)
    return np.asarray(depth[..., None] * ray)


def _likeliest(
    points_m: Floats,
    evidence: Evidence,
    back: Floats,
    rows: list[int],
    elbow: Floats,
    wrist: Floats,
) -> NDArray[np.intp]:
    """Number of the likeliest case in every frame, (T,)."""
    both = np.stack([elbow, wrist], axis=2)  # (T, 4, 2, 3)
    # How far a limb leans, not where it is: lifted depths are drawn towards the trunk's.
    lean = both[..., 2].copy()
    lean[..., 1] -= lean[..., 0]
    lean[..., 0] -= points_m[:, rows[:1], 2]
    lifted = np.diff(points_m[:, rows, 2], axis=1)[:, None]
    away = (lean - lifted) / (evidence.depth_sd_m[:, None, rows[1:]] / DEPTH_CAUTION)
    shoulders = points_m[:, [LANDMARK["shoulder.L"], LANDMARK["shoulder.R"]]].mean(axis=1)
    beyond = ((both - shoulders[:, None, None]) * back[:, None, None]).sum(axis=-1)
    behind = np.maximum(beyond - _COMMON_M, 0.0) / _BEHIND_SD_M
    price = _saturated(away).sum(axis=-1) + _saturated(behind).sum(axis=-1)  # (T, 4)
    best = price[0]
    came = np.zeros((len(price), len(_CASES)), np.intp)
    for t in range(1, len(price)):
        move = np.diff(evidence.times_s[t - 1 : t + 1])[0] * _SPEED_MPS
        step = (both[t][None, ..., 2] - both[t - 1][:, None, :, 2]) / move  # (from, to, 2)
        total = best[:, None] + 0.5 * (step**2).sum(axis=-1)
        came[t] = total.argmin(axis=0)
        best = total.min(axis=0) + price[t]
    chosen = np.empty(len(price), np.intp)
    chosen[-1] = best.argmin()
    for t in range(len(price) - 1, 0, -1):
        chosen[t - 1] = came[t, chosen[t]]
    return chosen


def _saturated(residual: Floats) -> Floats:
    """Half the square, but no more than :data:`_MOST` allows."""
    return 0.5 * np.minimum(residual**2, _MOST**2)
