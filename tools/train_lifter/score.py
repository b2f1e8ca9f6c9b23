"""Score of a lifter on takes whose truth is known."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.lifter import Lifter, by_landmark, spread
from sd2core.body.lifter_features import rate
from sd2core.body.track import LANDMARKS, TORSO_CORNERS
from sd2core.compare.measures import correlation, rms
from tools.train_lifter.examples import Batch, Example, batch, example
from tools.train_lifter.fits import repaired
from tools.train_lifter.takes import Take

Floats = NDArray[np.floating]

_EDGE = 5
_MIDDLE = 10
_FAST_MPS = 0.5
_STILL_MPS = 0.1
_LIKE = (0.5, 0.9)

_JOINTS = ("wrist", "index", "elbow", "shoulder", "hip", "knee", "ankle", "nose")
GROUPS = {
    joint: [row for row, name in enumerate(LANDMARKS) if name.split(".")[0] == joint]
    for joint in _JOINTS
}


class JointScore(NamedTuple):
    """Errors of one joint, both sides, over all frames in which it is inside the picture.

    Parameters
    ----------
    rms_mps : float
        Error of the velocity along z.
    truth_mps : float
        Root mean square of the true velocity.
    kept : float
        Share of the true velocity that is found where it is above 0.5 m/s (slope of
        the found on the true).
    covered : float
        Share of errors within one standard deviation as stated.
    edge : float
        Error in the first and last five frames over that in the middle.
    depth_cm : float
        Error of the depth behind the body's centre.
    """

    rms_mps: float
    truth_mps: float
    correlation: float
    kept: float
    covered: float
    edge: float
    depth_cm: float


class LikenessScore(NamedTuple):
    """Errors of all landmarks in frames that are about as like those learnt from.

    Parameters
    ----------
    distance : float
        Largest mean square of the features, in their standard deviations.
    depth_cm, own_depth_cm : float
        Error of the depth behind the body's centre: of the lifter, and of the landmark model.
    velocity_mps, own_velocity_mps : float
        Error of its rate; the lifter's with its error of the centre's.
    """

    distance: float
    depth_cm: float
    own_depth_cm: float
    velocity_mps: float
    own_velocity_mps: float


class Score(NamedTuple):
    """Errors of a lifter.

    Parameters
    ----------
    likeness : list of LikenessScore
        Of the half of the frames that is most like those learnt from, the 40 % after it, and the
        tenth that is least like them.
    still_mps : float
        Root mean square of all velocities found in takes in which nothing moves;
        NaN where there is no such take.
    """

    joints: dict[str, JointScore]
    likeness: list[LikenessScore]
    still_mps: float


def score(lifter: Lifter, takes: Sequence[Take]) -> Score:
    """Compare what a lifter says of takes with their truth."""
    errors, truths, depths, sigmas, inside, frames = [], [], [], [], [], []
    still, distances, squares = [], [], []
    for take in takes:
        one = example(repaired(take))
        right, said = batch([one]), by_landmark(lifter.outputs(one.seen))
        distances.append(_distance(lifter, right))
        squares.append(take.stature_m**2 * _squares(one, right, said, take.stature_m))
        rest = said * take.stature_m
        truth = right.velocity[0] * take.stature_m
        errors.append(rest[:, 2] - truth)
        truths.append(truth)
        depths.append(rest[:, 0] - right.depth[0] * take.stature_m)
        sigmas.append(spread(said[:, 3]) * take.stature_m)
        inside.append(_inside(take))
        frames.append(np.minimum(np.arange(len(truth)), np.arange(len(truth))[::-1]))
        if np.abs(truth).max() < _STILL_MPS:
            still.append(rest[:, 2])
    error, truth, depth, sigma, seen, away = (
        np.concatenate(parts) for parts in (errors, truths, depths, sigmas, inside, frames)
    )
    joints = {}
    for joint, rows in GROUPS.items():
        chosen = seen[:, rows]
        e, v = error[:, rows][chosen], truth[:, rows][chosen]
        if not len(e):
            continue
        fast = np.abs(v) > _FAST_MPS
        from_edge = np.broadcast_to(away[:, None], chosen.shape)[chosen]
        joints[joint] = JointScore(
            rms(e),
            rms(v),
            correlation(v, v + e),
            1.0 + float((e[fast] * v[fast]).sum() / max((v[fast] ** 2).sum(), 1e-12)),
            float((np.abs(e) <= sigma[:, rows][chosen]).mean()),
            rms(e[from_edge < _EDGE]) / max(rms(e[from_edge >= _MIDDLE]), 1e-12),
            100.0 * rms(depth[:, rows][chosen]),
        )
    still_mps = rms(np.concatenate(still)) if still else float("nan")
    likeness = _by_likeness(np.concatenate(distances), np.concatenate(squares))
    return Score(joints, likeness, still_mps)


def _distance(lifter: Lifter, right: Batch) -> Floats:
    """How unlike what was learnt from each frame is, (T,): the features' mean square."""
    arrays = lifter.network.arrays
    features = (right.told[0] - arrays["mean"]) / arrays["spread"]
    return np.asarray((features**2).mean(axis=1))


def _squares(one: Example, right: Batch, said: Floats, stature_m: float) -> Floats:
    """Mean squares of errors over the landmarks, (T, 4), in the order of LikenessScore.

    Of the lifter's depth and of the landmark model's own, and of their rates, in statures.
    """
    world = np.asarray(one.seen.world_m)[..., 2]
    own = (world - world[:, TORSO_CORNERS].mean(axis=1, keepdims=True)) / stature_m
    depth, velocity = right.depth[0], right.velocity[0]
    centre = velocity - rate(depth, 0)
    off = said[:, 0] - depth, own - depth, said[:, 2] - velocity, rate(own, 0) + centre - velocity
    return np.stack([np.square(each).mean(axis=1) for each in off], axis=1)


def _by_likeness(distance: Floats, squares: Floats) -> list[LikenessScore]:
    """Whether the landmark model's own depth is better where the features are unusual."""
    edges = np.quantile(distance, [0.0, *_LIKE, 1.0])
    rows = []
    for low, high in pairwise(edges):
        chosen = (distance >= low) & (distance <= high)
        depth_m, own_m, mps, own_mps = np.sqrt(squares[chosen].mean(axis=0)).tolist()
        rows.append(LikenessScore(float(high), 100 * depth_m, 100 * own_m, mps, own_mps))
    return rows


def _inside(take: Take) -> NDArray[np.bool_]:
    """Keypoints that are in the picture, (T, 33)."""
    places = take.camera.project(take.keypoints_m.astype(np.float64))
    size = (take.camera.width, take.camera.height)
    return np.asarray(((places >= 0.0) & (places <= size)).all(axis=-1))
