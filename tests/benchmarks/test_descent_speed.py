"""Gauss–Newton against L-BFGS and Adam on one and the same objective of a fit.

All three take their gradients from the normal equations, whose matrices the latter two do
not need: steps are what to compare first, seconds are a little unkind to them.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from itertools import islice
from typing import Any, NamedTuple

import numpy as np
import pytest

from sd2core.body.evidence import Evidence
from sd2core.body.initial import Pose, initial_pose
from sd2core.body.rig import KeypointSpace, Rig
from sd2core.body.shape import ShapeSpace
from sd2core.body.solve import Objective, Residuals, cost
from sd2core.body.track import TORSO_CORNERS
from tools.build_sample.swipes import swipes

FRAMES = 150
PATIENCE_S = 60.0
Method = Callable[[Objective, Pose], Iterator[float]]
PLAIN = Residuals(*[np.ones(1)] * len(Residuals._fields))


@pytest.fixture(scope="module")
def problem() -> tuple[Objective, Pose]:
    """Five seconds of a person who swipes, seen and lifted about as well as in videos."""
    rng = np.random.default_rng(7)
    space = ShapeSpace()
    shape = space.random(rng)
    times_s = 1.2 + np.arange(FRAMES) / 30.0
    motion = swipes(space.base_skeleton, times_s)
    rig = Rig(space.skeleton(shape), KeypointSpace(space).of(shape))
    transforms = space.skeleton(shape).transforms(
        motion.rotations, motion.translation_m + np.array([0.05, 1.1, 2.4])
    )
    points_m = rig.marks.positions(transforms)[:, :33]
    depth_m = points_m[..., 2]
    centre_m = depth_m[:, TORSO_CORNERS].mean(axis=1)
    full = np.ones(depth_m.shape)
    evidence = Evidence(
        times_s=times_s,
        slopes=points_m[..., :2] / depth_m[..., None] + 0.005 * rng.normal(size=(FRAMES, 33, 2)),
        slopes_sd=0.005 * full,
        size_sd=0.0,
        trunk=tuple(TORSO_CORNERS),
        depth_m=depth_m - centre_m[:, None] + 0.05 * rng.normal(size=full.shape),
        depth_sd_m=0.1 * full,
        trunk_m=centre_m,
        trunk_sd_m=0.05 * full[:, 0],
        velocity_mps=np.gradient(depth_m - centre_m[:, None], times_s, axis=0)
        + 0.2 * rng.normal(size=full.shape),
        velocity_sd_mps=0.8 * full,
        standing_sd_mps=np.ones((FRAMES, 4)),
    )
    acceleration_sd = np.full((FRAMES - 2, rig.freedoms), 60.0)
    acceleration_sd[:, -3:] = 6.0
    start = initial_pose(rig, evidence.points_m, full)
    return Objective(rig, evidence, acceleration_sd), start


def gauss_newton(objective: Objective, pose: Pose) -> Iterator[float]:
    """Levenberg–Marquardt, as ``body/solve.py`` takes its steps."""
    damping = 1e-4
    while True:
        now, normal = objective.normal(pose, PLAIN)
        yield now
        while True:
            tried = objective.moved(pose, normal.step(damping))
            if cost(objective.residuals(tried)) <= now or damping > 1e6:
                break
            damping *= 10.0
        pose, damping = tried, max(damping / 10.0, 1e-6)


def l_bfgs(objective: Objective, pose: Pose) -> Iterator[float]:
    """Two-loop recursion in the joints' own coordinates, backtracking; 20 pairs kept.

    Every degree of freedom is measured in what one of its kind may do, without which it
    hardly gets anywhere.
    """
    pairs: deque[tuple[np.ndarray, np.ndarray]] = deque(maxlen=20)
    now, normal = objective.normal(pose, PLAIN)
    scale = 1.0 / np.sqrt(np.einsum("tii->ti", normal.blocks[0]))
    gradient = normal.gradient * scale
    while True:
        yield now
        direction, shares = gradient.copy(), []
        for step, change in reversed(pairs):
            share = (step * direction).sum() / (step * change).sum()
            shares.append(share)
            direction -= share * change
        if pairs:
            step, change = pairs[-1]
            direction *= (step * change).sum() / (change**2).sum()
        for (step, change), share in zip(pairs, reversed(shares), strict=True):
            direction += (share - (change * direction).sum() / (step * change).sum()) * step
        length, slope = 1.0, (gradient * direction).sum()
        while True:
            tried = objective.moved(pose, -length * direction * scale)
            if cost(objective.residuals(tried)) <= now - 1e-4 * length * slope or length < 1e-9:
                break
            length *= 0.5
        pose = tried
        now, normal = objective.normal(pose, PLAIN)
        then, gradient = gradient, normal.gradient * scale
        step, change = -length * direction, gradient - then
        if (step * change).sum() > 0.0:
            pairs.append((step, change))


def adam(objective: Objective, pose: Pose) -> Iterator[float]:
    """With its usual constants and 0.01 rad (or m) a step, the best of three that were tried."""
    mean = square = np.zeros(1)
    count = 0
    while True:
        now, normal = objective.normal(pose, PLAIN)
        yield now
        count += 1
        mean = 0.9 * mean + 0.1 * normal.gradient
        square = 0.999 * square + 0.001 * normal.gradient**2
        ahead = (mean / (1 - 0.9**count)) / (np.sqrt(square / (1 - 0.999**count)) + 1e-12)
        pose = objective.moved(pose, -0.01 * ahead)


class Descent(NamedTuple):
    value: float
    steps: int
    seconds: float


def descent(method: Method, objective: Objective, start: Pose, enough: float) -> Descent:
    begin = time.perf_counter()
    for steps, value in enumerate(method(objective, start)):
        spent_s = time.perf_counter() - begin
        if value <= enough or spent_s > PATIENCE_S:
            return Descent(value, steps, spent_s)
    raise AssertionError("a descent does not end by itself")


def test_gauss_newton_is_first_at_the_bottom(
    benchmark: Any, problem: tuple[Objective, Pose], capsys: pytest.CaptureFixture[str]
) -> None:
    objective, start = problem
    least = min(islice(gauss_newton(objective, start), 30))
    found = benchmark.pedantic(
        lambda: {
            method: descent(method, objective, start, 1.01 * least)
            for method in (gauss_newton, l_bfgs, adam)
        },
        rounds=1,
    )
    seconds = {method: one.seconds for method, one in found.items()}
    lines = [
        f"{method.__name__}: {one.value / least:.3f} x the least cost after {one.steps} steps,"
        f" {one.seconds:.2f} s"
        for method, one in found.items()
    ]
    with capsys.disabled():
        print("\n" + "\n".join(lines))
    assert min(seconds[l_bfgs], seconds[adam]) > 4 * seconds[gauss_newton]
