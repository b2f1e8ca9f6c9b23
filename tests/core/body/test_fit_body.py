from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from whole_fits import fit_body, mesh_of

from sd2core.body import fit as fitting
from sd2core.body import fit_windows
from sd2core.body.camera import PinholeCamera
from sd2core.body.fitted import BodyFit
from sd2core.body.lifter import FEET, LiftedTrack
from sd2core.body.rig import KeypointSpace
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.body.shaping import overlap, silhouette
from sd2core.body.skinning import pose_vertices
from sd2core.body.track import LANDMARKS, TORSO_CORNERS, LandmarkTrack
from sd2core.errors import Sd2Error
from sd2core.progress import Cancelled
from sd2core.timebase import Timebase
from tools.build_sample.swipes import swipes

SPACE = ShapeSpace()
CAMERA = PinholeCamera()
OUTLINE = (160, 120)


def known(keypoints_m: np.ndarray, times_s: np.ndarray, stature_m: float) -> LiftedTrack:
    """What a lifter gives that knows the truth, but for slow errors and noise."""
    rng = np.random.default_rng(4)
    depth = keypoints_m[..., 2]
    centre = depth[:, TORSO_CORNERS].mean(axis=1)
    velocity = np.gradient(depth, times_s, axis=0) if len(times_s) > 1 else 0.0 * depth
    return LiftedTrack(
        centre_depth=(centre + 0.02) / stature_m,
        centre_sigma=np.full(len(depth), 0.03) / stature_m,
        depth=(depth - centre[:, None] + 0.02 * rng.standard_normal(33)) / stature_m,
        depth_sigma=np.full(depth.shape, 0.03) / stature_m,
        velocity=(velocity + 0.1 * rng.standard_normal(depth.shape)) / stature_m,
        velocity_sigma=np.full(depth.shape, 0.1) / stature_m,
        across=np.zeros((*depth.shape, 2)),
        across_sigma=np.full(depth.shape, 0.02) / centre[:, None],
        standing=np.zeros((len(depth), len(FEET))),
    )


class Scene:
    """A person of random shape who swipes, and the landmarks of a perfect model."""

    def __init__(
        self,
        frames: int,
        start_s: float = 1.2,
        frames_per_s: float = 30.0,
        distance_m: float = 2.4,
    ) -> None:
        self.shape = SPACE.random(np.random.default_rng(7))
        times_s = start_s + np.arange(frames) / frames_per_s
        motion = swipes(SPACE.base_skeleton, times_s)
        place = np.array([0.05, 1.1, distance_m])
        transforms = SPACE.skeleton(self.shape).transforms(
            motion.rotations, motion.translation_m + place
        )
        self.keypoints_m = KeypointSpace(SPACE).of(self.shape).positions(transforms)
        body = SPACE.load("low", self.shape)
        self.vertices_m = pose_vertices(body, transforms)
        self.faces = body.faces
        noise = np.random.default_rng(1).standard_normal((frames, 33, 2))
        outlined = np.unique(np.linspace(0, frames - 1, 4).astype(int))
        self.track = LandmarkTrack(
            timebase=Timebase(times_s),
            width=CAMERA.width,
            height=CAMERA.height,
            image_px=(CAMERA.project(self.keypoints_m) + noise).astype(np.float32),
            depth_px=np.zeros((frames, 33), np.float32),
            world_m=np.zeros((frames, 33, 3), np.float32),
            visibility=np.ones((frames, 33), np.float32),
            confidence=np.ones(frames, np.float32),
            present=np.ones(frames, bool),
            bridged=np.zeros(frames, bool),
            silhouette_frames=outlined,
            silhouettes=np.stack(
                [
                    255 * silhouette(self.vertices_m[k], self.faces, CAMERA, OUTLINE)
                    for k in outlined
                ]
            ).astype(np.uint8),
        )
        self.lifted = known(self.keypoints_m, times_s, self.shape.stature_m)

    def fit(self, **options: object) -> BodyFit:
        return fit_body(
            self.track, CAMERA, stature_m=self.shape.stature_m, lifted=self.lifted, **options
        )


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene(60)


@pytest.fixture(scope="module")
def fitted(scene: Scene) -> BodyFit:
    return scene.fit()


@pytest.fixture(scope="module")
def fitted_in_windows(scene: Scene) -> BodyFit:
    """The same, in windows of 30 frames."""
    with pytest.MonkeyPatch.context() as patch:
        shorten_windows(patch)
        return scene.fit()


def shorten_windows(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(fit_windows, "_WINDOW_FRAMES", 30)
    patch.setattr(fit_windows, "_OVERLAP_FRAMES", 12)


def velocity(keypoints_m: np.ndarray, times_s: np.ndarray) -> np.ndarray:
    return np.gradient(np.linalg.norm(keypoints_m, axis=-1), times_s, axis=0)


def test_body_lies_on_its_landmarks(scene: Scene, fitted: BodyFit) -> None:
    away = np.linalg.norm(fitted.keypoints_m - scene.keypoints_m, axis=-1)
    assert away.mean() < 0.03
    in_picture = CAMERA.project(fitted.keypoints_m) - CAMERA.project(scene.keypoints_m)
    assert np.linalg.norm(in_picture, axis=-1).mean() < 2.0
    assert (fitted.quality > 0.5).all()


def test_line_of_sight_velocity_of_the_swiping_hand(scene: Scene, fitted: BodyFit) -> None:
    true, found = (
        velocity(k, scene.track.timebase.times_s) for k in (scene.keypoints_m, fitted.keypoints_m)
    )
    hand = LANDMARKS.index("index.R")
    assert np.corrcoef(true[:, hand], found[:, hand])[0, 1] > 0.97
    assert np.sqrt(((true - found)[:, hand] ** 2).mean()) < 0.08
    for ends in (slice(0, 5), slice(-5, None)):
        assert np.sqrt(((true - found)[ends] ** 2).mean()) < 0.05


@pytest.mark.slow
def test_feet_that_stand_do_not_slide() -> None:
    scene = Scene(30, distance_m=4.5)
    lifted, times_s = scene.lifted, scene.track.timebase.times_s
    track, feet = copy.deepcopy(scene.track), list(FEET)
    track.image_px[:, feet] += 6.0 * np.sin(6.0 * times_s)[:, None, None].astype(np.float32)
    found_mps = []
    for sure in (0.0, 1.0):
        told = replace(lifted, standing=np.full_like(lifted.standing, sure))
        fit = fit_body(track, CAMERA, stature_m=scene.shape.stature_m, lifted=told)
        found_mps.append(
            np.sqrt(np.mean(np.gradient(fit.keypoints_m[:, feet], times_s, axis=0) ** 2))
        )
    free_mps, held_mps = found_mps
    assert held_mps < 0.7 * free_mps


def test_surface_has_the_outline(scene: Scene, fitted: BodyFit) -> None:
    vertices = mesh_of(fitted, "low").read(0, 60)
    assert vertices.dtype == np.float32
    shares = [
        overlap(
            silhouette(vertices[k], scene.faces, CAMERA, OUTLINE),
            silhouette(scene.vertices_m[k], scene.faces, CAMERA, OUTLINE),
        )
        for k in (0, 30, 59)
    ]
    assert min(shares) > 0.9


@pytest.mark.slow
def test_outlines_tell_a_heavy_person_from_a_light_one() -> None:
    heavy = Scene(8)
    girths = {}
    for weight in (0.05, 0.95):
        shape = BodyShape(SPACE.coefficients(weight=weight), heavy.shape.stature_m)
        body = SPACE.load("low", shape)
        found = {}
        scene = Scene(8)
        motion = swipes(SPACE.base_skeleton, scene.track.timebase.times_s)
        transforms = SPACE.skeleton(shape).transforms(
            motion.rotations, motion.translation_m + np.array([0.05, 1.1, 2.4])
        )
        vertices = pose_vertices(body, transforms)
        keypoints_m = KeypointSpace(SPACE).of(shape).positions(transforms)
        masks = [
            255 * silhouette(vertices[k], body.faces, CAMERA, OUTLINE)
            for k in scene.track.silhouette_frames
        ]
        scene.track.silhouettes[:] = masks
        scene.track.image_px[:] = CAMERA.project(keypoints_m)
        scene.lifted = known(keypoints_m, scene.track.timebase.times_s, shape.stature_m)
        found = mesh_of(scene.fit(), "low").frame(0)
        girths[weight] = silhouette(found, body.faces, CAMERA, OUTLINE).sum()
        true = silhouette(vertices[0], body.faces, CAMERA, OUTLINE)
        assert overlap(silhouette(found, body.faces, CAMERA, OUTLINE), true) > 0.88
    assert girths[0.95] > 1.05 * girths[0.05]


@pytest.mark.slow
def test_empty_frames_hold_the_last_known_pose_and_are_marked(scene: Scene) -> None:
    gap = slice(20, 40)
    track = copy.deepcopy(scene.track)
    track.present[gap] = False
    track.image_px[gap] = np.nan
    track.visibility[gap] = 0.0
    found = fit_body(track, CAMERA, stature_m=scene.shape.stature_m, lifted=scene.lifted)
    assert not found.present[gap].any()
    assert found.present.sum() == 40
    assert np.isfinite(found.turns).all()
    np.testing.assert_array_equal(found.keypoints_m[25], found.keypoints_m[19])
    np.testing.assert_array_equal(found.keypoints_m[39], found.keypoints_m[19])
    assert np.isnan(found.residual_m[gap]).all()
    assert (found.quality[gap] == 0).all()
    away = np.linalg.norm(found.keypoints_m - scene.keypoints_m, axis=-1)
    assert away[track.present].mean() < 0.03


@pytest.mark.one_in(3)
@pytest.mark.parametrize("frames", [1, 2, 3])
def test_the_shortest_clips(frames: int) -> None:
    scene = Scene(frames)
    found = scene.fit()
    away = np.linalg.norm(found.keypoints_m - scene.keypoints_m, axis=-1)
    assert away.mean() < 0.04


@pytest.mark.slow
def test_windows_join_without_a_step(fitted: BodyFit, fitted_in_windows: BodyFit) -> None:
    found = fitted_in_windows
    away = np.linalg.norm(found.keypoints_m - fitted.keypoints_m, axis=-1)
    assert away.mean() < 0.01
    rough, smooth = (np.abs(np.diff(one.keypoints_m, n=3, axis=0)).max() for one in (found, fitted))
    assert rough < 3.0 * smooth


@pytest.mark.parametrize("frames", [59, 600, 601, 1500])
def test_windows_cover_a_stretch(frames: int) -> None:
    covered = np.zeros(frames + 7, int)
    end = 7
    for start, stop, shared in fit_windows.Windows(np.arange(7 + frames) >= 7, None).spans:
        assert start + shared == end
        covered[start + shared : stop] += 1
        end = stop
    assert (covered[7:] == 1).all()
    assert (covered[:7] == 0).all()


@pytest.mark.slow
def test_a_stopped_fit_goes_on(
    scene: Scene, fitted_in_windows: BodyFit, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shorten_windows(monkeypatch)
    whole = fitted_in_windows

    def stop_late(done: int, total: int) -> None:
        if done > total // 2:
            raise Cancelled

    with pytest.raises(Cancelled):
        scene.fit(workspace=tmp_path, progress=stop_late)
    assert list(tmp_path.glob("pose-*.npz"))
    calls = []
    real = fitting.solve
    monkeypatch.setattr(fitting, "solve", lambda *a: calls.append(1) or real(*a))
    resumed = scene.fit(workspace=tmp_path)
    assert len(calls) < len(fit_windows.Windows(np.ones(60, bool), None).spans)
    np.testing.assert_array_equal(resumed.turns, whole.turns)
    # What another clip left there is not used, nor what is damaged.
    file = next(iter(tmp_path.glob("pose-*.npz")))
    file.write_bytes(b"PK damaged")
    again = scene.fit(workspace=tmp_path)
    np.testing.assert_array_equal(again.turns, whole.turns)


@pytest.mark.slow
def test_stature_sets_the_scale(scene: Scene, fitted: BodyFit) -> None:
    half = fit_body(scene.track, CAMERA, stature_m=0.5 * scene.shape.stature_m, lifted=scene.lifted)
    np.testing.assert_allclose(half.keypoints_m, 0.5 * fitted.keypoints_m, atol=0.03)


def test_impossible_stature_and_nobody_are_refused(scene: Scene) -> None:
    with pytest.raises(Sd2Error, match="body height is 172"):
        fit_body(scene.track, CAMERA, stature_m=172.0, lifted=scene.lifted)
    empty = Scene(3)
    empty.track.present[:] = False
    with pytest.raises(Sd2Error, match="No frame of the video shows a person"):
        empty.fit()


@pytest.mark.parametrize("resolution", ["low", "medium", "high"])
def test_mesh_is_read_in_any_stretch(fitted: BodyFit, resolution) -> None:
    mesh = mesh_of(fitted, resolution)
    assert mesh.vertices.shape == (60, mesh.vertex_count, 3)
    whole = mesh.read(10, 14)
    np.testing.assert_array_equal(mesh.frame(12), whole[2])
    np.testing.assert_array_equal(mesh.vertices[12], whole[2])
    np.testing.assert_array_equal(mesh.vertices[10:14, :5], whole[:, :5])
    np.testing.assert_array_equal(mesh.vertices[[13, 10]], whole[[3, 0]])
