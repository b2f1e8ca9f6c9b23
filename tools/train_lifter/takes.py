"""Takes of random people, with what the landmark network says about them and the truth.

Several processes make a folder of them: ``python -m tools.train_lifter data``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.blazepose import CLOSE_UP, Pose, PoseLandmarker, Roi
from sd2core.body.camera import PinholeCamera
from sd2core.body.initial import Pose as BodyPose
from sd2core.body.landmark_models import DEFAULT_MODEL, LandmarkModel, landmark_models
from sd2core.body.landmark_repair import on_cubics
from sd2core.body.refining import fast_looks
from sd2core.body.rig import JOINT, Keypoints, KeypointSpace, Rig
from sd2core.body.rotations import Floats, from_vector
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.body.skinning import pose_vertices
from sd2core.body.track import LANDMARKS
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write
from sd2core.mocap.body_motion import RATE_HZ, BodyMotion, Role, load_motions
from sd2core.mocap.driving import resample_pose
from sd2core.options.kinds import Count
from sd2core.options.records import ARGUMENT, OptionRecord
from sd2core.processes import end_with_parent
from sd2core.progress import Progress, silent
from sd2core.simulate.people.motion import random_motion
from tools.train_lifter.crops import (
    CropPainter,
    Furniture,
    random_background,
    random_furniture,
    random_look,
    random_wardrobe,
)
from tools.train_lifter.deeds import Manner, View, random_deed, random_view, random_view_around

FRAMES = 96

_HIPS = [LANDMARKS.index("hip.L"), LANDMARKS.index("hip.R")]
_ROI_FOLLOWS = 0.25
_WALKS_MPS = 0.4
_PACE = 0.22
_SLOWEST = 0.4
"""Pace below which a motion is too short for a take."""
_FURNISHED = 0.25
_LOST = 0.5
_OTHER_ARMS = 0.2
_ARMS = [
    JOINT[f"{name}.{side}"]
    for name in ("clavicle", "shoulder", "elbow", "pronation", "wrist")
    for side in "LR"
]


class Motion(OptionRecord):
    """How the people of takes move.

    Parameters
    ----------
    seed : S
        seed of all random numbers
    held_out
        with the kinds of motion kept for testing
    manner
        how people move: with elbows any way they can be, as people have them, or gesturing before
        the camera, with arms or with forearms alone
    motions : FOLDER
        people move as those recorded there do (made by python -m tools.motion_capture)
    """

    seed: int = 0
    held_out: bool = False
    manner: Manner = "any"
    motions: Path | None = None

    def loaded(self) -> list[BodyMotion]:
        """The recorded motions, of those who are kept for calibration if any are held out."""
        role: Role = "calibrate" if self.held_out else "learn"
        return [] if self.motions is None else load_motions(self.motions, role)

    def generator(self, number: int, *more: int) -> np.random.Generator:
        """Random numbers of a take, or of something of it."""
        return np.random.default_rng((self.seed, int(self.held_out), number, *more))


@dataclass(frozen=True, eq=False)
class Take:
    """One take."""

    camera: PinholeCamera
    stature_m: float
    keypoints_m: NDArray[np.float32]  # (T, 33, 3), truth, camera frame
    # (T, 33, 3, 3), turn against rest of the bone that each keypoint is fixed to.
    bone_turns: NDArray[np.float32]
    # What the network says; see LandmarkTrack.
    image_px: NDArray[np.float32]  # (T, 33, 2)
    depth_px: NDArray[np.float32]  # (T, 33)
    world_m: NDArray[np.float32]  # (T, 33, 3)
    visibility: NDArray[np.float32]  # (T, 33)
    confidence: NDArray[np.float32]  # (T,)

    def save(self, path: Path) -> None:
        """Write one ``.npz``, whole or not at all."""
        camera = self.camera
        arrays: dict[str, Any] = {
            name: value for name, value in vars(self).items() if name != "camera"
        }
        arrays["camera"] = np.array([camera.width, camera.height, camera.focal_px])
        with atomic_write(path) as stream:
            np.savez_compressed(stream, **arrays)

    @classmethod
    def load(cls, path: Path) -> Take:
        """Read what :meth:`save` wrote."""
        with np.load(path, allow_pickle=False) as data:
            arrays: dict[str, Any] = {name: data[name] for name in data.files}
        width, height, focal_px = arrays.pop("camera")
        arrays["stature_m"] = float(arrays["stature_m"])
        return cls(camera=PinholeCamera(int(width), int(height), float(focal_px)), **arrays)


class Scene(NamedTuple):
    """A random person moving before a random camera."""

    shape: BodyShape
    camera: PinholeCamera
    transforms: Floats  # (T, B, 3, 4), of the bones, ending in the camera frame
    keypoints_m: Floats  # (T, 33, 3), camera frame
    bone_turns: Floats  # (T, 33, 3, 3)


class Stage:
    """Makes scenes, of bodies that move as real people did if there are motions."""

    def __init__(self, motions: Sequence[BodyMotion] = ()) -> None:
        self.motions = motions
        self.space = ShapeSpace()
        self._keypoints = KeypointSpace(self.space)

    def drawn(self, rng: np.random.Generator, how: Motion, frames: int = FRAMES) -> Scene:
        """A random scene with people who move as is said."""
        if self.motions:
            return self.captured(rng, frames)
        return self.scene(rng, held_out=how.held_out, manner=how.manner, frames=frames)

    def scene(
        self,
        rng: np.random.Generator,
        *,
        held_out: bool = False,
        manner: Manner = "any",
        elbows_rest: bool = False,
        frames: int = FRAMES,
    ) -> Scene:
        """A random scene; ``held_out`` with the motion that is kept for testing."""
        times = np.arange(frames) / RATE_HZ
        while True:
            shape = self.space.random(rng)
            skeleton = self.space.skeleton(shape)
            deed = random_deed(rng, held_out=held_out, manner=manner)
            deed = replace(deed, elbows_rest=deed.elbows_rest or elbows_rest)
            motion = random_motion(rng, skeleton, shape.stature_m, times, deed)
            transforms = skeleton.transforms(*motion)
            if not np.isfinite(transforms).all():
                continue  # an arm that does not reach so far
            keypoints = self._keypoints.of(shape)
            view = random_view(rng, keypoints.positions(transforms))
            if view is None:
                continue
            return _scene(shape, keypoints, view, transforms)

    def captured(self, rng: np.random.Generator, frames: int = FRAMES) -> Scene:
        """A random body in a part of a real person's motion, seen from anywhere around.

        The motion may be reversed, and up to a quarter faster or slower than it was; a short one
        is drawn out. The arms may move as in another recording.
        """
        motions = self.motions
        share = np.array([_weight(motion) for motion in motions])
        share /= share.sum()
        while True:
            motion = motions[int(rng.choice(len(motions), p=share))]
            pace = float(np.exp(rng.uniform(-_PACE, _PACE)))
            needed = math.ceil((frames - 1) * pace) + 1
            if len(motion) < needed:
                pace, needed = (len(motion) - 1) / (frames - 1), len(motion)
            if pace < _SLOWEST:
                continue
            start = int(rng.integers(0, len(motion) - needed + 1))
            shape = self.space.random(rng)
            keypoints = self._keypoints.of(shape)
            whole = self.space.skeleton(shape)
            rig = Rig(whole, keypoints)
            own = self.space.skeleton(motion.shape)
            pose = motion.pose_on(whole, own, slice(start, start + needed))
            if rng.random() < _OTHER_ARMS:
                pose = _with_arms(rng, pose, motions[int(rng.choice(len(motions), p=share))])
            ticks = np.arange(frames, dtype=np.float64) * pace
            pose = resample_pose(pose, np.arange(needed, dtype=float), ticks)
            if rng.random() < 0.5:
                pose = pose.at(slice(None, None, -1))
            transforms = whole.transforms(rig.body_rotations(pose.turns), pose.translation_m)
            view = random_view_around(rng, keypoints.positions(transforms))
            if view is not None:
                return _scene(shape, keypoints, view, transforms)


def _scene(shape: BodyShape, keypoints: Keypoints, view: View, transforms: Floats) -> Scene:
    transforms = view.transforms(transforms)
    return Scene(
        shape,
        view.camera,
        transforms,
        keypoints.positions(transforms),
        transforms[:, keypoints.bones, :, :3],
    )


def _with_arms(rng: np.random.Generator, pose: BodyPose, other: BodyMotion) -> BodyPose:
    """A pose whose arms move as in a part of another motion; as it is where that is too short."""
    frames = len(pose.turns)
    if len(other) < frames:
        return pose
    start = int(rng.integers(0, len(other) - frames + 1))
    turns = pose.turns.copy()
    turns[:, _ARMS] = from_vector(other.vectors[start : start + frames, _ARMS])
    return BodyPose(turns, pose.translation_m)


def _weight(motion: BodyMotion) -> float:
    """How often a motion is drawn: by its length, up to half a minute, and its way."""
    speed_mps = np.linalg.norm(np.diff(motion.translation_m[:, [0, 2]], axis=0), axis=1) * RATE_HZ
    walks = 2.0 if np.median(speed_mps) > _WALKS_MPS else 1.0
    return walks * (min(len(motion), 900) + 100)


class TakeMaker:
    """Makes takes; each depends on how people move and on its number only."""

    def __init__(self, landmarker: PoseLandmarker, how: Motion | None = None) -> None:
        self._landmarker = landmarker
        self._how = how or Motion()
        self._stage = Stage(self._how.loaded())

    def make(self, number: int, frames: int = FRAMES) -> Take:
        """One take; people who move as real ones did are perhaps behind furniture."""
        rng = self._how.generator(number)
        scene = self._stage.drawn(rng, self._how, frames)
        furniture = None
        if self._stage.motions and rng.random() < _FURNISHED:
            places_px = scene.camera.project(scene.keypoints_m)
            size = scene.camera.width, scene.camera.height
            furniture = random_furniture(rng, places_px, *size)
        return self._filmed(rng, scene, furniture)

    def _filmed(self, rng: np.random.Generator, scene: Scene, furniture: Furniture | None) -> Take:
        """A scene in random clothes, light and surroundings, and what is seen of it."""
        camera = scene.camera
        body = self._stage.space.load("medium", scene.shape)
        painter = CropPainter(
            body.faces,
            random_wardrobe(rng, body),
            camera,
            random_look(rng),
            random_background(rng, camera.width, camera.height),
            rng,
            furniture,
        )
        vertices = pose_vertices(body, scene.transforms)
        return Take(
            camera,
            scene.shape.stature_m,
            scene.keypoints_m.astype(np.float32),
            scene.bone_turns.astype(np.float32),
            **self._watched(rng, painter, vertices, camera.project(scene.keypoints_m)),
        )

    def _watched(
        self,
        rng: np.random.Generator,
        painter: CropPainter,
        vertices: NDArray[np.float32],
        places_px: Floats,
    ) -> dict[str, NDArray[np.float32]]:
        """Landmarks of every frame as the second pass over a video gives them.

        Every other frame is looked at, the square following the person, and those in between
        where something moves fast; the others follow by cubics.
        """
        roi = self._landmarker.on_crop(*_first(rng, painter, vertices[0], places_px[0])).next_roi
        frames = len(vertices)
        watched = np.append(np.arange(0, frames - 1, 2), frames - 1)
        poses: dict[int, Pose] = {}
        for frame in watched:
            poses[frame] = self._look(painter, vertices[frame], roi)
            if poses[frame].confidence < _LOST:
                roi = _around(places_px[frame])
            else:
                roi = _towards(roi, poses[frame].next_roi)
        times_s = np.arange(frames) / RATE_HZ
        arrays = _stacked([poses[frame] for frame in watched])
        sizes_px = np.array([poses[frame].roi.size_px for frame in watched]) / CLOSE_UP
        fast = fast_looks(times_s[watched], arrays["image_px"], arrays["visibility"], sizes_px)
        for before, after in pairwise(range(len(watched))):
            if fast[before] or fast[after]:
                for frame in range(watched[before] + 1, watched[after]):
                    near = poses[watched[before]].next_roi
                    poses[frame] = self._look(painter, vertices[frame], near)
        known = sorted(poses)
        empty = np.ones(frames, bool)
        empty[known] = False
        filled = {}
        for name, values in _stacked([poses[frame] for frame in known]).items():
            whole = np.full((frames, *values.shape[1:]), np.nan, np.float32)
            whole[known] = values
            filled[name] = on_cubics(times_s, whole, empty).astype(np.float32)
        np.clip(filled["visibility"], 0.0, 1.0, out=filled["visibility"])
        sure, between = filled["confidence"], np.flatnonzero(empty)
        sure[between] = np.minimum(sure[between - 1], sure[between + 1])
        return filled

    def _look(self, painter: CropPainter, surface: NDArray[np.float32], roi: Roi) -> Pose:
        near = roi.scaled(CLOSE_UP)
        return self._landmarker.on_both_sides(painter.crop(surface, near), near)


def _stacked(poses: Sequence[Pose]) -> dict[str, NDArray[np.float32]]:
    """What is kept of some looks."""
    return {
        "image_px": np.array([pose.image_px[:33] for pose in poses], np.float32),
        "depth_px": np.array([pose.depth_px for pose in poses], np.float32),
        "world_m": np.array([pose.world_m for pose in poses], np.float32),
        "visibility": np.array([pose.visibility * pose.presence for pose in poses], np.float32),
        "confidence": np.array([pose.confidence for pose in poses], np.float32),
    }


def _first(
    rng: np.random.Generator, painter: CropPainter, surface: NDArray[np.float32], places_px: Floats
) -> tuple[NDArray[np.uint8], Roi]:
    roi = _around(places_px)
    move = 0.04 * roi.size_px * rng.standard_normal(2)
    roi = Roi(
        roi.centre_x_px + move[0],
        roi.centre_y_px + move[1],
        roi.size_px * float(np.exp(0.08 * rng.standard_normal())),
    )
    return painter.crop(surface, roi), roi


def _around(places_px: Floats) -> Roi:
    """The square around true keypoints, upright."""
    centre = places_px[_HIPS].mean(axis=0)
    radius = 1.08 * float(np.linalg.norm(places_px - centre, axis=1).max())
    return Roi.around(centre, centre - np.array([0.0, radius]))


def _towards(old: Roi, new: Roi) -> Roi:
    """A square that follows smoothly."""
    turn = np.arctan2(np.sin(new.angle_rad - old.angle_rad), np.cos(new.angle_rad - old.angle_rad))
    share = _ROI_FOLLOWS
    return Roi(
        old.centre_x_px + share * (new.centre_x_px - old.centre_x_px),
        old.centre_y_px + share * (new.centre_y_px - old.centre_y_px),
        old.size_px * float((new.size_px / old.size_px) ** share),
        old.angle_rad + share * float(turn),
    )


class Data(Motion):
    """Options of ``data``.

    Parameters
    ----------
    out : OUT
        folder of the takes
    takes : N
        how many
    processes : P
        at work at once
    models : FOLDER
        the landmark models
    landmark_model
        which of them looks
    """

    out: Annotated[Path, ARGUMENT]
    takes: Count = 400
    processes: Count = 2
    models: Path | None = None
    landmark_model: LandmarkModel = DEFAULT_MODEL


_maker: TakeMaker | None = None


def make_lifter_data(options: Data, progress: Progress = silent) -> int:
    """Make the takes of a folder that are not there yet, each whole or not at all; their number."""
    landmark_models(options.models, model=options.landmark_model)
    options.out.mkdir(parents=True, exist_ok=True)
    missing = [n for n in range(options.takes) if not take_path(options.out, n).exists()]
    done = options.takes - len(missing)
    progress(done, options.takes)
    with ProcessPoolExecutor(options.processes, get_context("spawn"), _start, (options,)) as pool:
        for made, _ in enumerate(pool.map(partial(_make, options.out), missing), start=1):
            progress(done + made, options.takes)
    return len(missing)


def take_path(folder: Path, number: int) -> Path:
    """Path of one take."""
    return folder / f"take-{number:05d}.npz"


def load_takes(folder: Path) -> list[Take]:
    """All takes of a folder, in the order of their numbers; Sd2Error if there are none."""
    takes = [Take.load(path) for path in sorted(folder.glob("take-*.npz"))]
    if not takes:
        raise Sd2Error(
            f"There are no takes in {folder}",
            "a folder made by `python -m tools.train_lifter data`",
        )
    return takes


def _start(options: Data) -> None:
    end_with_parent()
    global _maker
    models = landmark_models(options.models, model=options.landmark_model)
    _maker = TakeMaker(PoseLandmarker(models.landmarker), options)


def _make(folder: Path, number: int) -> None:
    assert _maker is not None
    _maker.make(number).save(take_path(folder, number))
