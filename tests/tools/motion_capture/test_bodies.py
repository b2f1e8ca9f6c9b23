from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sd2core.body.rig import JOINTS, KeypointSpace, Rig
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.body.track import LANDMARK
from sd2core.mocap.body_motion import BodyMotion, load_motions
from tools.motion_capture.catalogue import drive_bodies, trials

SPACE = ShapeSpace()
KEYPOINTS = KeypointSpace(SPACE)


def rig_of(shape: BodyShape) -> Rig:
    return Rig(SPACE.skeleton(shape), KEYPOINTS.of(shape))


def motion(stature_m: float = 1.7, **more: str) -> BodyMotion:
    """A body that is shifted by a metre while its joints turn a little."""
    rng = np.random.default_rng(1)
    told = {"trial": "t", "person": "p", "role": "learn"} | more
    way_m = np.linspace(0.0, 1.0, 12)[:, None] * [1.0, 0.0, 0.0]
    return BodyMotion(
        shape=BodyShape(np.zeros(len(SPACE)), stature_m),
        vectors=0.2 * rng.standard_normal((12, len(JOINTS), 3)),
        translation_m=way_m,
        residual_m=0.01,
        **told,  # type: ignore[arg-type]
    )


def test_a_motion_comes_back_from_its_file(tmp_path: Path) -> None:
    written = motion()
    written.save(tmp_path / "t.npz")
    motion(role="measure").save(tmp_path / "u.npz")
    (read,) = load_motions(tmp_path, "learn")
    assert (read.trial, read.person, read.role) == ("t", "p", "learn")
    np.testing.assert_allclose(read.vectors, written.vectors, atol=1e-6)
    np.testing.assert_allclose(read.translation_m, written.translation_m, atol=1e-6)
    assert read.shape.stature_m == written.shape.stature_m


@pytest.mark.parametrize("stature_m", [1.5, 1.7, 1.95])
def test_another_body_makes_the_same_turns_with_steps_as_long_as_its_legs(stature_m: float) -> None:
    own = motion()
    rigs = [rig_of(BodyShape(own.shape.coefficients, s)) for s in (1.7, stature_m)]
    skeletons = [SPACE.skeleton(BodyShape(own.shape.coefficients, s)) for s in (1.7, stature_m)]
    poses = [own.pose_on(skeleton, skeletons[0], slice(2, 9)) for skeleton in skeletons]
    np.testing.assert_array_equal(poses[0].turns, poses[1].turns)
    np.testing.assert_allclose(poses[0].translation_m, own.translation_m[2:9])
    points_m = [
        rig.keypoints.positions(rig.transforms(*pose))
        for rig, pose in zip(rigs, poses, strict=True)
    ]
    # Bodies of the same proportions: everything is larger by the same factor, the floor included.
    np.testing.assert_allclose(points_m[1], stature_m / 1.7 * points_m[0], atol=1e-9)


@pytest.mark.slow
def test_a_real_walk_keeps_its_places(shared_data: Path, tmp_path: Path) -> None:
    (trial,) = (one for one in trials(shared_data / "motion") if one.name == "26_01")
    source = tmp_path / "source" / "cmu_bvh"
    source.mkdir(parents=True)
    (source / trial.path.name).symlink_to(trial.path)
    assert drive_bodies(tmp_path / "source", tmp_path / "out", 1) == []
    (walk,) = load_motions(tmp_path / "out", "learn")
    assert walk.residual_m < 0.02
    rig = rig_of(walk.shape)
    own = SPACE.skeleton(walk.shape)
    pose = walk.pose_on(own, own, slice(None))
    found_m = rig.keypoints.positions(rig.transforms(*pose))
    feet_m = found_m[:, [LANDMARK["heel.L"], LANDMARK["foot_index.L"]], 1]
    # y is down: the foot stands on the floor most of the time and never far below it.
    assert abs(np.percentile(feet_m, 90)) < 0.06
    assert drive_bodies(tmp_path / "source", tmp_path / "out", 1) == []
