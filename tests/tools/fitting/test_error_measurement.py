"""Errors of fits: measuring finds what was drawn, and drawn ones are like measured ones."""

from __future__ import annotations

import numpy as np
import pytest

from sd2core.body.rotations import Floats
from sd2core.body.shape import ShapeSpace
from sd2core.simulate.campaign.fit_errors import FitErrors, GroupErrors
from sd2core.simulate.people.signals import wander
from tools.fitting.clips import clip_named, scene
from tools.fitting.error_measurement import Sample, group_errors

SPREAD = np.array([[0.04, 0.01], [0.01, 0.09]])
KNOWN = GroupErrors(
    gain=np.array([[0.1, 0.5, 0.0], [0.0, 0.0, -0.3]]),
    bias=np.diag([0.01, 0.0]),
    spread=SPREAD,
    length=0.4,
    mixing=1.0,
)


@pytest.fixture(scope="module")
def bundled() -> FitErrors:
    return FitErrors.load()


def paths(count: int, speed_hz: float) -> list[Floats]:
    times_s = np.arange(150) / 30.0
    rng = np.random.default_rng(3)
    return [0.5 * wander(rng, times_s, speed_hz, 2) for _ in range(count)]


def test_measuring_finds_what_was_drawn() -> None:
    rng = np.random.default_rng(4)
    samples = [Sample(path, KNOWN.draw(rng)(path)) for path in paths(60, 0.8)]
    found = group_errors(samples)
    np.testing.assert_allclose(found.gain[:, 1:], KNOWN.gain[:, 1:], atol=0.12)
    # What matters is how fast errors change: the variogram over two frames.
    seen = np.mean([(one.errors[2:] - one.errors[:-2]) ** 2 for one in samples], axis=(0, 1))
    drawn = [found.draw(rng)(path) for path in paths(60, 0.8)]
    again = np.mean([(one[2:] - one[:-2]) ** 2 for one in drawn], axis=(0, 1))
    np.testing.assert_allclose(np.sqrt(again), np.sqrt(seen), rtol=0.3)
    total = np.trace(found.spread + found.bias)
    assert total == pytest.approx(np.trace(KNOWN.spread + KNOWN.bias), rel=0.5)


def test_errors_that_follow_the_pose_alone_are_all_gain() -> None:
    samples = [Sample(path, path @ [[-0.2, 0.0], [0.1, 0.4]]) for path in paths(5, 0.8)]
    found = group_errors([Sample(x, e + 1e-6 * x**2) for x, e in samples])
    np.testing.assert_allclose(found.gain[:, 1:], [[-0.2, 0.1], [0.0, 0.4]], atol=0.02)
    assert np.trace(found.spread + found.bias) < 1e-3


def test_who_stands_still_has_no_false_velocity(bundled: FitErrors) -> None:
    known = scene(clip_named("still-hand-up"), ShapeSpace())
    drawn = bundled.draw(np.random.default_rng(5))
    held = drawn.transforms(known.skeleton, known.transforms, known.skeleton)
    np.testing.assert_allclose(held, np.broadcast_to(held[:1], held.shape), atol=1e-12)
    assert np.abs(held - known.transforms).max() > 0.01


def test_hands_err_as_much_as_fits_do(bundled: FitErrors) -> None:
    """Velocities of the hand along the optical axis, over draws: docs/fitting.md has 0.95."""
    known = scene(clip_named("all-normal"), ShapeSpace())
    bone = known.skeleton.index["finger3-1.R"]
    head = known.skeleton.heads_m[bone]

    def velocity(transforms: Floats) -> Floats:
        place = transforms[:, bone, :, :3] @ head + transforms[:, bone, :, 3]
        return np.gradient(place[:, 2], known.times_s)

    true = velocity(known.transforms)
    moving = np.abs(true) > 0.1
    found = []
    for seed in range(8):
        drawn = bundled.draw(np.random.default_rng(seed))
        held = drawn.transforms(known.skeleton, known.transforms, known.skeleton)
        found.append(velocity(held)[moving])
    true = true[moving]
    error = np.sqrt(np.mean((np.array(found) - true) ** 2)) / np.sqrt(np.mean(true**2))
    assert 0.2 < error < 0.6
    assert 0.85 < np.corrcoef(np.array(found).ravel(), np.tile(true, 8))[0, 1] < 0.98
