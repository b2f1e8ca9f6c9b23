"""Score of a lifter on takes whose truth is known."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.lifter import POINTS, Lifter, spread
from sd2core.body.track import LANDMARKS
from tools.train_lifter.examples import batch, example
from tools.train_lifter.takes import Take

_EDGE = 5
_MIDDLE = 10
_FAST_MPS = 0.5
_STILL_MPS = 0.1

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


class Score(NamedTuple):
    """Errors of a lifter.

    Parameters
    ----------
    still_mps : float
        Root mean square of all velocities found in takes in which nothing moves;
        NaN where there is no such take.
    """

    joints: dict[str, JointScore]
    still_mps: float


def score(lifter: Lifter, takes: Sequence[Take]) -> Score:
    """Compare what a lifter says of takes with their truth."""
    errors, truths, depths, sigmas, inside, frames = [], [], [], [], [], []
    still = []
    for take in takes:
        one = example(take)
        right = batch([one])
        rest = lifter.outputs(one.seen)[:, 2:].reshape(-1, 4, POINTS) * take.stature_m
        truth = right.velocity[0] * take.stature_m
        errors.append(rest[:, 2] - truth)
        truths.append(truth)
        depths.append(rest[:, 0] - right.depth[0] * take.stature_m)
        sigmas.append(spread(lifter.outputs(one.seen)[:, 2 + 3 * POINTS :]) * take.stature_m)
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
            _rms(e),
            _rms(v),
            _correlation(v, v + e),
            1.0 + float((e[fast] * v[fast]).sum() / max((v[fast] ** 2).sum(), 1e-12)),
            float((np.abs(e) <= sigma[:, rows][chosen]).mean()),
            _rms(e[from_edge < _EDGE]) / max(_rms(e[from_edge >= _MIDDLE]), 1e-12),
            100.0 * _rms(depth[:, rows][chosen]),
        )
    return Score(joints, _rms(np.concatenate(still)) if still else float("nan"))


def _inside(take: Take) -> NDArray[np.bool_]:
    """Keypoints that are in the picture, (T, 33)."""
    places = take.camera.project(take.keypoints_m.astype(np.float64))
    size = (take.camera.width, take.camera.height)
    return np.asarray(((places >= 0.0) & (places <= size)).all(axis=-1))


def _rms(values: NDArray[np.floating]) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else float("nan")


def _correlation(one: NDArray[np.floating], other: NDArray[np.floating]) -> float:
    if not one.std() or not other.std():
        return float("nan")
    return float(np.corrcoef(one, other)[0, 1])
