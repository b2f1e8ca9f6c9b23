"""Score of a lifter on takes whose truth is known."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

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


Table = list[list[str]]


def score(lifter: Lifter, takes: Sequence[Take]) -> tuple[Table, Table, float]:
    """Compare what a lifter says of takes with their truth, in tables and one number.

    The first table is of the velocity of joints inside the picture: its error, the share of fast
    motion that is found (slope of the found on the true), the share of errors within the stated
    deviation, the error in the first and last five frames over that in the middle, and the error of
    the depth behind the body's centre. The second is of the half of the frames that is most like
    those learnt from, the 40 % after it, and the rest. The number is the root mean square of all
    velocities, m/s, in takes in which nothing moves; NaN where there is none.
    """
    errors, truths, depths, sigmas, inside, frames = [], [], [], [], [], []
    still, distances, squares = [], [], []
    for take in takes:
        one = example(repaired(take))
        right, out = batch([one]), by_landmark(lifter.outputs(one.seen))
        distances.append(_distance(lifter, right))
        squares.append(take.stature_m**2 * _squares(one, right, out, take.stature_m))
        rest = out * take.stature_m
        truth = right.velocity[0] * take.stature_m
        errors.append(rest[:, 2] - truth)
        truths.append(truth)
        depths.append(rest[:, 0] - right.depth[0] * take.stature_m)
        sigmas.append(spread(out[:, 3]) * take.stature_m)
        inside.append(_inside(take))
        frames.append(np.minimum(np.arange(len(truth)), np.arange(len(truth))[::-1]))
        if np.abs(truth).max() < _STILL_MPS:
            still.append(rest[:, 2])
    error, truth, depth, sigma, seen, away = (
        np.concatenate(parts) for parts in (errors, truths, depths, sigmas, inside, frames)
    )
    joints = [["joint", "error m/s", "of true", "corr.", "kept", "within 1σ", "edge", "depth cm"]]
    for joint, rows in GROUPS.items():
        chosen = seen[:, rows]
        e, v = error[:, rows][chosen], truth[:, rows][chosen]
        if not len(e):
            continue
        fast = np.abs(v) > _FAST_MPS
        kept = 1.0 + float((e[fast] * v[fast]).sum() / max((v[fast] ** 2).sum(), 1e-12))
        within = float((np.abs(e) <= sigma[:, rows][chosen]).mean())
        from_edge = np.broadcast_to(away[:, None], chosen.shape)[chosen]
        edge = rms(e[from_edge < _EDGE]) / max(rms(e[from_edge >= _MIDDLE]), 1e-12)
        shares = (f"{value:.2f}" for value in (correlation(v, v + e), kept, within, edge))
        depth_cm = f"{100.0 * rms(depth[:, rows][chosen]):.1f}"
        joints.append([joint, f"{rms(e):.3f}", f"{rms(v):.3f}", *shares, depth_cm])
    still_mps = rms(np.concatenate(still)) if still else float("nan")
    return joints, _by_likeness(np.concatenate(distances), np.concatenate(squares)), still_mps


def _distance(lifter: Lifter, right: Batch) -> Floats:
    """How unlike what was learnt from each frame is, (T,): the features' mean square."""
    arrays = lifter.network.arrays
    features = (right.features[0] - arrays["mean"]) / arrays["spread"]
    return np.asarray((features**2).mean(axis=1))


def _squares(one: Example, right: Batch, out: Floats, stature_m: float) -> Floats:
    """Mean squares of errors over the landmarks, (T, 4), in the order of :func:`_by_likeness`.

    Of the lifter's depth and of the landmark model's own, and of their rates, in statures.
    """
    world = np.asarray(one.seen.world_m)[..., 2]
    own = (world - world[:, TORSO_CORNERS].mean(axis=1, keepdims=True)) / stature_m
    depth, velocity = right.depth[0], right.velocity[0]
    centre = velocity - rate(depth, 0)
    off = out[:, 0] - depth, own - depth, out[:, 2] - velocity, rate(own, 0) + centre - velocity
    return np.stack([np.square(each).mean(axis=1) for each in off], axis=1)


def _by_likeness(distance: Floats, squares: Floats) -> Table:
    """Whether the landmark model's own depth is better where the features are unusual."""
    headings = ["depth cm", "landmark model's", "velocity m/s", "landmark model's"]
    rows = [["frames up to", *headings]]
    for low, high in pairwise(np.quantile(distance, [0.0, *_LIKE, 1.0])):
        chosen = (distance >= low) & (distance <= high)
        depth_m, own_m, *mps = np.sqrt(squares[chosen].mean(axis=0)).tolist()
        depths_cm = (f"{100.0 * value:.1f}" for value in (depth_m, own_m))
        rows.append([f"{high:.2f}", *depths_cm, *(f"{value:.2f}" for value in mps)])
    return rows


def _inside(take: Take) -> NDArray[np.bool_]:
    """Keypoints that are in the picture, (T, 33)."""
    places = take.camera.project(take.keypoints_m.astype(np.float64))
    size = (take.camera.width, take.camera.height)
    return np.asarray(((places >= 0.0) & (places <= size)).all(axis=-1))
