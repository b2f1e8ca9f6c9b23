from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sd2core.body.evidence import Evidence, resolve_arm_depths
from sd2core.body.rig import KeypointSpace, Rig
from sd2core.body.shape import ShapeSpace
from sd2core.body.track import LANDMARKS, TORSO_CORNERS
from tools.build_sample.swipes import swipes

SPACE = ShapeSpace()
ARM = [LANDMARKS.index(name) for name in ("elbow.R", "wrist.R")]
OTHERS = [k for k, name in enumerate(LANDMARKS) if name[:-2] in ("hip", "knee", "shoulder", "ear")]


def swiping() -> tuple[Rig, np.ndarray, Evidence]:
    """A person who swipes; truth and evidence whose depths are drawn towards the trunk."""
    shape = SPACE.random(np.random.default_rng(3))
    rig = Rig(SPACE.skeleton(shape), KeypointSpace(SPACE).of(shape))
    times_s = 1.2 + np.arange(90) / 30.0
    motion = swipes(SPACE.base_skeleton, times_s)
    place = motion.translation_m + np.array([0.0, 1.1, 2.3])
    transforms = SPACE.skeleton(shape).transforms(motion.rotations, place)
    truth = KeypointSpace(SPACE).of(shape).positions(transforms)
    trunk = truth[:, TORSO_CORNERS, 2].mean(axis=1)
    sd = np.full(truth.shape[:2], 0.15)
    evidence = Evidence(
        times_s=times_s,
        slopes=truth[..., :2] / truth[..., 2:],
        slopes_sd=np.full(truth.shape[:2], 0.005),
        trunk=TORSO_CORNERS,
        depth_m=0.5 * (truth[..., 2] - trunk[:, None]),
        depth_sd_m=sd,
        trunk_m=trunk,
        trunk_sd_m=sd[:, 0],
        velocity_mps=np.zeros(sd.shape),
        velocity_sd_mps=sd,
    )
    return rig, truth, evidence


def test_lengths_give_back_the_depths_that_were_drawn_in() -> None:
    rig, truth, evidence = swiping()
    found = resolve_arm_depths(evidence, rig).points_m
    before = np.abs(evidence.points_m - truth)[:, ARM, 2].mean()
    after = np.abs(found - truth)[:, ARM, 2].mean()
    assert after < 0.3 * before
    assert after < 0.04


def test_only_arms_are_changed() -> None:
    rig, _, evidence = swiping()
    found = resolve_arm_depths(evidence, rig)
    np.testing.assert_array_equal(found.depth_m[:, OTHERS], evidence.depth_m[:, OTHERS])
    np.testing.assert_array_equal(found.depth_sd_m[:, OTHERS], evidence.depth_sd_m[:, OTHERS])
    np.testing.assert_array_equal(found.velocity_mps, evidence.velocity_mps)


def test_an_arm_has_its_lengths_where_the_picture_allows() -> None:
    rig, _, evidence = swiping()
    points = resolve_arm_depths(evidence, rig).points_m
    rest = rig.keypoints.rest_m
    shoulder = LANDMARKS.index("shoulder.R")
    for start, end in ((shoulder, ARM[0]), (ARM[0], ARM[1])):
        length = np.linalg.norm(rest[end] - rest[start])
        found = np.linalg.norm(points[:, end] - points[:, start], axis=1)
        # Never shorter than it is; longer only where no point of the ray is near enough.
        assert (found >= length - 1e-9).all()
        assert np.median(found) == pytest.approx(length, abs=1e-6)


def test_a_few_frames_of_the_wrong_sign_do_not_turn_an_arm_round() -> None:
    rig, truth, evidence = swiping()
    depth_m = evidence.depth_m.copy()
    wrong = slice(40, 44)
    depth_m[wrong, ARM[0]] *= -1.0
    depth_m[wrong, ARM[1]] *= -1.0
    found = resolve_arm_depths(replace(evidence, depth_m=depth_m), rig).points_m
    kept = resolve_arm_depths(evidence, rig).points_m
    away = np.abs(found - kept)[:, ARM, 2]
    assert np.median(away[wrong]) < 0.02
    assert np.abs(truth - found)[wrong][:, ARM, 2].mean() < 0.08
