from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from known_clip import TIMES, waving, write_clip

from sd2core.body.camera import PinholeCamera
from sd2core.body.shaping import silhouette
from sd2core.body.track import LANDMARKS, LandmarkTrack
from sd2core.compare.joints import JOINTS, own_patches
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.timebase import Timebase
from tools.fitting.clip_score import reprojection_m, score_clip, score_real
from tools.fitting.truth import read_truth

CAMERA = PinholeCamera()


@pytest.fixture(scope="module")
def mesh() -> MeshSequence:
    return waving()


@pytest.fixture
def track(mesh: MeshSequence) -> LandmarkTrack:
    """What a landmark model without faults would say of this mesh."""
    frames, count = np.arange(0, len(TIMES), 6), len(TIMES)
    image = np.full((count, 33, 2), 320.0, np.float32)
    joints = own_patches("low").positions(mesh.read(0, mesh.frame_count))
    for number, name in enumerate(LANDMARKS):
        if name in JOINTS:
            image[:, number] = CAMERA.project(joints[:, JOINTS.index(name)])
    masks = [silhouette(mesh.frame(frame), mesh.faces, CAMERA, (160, 120)) for frame in frames]
    return LandmarkTrack(
        timebase=Timebase(TIMES),
        width=640,
        height=480,
        image_px=image,
        depth_px=np.zeros((count, 33), np.float32),
        world_m=np.zeros((count, 33, 3), np.float32),
        visibility=np.ones((count, 33), np.float32),
        confidence=np.ones(count, np.float32),
        present=np.ones(count, bool),
        bridged=np.zeros(count, bool),
        silhouette_frames=frames,
        silhouettes=(255 * np.array(masks)).astype(np.uint8),
    )


def test_a_mesh_on_the_person_is_perfect(mesh: MeshSequence, track: LandmarkTrack) -> None:
    score = score_real("wave", mesh, track, CAMERA)
    assert score.overlap == 1.0
    assert score.reprojection_m < 1e-6
    assert len(reprojection_m(mesh, track, CAMERA)) == 12 * len(TIMES)


def test_a_shift_in_the_picture_is_measured(mesh: MeshSequence, track: LandmarkTrack) -> None:
    shifted = replace(track, image_px=track.image_px + np.array([3.0, 4.0], np.float32))
    score = score_real("wave", mesh, shifted, CAMERA)
    # 600 px are one metre at one metre; the joints are some 2.5 m off.
    assert score.reprojection_m == pytest.approx(5.0 * 2.5 / 600, rel=0.05)


def test_hidden_landmarks_and_those_outside_are_left_out(
    mesh: MeshSequence, track: LandmarkTrack
) -> None:
    visibility = track.visibility.copy()
    visibility[:, LANDMARKS.index("elbow.L")] = 0.1
    image = track.image_px.copy()
    image[:, LANDMARKS.index("elbow.R"), 1] = 700.0
    partly = replace(track, visibility=visibility, image_px=image)
    away_m = reprojection_m(mesh, partly, CAMERA)
    assert len(away_m) == 10 * len(TIMES)
    assert away_m.max() < 1e-6


def test_the_residual_of_a_known_clip(
    mesh: MeshSequence, track: LandmarkTrack, tmp_path: Path
) -> None:
    truth = read_truth(write_clip(tmp_path / "wave", mesh))
    shifted = replace(track, image_px=track.image_px + np.array([3.0, 4.0], np.float32))
    score = score_clip(truth, mesh, track=shifted)
    assert score.residual_m == score_real("wave", mesh, shifted, CAMERA).reprojection_m


def test_a_mask_that_is_half_covered(mesh: MeshSequence, track: LandmarkTrack) -> None:
    masks = track.silhouettes.copy()
    middle = np.flatnonzero(masks[0].any(axis=1)).mean().astype(int)
    masks[:, middle:] = 0
    score = score_real("wave", mesh, replace(track, silhouettes=masks), CAMERA)
    share = masks[0].astype(bool).sum() / track.silhouettes[0].astype(bool).sum()
    assert score.overlap == pytest.approx(share, abs=0.03)


def test_frames_without_a_person_are_not_compared(mesh: MeshSequence, track: LandmarkTrack) -> None:
    present = track.present.copy()
    present[:6] = False
    masks = track.silhouettes.copy()
    masks[0] = 0
    score = score_real("wave", mesh, replace(track, present=present, silhouettes=masks), CAMERA)
    assert score.overlap == 1.0


def test_the_mesh_of_another_video_is_refused(mesh: MeshSequence, track: LandmarkTrack) -> None:
    shorter = MeshSequence(mesh.read(0, 9), mesh.faces, Timebase(TIMES[:9]))
    with pytest.raises(Sd2Error, match="9 frames"):
        score_real("wave", shorter, track, CAMERA)
