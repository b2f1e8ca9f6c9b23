"""Errors of fits: what is drawn has the stated statistics, and measuring finds them again."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sd2core.body.rotations import Floats
from sd2core.body.shape import ShapeSpace
from sd2core.errors import Sd2Error
from sd2core.simulate.campaign.fit_errors import FitErrors, GroupErrors
from sd2core.simulate.campaign.measuring import Sample, group_errors
from sd2core.simulate.fit_truth import clip_named, scene
from sd2core.simulate.people.signals import wander

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


def test_errors_have_the_stated_covariance() -> None:
    """Over many clips, at two poses a known distance apart."""
    apart = 0.5
    poses = np.array([[0.2, -0.1], [0.2 + apart, -0.1]])
    rng = np.random.default_rng(0)
    drawn = np.array([KNOWN.drawn(rng)(poses) for _ in range(4000)])  # (clips, poses, errors)
    np.testing.assert_allclose(drawn.mean(axis=0), [[0.2, 0.03], [0.45, 0.03]], atol=0.02)
    centred = drawn - drawn.mean(axis=0)
    same = np.einsum("ci,cj->ij", centred[:, 0], centred[:, 0]) / len(drawn)
    other = np.einsum("ci,cj->ij", centred[:, 0], centred[:, 1]) / len(drawn)
    kernel = 1.0 / (1.0 + apart**2 / (2.0 * 0.4**2))
    np.testing.assert_allclose(same, SPREAD + KNOWN.bias, rtol=0.08, atol=0.003)
    np.testing.assert_allclose(other, kernel * SPREAD + KNOWN.bias, rtol=0.12, atol=0.003)


def paths(count: int, speed_hz: float) -> list[Floats]:
    times_s = np.arange(150) / 30.0
    rng = np.random.default_rng(3)
    return [0.5 * wander(rng, times_s, speed_hz, 2) for _ in range(count)]


def test_measuring_finds_what_was_drawn() -> None:
    rng = np.random.default_rng(4)
    samples = [Sample(path, KNOWN.drawn(rng)(path)) for path in paths(60, 0.8)]
    found = group_errors(samples)
    np.testing.assert_allclose(found.gain[:, 1:], KNOWN.gain[:, 1:], atol=0.12)
    # What matters is how fast errors change: the variogram over two frames.
    seen = np.mean([(one.errors[2:] - one.errors[:-2]) ** 2 for one in samples], axis=(0, 1))
    drawn = [found.drawn(rng)(path) for path in paths(60, 0.8)]
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
    drawn = bundled.drawn(np.random.default_rng(5))
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
        drawn = bundled.drawn(np.random.default_rng(seed))
        held = drawn.transforms(known.skeleton, known.transforms, known.skeleton)
        found.append(velocity(held)[moving])
    true = true[moving]
    error = np.sqrt(np.mean((np.array(found) - true) ** 2)) / np.sqrt(np.mean(true**2))
    assert 0.2 < error < 0.6
    assert 0.85 < np.corrcoef(np.array(found).ravel(), np.tile(true, 8))[0, 1] < 0.98


def test_errors_come_back_from_disk(bundled: FitErrors, tmp_path: Path) -> None:
    bundled.save(tmp_path / "errors.json")
    again = FitErrors.load(tmp_path / "errors.json")
    for group, one in bundled.groups.items():
        np.testing.assert_array_equal(again.groups[group].gain, one.gain)
    assert again.as_dict() == bundled.as_dict()


def test_a_damaged_file_is_refused(bundled: FitErrors, tmp_path: Path) -> None:
    path = tmp_path / "errors.json"
    replace(bundled, groups={"arm": bundled.groups["arm"]}).save(path)
    with pytest.raises(Sd2Error, match="leg, place, trunk"):
        FitErrors.load(path)
    said = json.loads(path.read_text())
    path.write_text(json.dumps(said | {"version": 99}))
    with pytest.raises(Sd2Error, match="version 99"):
        FitErrors.load(path)
    with pytest.raises(Sd2Error, match="cannot be read"):
        FitErrors.load(tmp_path / "nothing.json")
