"""Measurement of the errors of fits, on clips whose motion is known."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sd2core.body.fit import fit_motion
from sd2core.body.landmark_files import load_track
from sd2core.body.rig import KeypointSpace
from sd2core.body.rotations import Floats, applied, product, to_vector, transposed
from sd2core.body.shape import ShapeSpace
from sd2core.errors import Sd2Error
from sd2core.progress import Progress, silent
from sd2core.simulate.campaign.fit_errors import FitErrors, GroupErrors
from sd2core.simulate.campaign.posture import Group, Posture, all_groups, posture
from sd2core.version import __version__
from tools.fitting.clips import clip_named, scene
from tools.fitting.truth import Truth

_LAGS = (1, 2, 3, 4, 6, 9, 13, 19, 28, 42)
"""Frames apart."""
_VELOCITY_LAGS = slice(0, 3)
_LENGTHS = np.geomspace(0.02, 3.0, 41)
_MIXINGS = (0.3, 0.5, 1.0, 2.0, 5.0)
_RIDGE = 0.02
"""Ridge, as a share of the features' variance: what hardly varies explains nothing."""


class Sample(NamedTuple):
    """One clip's features (T, m) and errors (T, n) of one group (of one side)."""

    features: Floats
    errors: Floats


def measure_errors(truths: Sequence[Truth], fits: Path, progress: Progress = silent) -> FitErrors:
    """Measure from clips and the landmarks that were found in them, which are fitted again.

    A kept mesh does not say its pose; the result is the same. ``fits`` is a folder with
    ``NAME.landmarks.npz``, as ``python -m tools.fitting score --keep`` leaves them; ``progress``
    counts clips. Raises Sd2Error when landmarks of a clip are missing, or a clip is none of ours.
    """
    space = ShapeSpace()
    samples: dict[Group, list[Sample]] = {group: [] for group, _ in all_groups()}
    shapes = []
    for number, truth in enumerate(truths):
        progress(number, len(truths))
        of_clip, of_shape = _compared(truth, fits, space)
        shapes.append(of_shape)
        for (group, _), sample in of_clip.items():
            samples[group].append(sample)
    progress(len(truths), len(truths))
    apart = np.array(shapes)
    mean = apart.mean(axis=0)
    centred = apart - mean
    return FitErrors(
        {group: group_errors(own) for group, own in samples.items()},
        mean,
        centred.T @ centred / len(apart),
        {
            "clips": [truth.name for truth in truths],
            "frames": sum(len(sample.errors) for sample in samples["trunk"]),
            "command": "python -m tools.fitting errors",
            "version": __version__,
        },
    )


def _compared(
    truth: Truth, fits: Path, space: ShapeSpace
) -> tuple[dict[tuple[Group, str], Sample], Floats]:
    """Poses and errors of one clip's fit, and the error of its shape."""
    landmarks = fits / f"{truth.name}.landmarks.npz"
    if not landmarks.exists():
        raise Sd2Error(
            f"{fits} holds no landmarks of the clip {truth.name!r}",
            f"{landmarks.name}",
            f"Make them: python -m tools.fitting score CLIPS --keep {fits}",
        )
    known = scene(clip_named(truth.name), space)
    fit = fit_motion(load_track(landmarks), truth.camera, stature_m=truth.stature_m)
    if len(fit.timebase) != len(known.times_s) or not fit.present.all():
        raise Sd2Error(
            f"{truth.name}: the fit has {int(fit.present.sum())} frames with a person",
            f"all {len(known.times_s)} of the clip",
        )
    skeleton = space.skeleton(fit.shape)
    rig = KeypointSpace(space).rig(fit.shape)
    transforms = skeleton.transforms(rig.body_rotations(fit.pose.turns), fit.pose.translation_m)
    true = posture(known.skeleton, known.transforms)
    fitted = posture(skeleton, transforms, true.axes)
    samples = {
        (group, side): Sample(true.features(group, side), errors(fitted, true, group, side))
        for group, side in all_groups()
    }
    return samples, np.asarray(fit.shape.coefficients - known.shape.coefficients)


def group_errors(samples: Sequence[Sample]) -> GroupErrors:
    """The model of :mod:`~sd2core.simulate.campaign.fit_errors` for one group."""
    gain = _regression(samples)
    left = [sample.errors - sample.features @ gain[:, 1:].T - gain[:, 0] for sample in samples]
    means = np.array([one.mean(axis=0) for one in left])
    total = np.mean([(one**2).mean(axis=0) for one in left], axis=0)
    length, mixing, spread = _kernel(samples, left, total)
    # What the process explains of the clips' own means is no bias.
    rest = max(float(total.sum() - np.trace(spread)), 0.0)
    between = means.T @ means / len(means)
    bias = between * (rest / max(float(np.trace(between)), 1e-30))
    return GroupErrors(gain, bias, spread, length, mixing)


def _regression(samples: Sequence[Sample]) -> Floats:
    """Ridge regression of errors on features, every clip with the same weight, (n, 1 + m)."""
    features = [sample.features for sample in samples]
    middle = np.mean([one.mean(axis=0) for one in features], axis=0)
    gram = np.zeros((len(middle), len(middle)))
    right = np.zeros((len(middle), samples[0].errors.shape[1]))
    average = np.mean([sample.errors.mean(axis=0) for sample in samples], axis=0)
    for sample in samples:
        about = sample.features - middle
        gram += about.T @ about / len(about)
        right += about.T @ (sample.errors - average) / len(about)
    size = np.trace(gram) / len(gram)
    slope = np.linalg.solve(gram + _RIDGE * size * np.eye(len(gram)), right).T
    return np.concatenate([(average - slope @ middle)[:, None], slope], axis=1)


def _kernel(
    samples: Sequence[Sample], left: Sequence[Floats], total: Floats
) -> tuple[float, float, Floats]:
    """Length and exponent of the kernel, and the covariance of the process.

    The variogram over frames apart is matched, as the motion of the clips makes it from
    distances of poses: a kernel is right when errors change as fast as they do, and are as
    large as they are (their mean squares ``total`` are the variogram's sill, of which clips
    that show few poses tell little). The covariance is that of changes over the shortest
    lags, which velocities are taken from: a fit that keeps the hand's velocity has an elbow
    and a wrist whose changes cancel.
    """
    sill = np.maximum(total, 1e-12 * total.max())
    seen, far = [], []
    for lag in _LAGS:
        pairs = [
            (one[lag:] - one[:-lag], sample.features[lag:] - sample.features[:-lag])
            for sample, one in zip(samples, left, strict=True)
            if len(one) > lag
        ]
        changed = np.concatenate([one for one, _ in pairs])
        seen.append(0.5 * changed.T @ changed / len(changed))
        far.append((np.concatenate([moved for _, moved in pairs]) ** 2).sum(axis=1))
    apart = np.array([np.diag(one) for one in seen]) / sill  # (lags, n)
    best: tuple[float, float, float, Floats] = (np.inf, 0.0, 0.0, np.zeros_like(seen[0]))
    for length, mixing in itertools.product(_LENGTHS, _MIXINGS):
        shown = np.array(
            [1.0 - ((1.0 + h2 / (2.0 * mixing * length**2)) ** -mixing).mean() for h2 in far]
        )
        misfit = float((np.log(apart.mean(axis=1) / shown) ** 2).mean())
        if misfit < best[0]:
            changes = np.mean(seen[_VELOCITY_LAGS], axis=0) / shown[_VELOCITY_LAGS].mean()
            best = (misfit, float(length), float(mixing), changes)
    return best[1:]


def errors(fitted: Posture, true: Posture, group: Group, side: str = "") -> Floats:
    """Difference of the fitted posture from the true one, (T, n).

    For the place metres along the axes of the line of sight, for the trunk rotation
    vectors in them, for limbs differences of directions.
    """
    frames = len(true.axes)
    if group == "place":
        return fitted.place_m - true.place_m
    if group == "trunk":
        turned = to_vector(product(fitted.trunk, transposed(true.trunk)))
        return applied(true.axes[:, None], turned).reshape(frames, -1)
    return (fitted.limbs[group, side] - true.limbs[group, side]).reshape(frames, -1)
