"""Gauss–Newton over a whole stretch of frames, in stages."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import partial

import numpy as np

from sd2core.body.evidence import Evidence
from sd2core.body.initial import Pose
from sd2core.body.objective import Objective, Residuals, cost, weighted
from sd2core.body.rig import Rig
from sd2core.body.rotations import Floats


def one_thread() -> AbstractContextManager[object]:
    """Context in which products and factorisations of this process use one thread.

    A fit consists of many small ones, which gain nothing from threads; beside other work
    threads that wait for each other made it seven times as slow.
    """
    # SciPy's own copy of the library is limited only once it is loaded.
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_limits

    limits: AbstractContextManager[object] = threadpool_limits(limits=1, user_api="blas")
    return limits


_FIRST_ROTATION_RADPS2 = 60.0
_FIRST_TRANSLATION_MPS2 = 6.0
_LEAST_ROTATION_RADPS2 = 0.3
_LEAST_TRANSLATION_MPS2 = 0.05
_LIVELINESS = 1.0
"""Standard deviation of an acceleration over what was found around it."""
_AROUND_S = 0.15
ROUNDS = 4
_STEPS = 8
_CONVERGED = 1e-3


def solve(
    rig: Rig,
    evidence: Evidence,
    start: Pose,
    tick: Callable[[int], None] = lambda done: None,
) -> Pose:
    """Pose through time that agrees best with the evidence of consecutive frames.

    The smoothness follows the motion: after each round, every degree of freedom may accelerate as
    much as it was found to do around each moment. ``tick`` is called often with the number of
    rounds done, of :data:`ROUNDS`; it may raise.
    """
    frames = len(evidence.times_s)
    sd = np.full((max(frames - 2, 0), rig.freedoms), _FIRST_ROTATION_RADPS2)
    sd[:, -3:] = _FIRST_TRANSLATION_MPS2
    pose = start
    with one_thread():
        for number in range(ROUNDS):
            objective = Objective(rig, evidence, sd)
            pose = _descend(objective, pose, robust=number > 0, tick=partial(tick, number))
            if number < ROUNDS - 1:
                sd = _liveliness(objective.accelerations(pose), evidence.times_s)
    return pose


def solve_stills(rig: Rig, evidence: Evidence, start: Pose) -> Pose:
    """Pose of each frame for itself, independent of the frames around it."""
    apart = replace(evidence, velocity_sd_mps=np.full_like(evidence.velocity_sd_mps, np.inf))
    sd = np.full((max(len(evidence.times_s) - 2, 0), rig.freedoms), np.inf)
    objective = Objective(rig, apart, sd)
    with one_thread():
        pose = _descend(objective, start, robust=False, tick=lambda: None)
        return _descend(objective, pose, robust=True, tick=lambda: None)


def _descend(objective: Objective, pose: Pose, *, robust: bool, tick: Callable[[], None]) -> Pose:
    """Levenberg–Marquardt until the cost hardly falls."""
    damping = 1e-4
    residuals = objective.residuals(pose)
    plain = Residuals(*[np.ones(1)] * len(residuals))
    for _ in range(_STEPS):
        tick()
        trust = objective.trust(residuals) if robust else plain
        now, normal = objective.normal(pose, trust)
        for _ in range(6):
            tried = objective.moved(pose, normal.step(damping))
            found = objective.residuals(tried)
            then = cost(weighted(found, trust))
            if then <= now:
                break
            damping = max(damping, 1e-4) * 10.0
        else:
            return pose
        pose, residuals = tried, found
        damping = max(damping / 10.0, 1e-6)
        if now - then < _CONVERGED * now:
            break
    return pose


def _liveliness(accelerations: Floats, times_s: Floats) -> Floats:
    """Root mean square acceleration around each moment, not below what is left at rest."""
    from scipy.ndimage import correlate1d

    if not len(accelerations):
        return accelerations
    reach = max(round(_AROUND_S / float(np.median(np.diff(times_s)))), 1)
    kernel = np.hanning(2 * reach + 3)[1:-1]
    share = correlate1d(np.ones(len(accelerations)), kernel, mode="constant")[:, None]
    mean = correlate1d(accelerations**2, kernel, axis=0, mode="constant") / share
    least = np.full(accelerations.shape[1], _LEAST_ROTATION_RADPS2)
    least[-3:] = _LEAST_TRANSLATION_MPS2
    return np.asarray(np.sqrt(_LIVELINESS**2 * mean + least**2))
