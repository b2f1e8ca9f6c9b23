"""A body in the poses of a skeleton: what is known comes back."""

from __future__ import annotations

import numpy as np
import pytest
from mars_files import SPACE, approaching, joints_of

from sd2core.body.initial import Pose
from sd2core.body.rig import JOINTS as TURNS
from sd2core.body.rig import KeypointSpace
from sd2core.body.rotations import about
from sd2core.body.track import LANDMARKS
from sd2core.errors import Sd2Error
from sd2core.io.radar.mars import JOINTS
from sd2core.mocap.driving import KINECT_MARKERS, DrivenClip, SkeletonClip, puppet_of, resample_pose
from tools.build_sample.swipes import posed, swipes

FRAMES = 40
SHAPE = SPACE.random(np.random.default_rng(3))


def _swiping() -> tuple[np.ndarray, np.ndarray]:
    """Landmarks (T, 33, 3) and vertices (T, V, 3) of somebody who swipes, 10 frames/s."""
    motion = swipes(SPACE.base_skeleton, 1.0 + np.arange(FRAMES) / 10.0)
    place_m = motion.translation_m + np.array([0.1, 0.9, 2.0])
    transforms = SPACE.skeleton(SHAPE).transforms(motion.rotations, place_m)
    vertices = posed(SPACE.load("low", SHAPE), motion.rotations, place_m)
    return KeypointSpace(SPACE).of(SHAPE).positions(transforms), vertices


@pytest.fixture(scope="module")
def swiping() -> tuple[DrivenClip, np.ndarray, np.ndarray]:
    landmarks, vertices = _swiping()
    clip = SkeletonClip(np.arange(FRAMES) / 10.0, joints_of(landmarks))
    return puppet_of([clip], KINECT_MARKERS).pose(clip), landmarks, vertices


def test_the_stature_is_found(swiping: tuple[DrivenClip, np.ndarray, np.ndarray]) -> None:
    assert swiping[0].puppet.shape.stature_m == pytest.approx(SHAPE.stature_m, abs=0.04)


def test_joints_are_met(swiping: tuple[DrivenClip, np.ndarray, np.ndarray]) -> None:
    driven, _, _ = swiping
    rows = [row for row in range(33) if np.isfinite(driven.residual_m[:, row]).any()]
    assert len(rows) == len(KINECT_MARKERS)
    assert np.nanmean(driven.residual_m) < 0.015
    # The Kinect has one joint for both ears, in their middle.
    ears = [LANDMARKS.index("ear.L"), LANDMARKS.index("ear.R")]
    assert driven.residual_m[:, ears].max() < 0.01


def test_arms_move_as_they_did(swiping: tuple[DrivenClip, np.ndarray, np.ndarray]) -> None:
    driven, landmarks, _ = swiping
    for landmark in (14, 16):  # right elbow and wrist
        truth = np.gradient(landmarks[:, landmark], axis=0) * 10.0
        found = np.gradient(driven.landmarks_m[:, landmark], axis=0) * 10.0
        speed = np.sqrt((truth**2).sum(axis=-1).mean())
        assert speed > 0.2
        assert np.sqrt(((found - truth) ** 2).sum(axis=-1).mean()) < 0.2 * speed


def test_the_surface_lies_on_the_person(
    swiping: tuple[DrivenClip, np.ndarray, np.ndarray],
) -> None:
    driven, _, truth = swiping
    mesh = driven.mesh(driven.clip.times_s, "low")
    apart = np.linalg.norm(mesh.read(0, FRAMES) - truth, axis=-1)
    assert np.median(apart) < 0.03
    assert np.percentile(apart, 95) < 0.08


@pytest.mark.slow
def test_joints_that_lie_beside_ours_are_placed_on_the_body() -> None:
    joints = joints_of(_swiping()[0])
    # Hips that are nearer to each other than ours.
    hips = [JOINTS.index("HipLeft"), JOINTS.index("HipRight")]
    joints[:, hips] += 0.4 * (joints[:, hips].mean(axis=1, keepdims=True) - joints[:, hips])
    clip = SkeletonClip(np.arange(FRAMES) / 10.0, joints)
    driven = puppet_of([clip], KINECT_MARKERS).pose(clip)
    assert np.nanmean(driven.residual_m[:, [23, 24]]) < 0.015


@pytest.mark.slow
def test_bridged_frames_are_not_evidence() -> None:
    joints = approaching(30, 0.5)
    frames = np.delete(np.arange(30), [12, 13])
    clip = SkeletonClip.on_grid(frames, joints[frames], 10.0)
    assert clip.known is not None
    assert np.flatnonzero(~clip.known).tolist() == [12, 13]
    clip.joints_m[12:14, :, 2] += 0.3  # whatever stands there
    driven = puppet_of([clip], KINECT_MARKERS).pose(clip)
    assert np.isnan(driven.residual_m[12:14]).all()
    trunk = driven.landmarks_m[:, [11, 12, 23, 24], 2].mean(axis=1)
    np.testing.assert_allclose(np.diff(trunk), -0.05, atol=0.005)


def test_resampling_keeps_a_steady_turn_steady() -> None:
    times_s = np.arange(12) / 10.0
    axis = np.array([0.0, 0.6, 0.8])
    turns = np.tile(about(axis, 90.0 * times_s)[:, None], (1, len(TURNS), 1, 1))
    place = np.stack([0.0 * times_s, times_s, 2.0 - 0.5 * times_s], axis=1)
    wanted_s = np.linspace(0.0, 1.1, 78)
    found = resample_pose(Pose(turns, place), times_s, wanted_s)
    np.testing.assert_allclose(found.turns[:, 5], about(axis, 90.0 * wanted_s), atol=1e-6)
    np.testing.assert_allclose(found.translation_m[:, 2], 2.0 - 0.5 * wanted_s, atol=1e-9)
    held = resample_pose(Pose(turns, place), times_s, np.array([-1.0, 5.0]))
    np.testing.assert_allclose(held.translation_m, place[[0, -1]], atol=1e-9)


def test_a_small_skeleton_gives_a_small_body() -> None:
    small = approaching(5, 0.0) * (1.2 / 1.75) + np.array([0.0, 0.0, 1.0])
    clip = SkeletonClip(np.arange(5) / 10.0, small)
    assert puppet_of([clip], KINECT_MARKERS).shape.stature_m == pytest.approx(1.2, abs=0.05)


def test_a_skeleton_of_another_scale_is_refused() -> None:
    clip = SkeletonClip(np.arange(3) / 10.0, 4.0 * approaching(3, 0.0))
    with pytest.raises(Sd2Error, match=r"a person of [67]"):
        puppet_of([clip], KINECT_MARKERS)


def test_a_skeleton_behind_the_sensor_is_refused() -> None:
    with pytest.raises(Sd2Error, match="behind the sensor"):
        SkeletonClip(np.arange(3) / 10.0, -approaching(3, 0.0))
