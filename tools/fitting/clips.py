"""Clips of simulated people with known motion, to measure a fit from video against.

Every clip is a folder with the picture (``video.mp4``), the surface that was drawn
(``mesh.zarr``) and what is known besides (``truth.json``).
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core import MeshSequence, Sd2Error, Span, Timebase
from sd2core.body.model import Body, Resolution, Skeleton
from sd2core.body.rig import KeypointSpace
from sd2core.body.rotations import Floats, applied
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.body.skinning import pose_vertices
from sd2core.files.atomic import atomic_folder
from sd2core.io.video_writing import write_video
from sd2core.mocap.body_motion import RATE_HZ, BodyMotion, Role
from sd2core.progress import Progress, silent
from sd2core.simulate.limbs import arm_length_m, turn_about
from tools.build_sample.clothing import Clothes
from tools.build_sample.render import Camera, Renderer
from tools.build_sample.sample import write_compact_mesh
from tools.fitting.cast import PEOPLE, ROOMS
from tools.fitting.motions import Action, duration_s, perform
from tools.fitting.truth import FORMAT, VERSION, read_truth
from tools.motion_capture.catalogue import moved_transforms

_REMEDY = "Make it: python -m tools.motion_capture drive DATA/motion MOTIONS"


FRAMES_PER_S = 30
RESOLUTION: Resolution = "medium"
"""Resolution of the surface that is kept; the picture is drawn from the finest."""

NOISE = 0.012
"""Noise of the camera before compression: a still room must not be perfectly still."""

_HORIZONTAL = ("left-to-right", "right-to-left")
_VERTICAL = ("up-to-down", "down-to-up")
_ALL = (*_HORIZONTAL, *_VERTICAL)


@dataclass(frozen=True)
class Clip:
    """One clip: who does what, where, seen from where."""

    name: str
    action: Action
    # Of PEOPLE and ROOMS of tools.fitting.cast.
    person: str
    room: str
    # distance_m and across_m: where the person stands (at first), seen from the camera.
    distance_m: float
    camera_m: float  # height of the camera over the floor; it looks level
    seed: int  # of the strokes and of the camera's noise
    across_m: float = 0.0


def _swipes(names: Sequence[Any], speed: Any, hand: Any = "R") -> Action:
    return Action("swipes", tuple(names), speed, hand)


CLIPS = (
    Clip("horizontal-slow", _swipes(_HORIZONTAL, "slow"), "ada", "studio", 2.2, 1.1, 11),
    Clip("horizontal-normal", _swipes(_HORIZONTAL * 2, "normal"), "bo", "window", 2.4, 1.2, 12),
    Clip("horizontal-fast", _swipes(_HORIZONTAL * 2, "fast"), "chen", "office", 2.2, 1.0, 13, 0.1),
    Clip("vertical-slow", _swipes(_VERTICAL, "slow"), "dora", "evening", 2.0, 1.2, 14),
    Clip("vertical-normal", _swipes(_VERTICAL * 2, "normal"), "emil", "studio", 2.6, 1.0, 15, -0.1),
    Clip("vertical-fast", _swipes(_VERTICAL * 2, "fast"), "femi", "window", 2.8, 1.3, 16),
    Clip("all-normal", _swipes(_ALL, "normal"), "ada", "office", 3.0, 1.4, 17, 0.2),
    Clip("all-fast", _swipes(_ALL, "fast"), "emil", "evening", 2.2, 1.1, 18),
    Clip("left-hand-normal", _swipes(_ALL, "normal", "L"), "dora", "window", 1.8, 1.2, 19),
    Clip("left-hand-fast", _swipes(_ALL, "fast", "L"), "bo", "office", 3.5, 1.5, 20, -0.2),
    Clip("still", Action("still"), "chen", "studio", 2.2, 1.1, 21),
    Clip("still-hand-up", Action("still", raised=True), "femi", "evening", 3.2, 1.2, 22, 0.1),
    Clip("walk", Action("walk"), "emil", "office", 4.5, 1.1, 23),
    Clip(
        "walk-aside", Action("walk", walk_m=2.4, walk_mps=0.95), "ada", "window", 4.4, 1.3, 24, 0.35
    ),
    Clip("turn", Action("turn"), "bo", "studio", 3.0, 1.1, 25),
    Clip(
        "turn-other", Action("turn", turn_deg=(-85.0, 60.0)), "dora", "office", 2.6, 1.2, 26, -0.1
    ),
)
"""Clips that fits are scored on; the weights of the fit were chosen by others."""


def _real(trial: str, start_s: float, length_s: float, heading_deg: float) -> Action:
    action = Action("captured", trial=trial, start_s=start_s, length_s=length_s)
    return replace(action, heading_deg=heading_deg)


REAL_MOTION = (
    Clip("walk-towards", _real("08_01", 0.0, 2.2, 0.0), "bo", "studio", 4.6, 1.2, 31),
    Clip("walk-away", _real("08_10", 0.0, 2.2, 180.0), "dora", "office", 3.4, 1.5, 32),
    Clip("walk-across", _real("02_01", 0.0, 2.6, 90.0), "chen", "window", 4.2, 1.0, 33),
    Clip("walk-oblique", _real("12_02", 0.0, 5.0, -40.0), "femi", "evening", 4.4, 1.6, 34),
    Clip("walk-about", _real("09_12", 1.0, 7.0, 20.0), "ada", "studio", 4.6, 1.1, 35),
    Clip("walk-turning", _real("09_12", 8.0, 7.0, -120.0), "emil", "window", 4.6, 2.0, 36),
    Clip("sit-and-stand", _real("ui_m05_s09_e02", 0.0, 2.4, 15.0), "ada", "office", 3.2, 1.2, 37),
    Clip("sit-oblique", _real("ui_m05_s10_e05", 0.0, 2.0, -55.0), "bo", "evening", 3.4, 0.9, 38),
    Clip("squat", _real("ui_m01_s09_e05", 0.0, 2.8, 60.0), "dora", "studio", 3.6, 1.3, 39),
    Clip("bend-and-lift", _real("02_06", 1.0, 6.0, 30.0), "emil", "office", 3.4, 1.4, 40),
    Clip("reach-and-wash", _real("02_10", 4.0, 6.0, -20.0), "femi", "window", 3.2, 1.2, 41),
    Clip("punch", _real("02_05", 3.0, 5.0, -60.0), "chen", "studio", 3.4, 1.1, 42),
    Clip("exercise", _real("ui_m02_s09_e02", 0.0, 2.0, 10.0), "bo", "window", 3.8, 1.2, 43),
    Clip("exercise-side", _real("ui_m03_s10_e05", 0.0, 2.0, 75.0), "ada", "evening", 3.8, 1.0, 44),
    Clip("jump", _real("02_04", 0.0, 4.0, -30.0), "dora", "window", 3.8, 1.2, 45),
    Clip("hop", _real("49_02", 4.0, 5.0, 140.0), "emil", "studio", 4.0, 1.3, 46),
    Clip("dance", _real("49_11", 1.0, 6.0, 45.0), "femi", "office", 4.0, 1.2, 47),
    Clip("cropped-bend", _real("02_06", 8.0, 5.0, 0.0), "ada", "window", 1.9, 1.45, 48),
    Clip("cropped-hop", _real("49_03", 2.0, 5.0, -25.0), "chen", "office", 2.0, 1.5, 49),
    Clip("cropped-lunge", _real("ui_m04_s10_e02", 0.0, 2.0, 20.0), "bo", "studio", 2.2, 1.6, 50),
    Clip("cropped-walk", _real("12_01", 1.0, 2.0, 90.0), "dora", "evening", 2.3, 1.4, 51),
    Clip("arms-leaving", _real("ui_m07_s09_e02", 0.0, 2.4, 0.0), "emil", "window", 1.3, 1.3, 52),
    Clip("towards-2", _real("08_05", 0.0, 2.2, 0.0), "chen", "office", 4.4, 1.3, 53, 0.1),
    Clip("towards-3", _real("12_03", 0.0, 4.2, 10.0), "ada", "evening", 4.8, 1.0, 54),
    Clip("away-2", _real("08_07", 0.0, 2.2, 180.0), "femi", "studio", 3.6, 1.2, 55),
    Clip("away-3", _real("49_01", 0.0, 4.8, -170.0), "bo", "window", 4.2, 1.5, 56),
    Clip("sit-front", _real("ui_m05_s09_e08", 0.0, 2.2, 0.0), "emil", "evening", 3.0, 1.1, 57),
    Clip("sit-back", _real("ui_m05_s10_e02", 0.0, 2.4, 150.0), "dora", "office", 3.2, 1.2, 58),
    Clip("reach-down", _real("02_06", 13.0, 5.0, -10.0), "chen", "window", 3.2, 1.3, 59),
    Clip("reach-up", _real("ui_m10_s10_e02", 0.0, 1.6, 35.0), "femi", "office", 2.8, 1.1, 60),
    Clip("kick-front", _real("ui_m06_s09_e02", 0.0, 1.8, 0.0), "bo", "studio", 3.4, 1.2, 61),
    Clip("kick-side", _real("ui_m06_s10_e05", 0.0, 1.7, 60.0), "ada", "window", 3.6, 1.0, 62),
    Clip("jump-2", _real("49_02", 11.0, 5.0, -20.0), "dora", "studio", 4.0, 1.3, 63),
    Clip("leap", _real("49_04", 0.0, 2.0, -60.0), "chen", "evening", 4.8, 1.2, 64),
    Clip("swordplay", _real("02_08", 2.0, 6.0, 0.0), "emil", "office", 3.4, 1.2, 65),
    Clip("wash", _real("02_10", 12.0, 6.0, 30.0), "femi", "studio", 2.8, 1.3, 66),
)
"""Clips with the motion of real people whom nothing was learnt from or tuned on; the cropped ones
are cut off at the knees, and in one an arm leaves the picture and comes back."""

TUNING = (
    Clip("tune-1", _swipes(_ALL, "fast"), "ada", "window", 2.4, 1.2, 101, 0.1),
    Clip("tune-2", _swipes(_ALL, "normal"), "bo", "studio", 2.0, 1.1, 102),
    Clip("tune-3", _swipes(_HORIZONTAL * 2, "fast", "L"), "dora", "office", 2.6, 1.3, 103, -0.1),
    Clip("tune-4", _swipes(_VERTICAL * 2, "fast"), "chen", "evening", 2.2, 1.0, 104),
    Clip("tune-5", _swipes(_ALL, "normal", "L"), "femi", "studio", 3.0, 1.2, 105, 0.15),
    Clip("tune-6", _swipes(_ALL, "fast"), "emil", "window", 3.2, 1.4, 106),
    Clip("tune-7", _swipes(_VERTICAL, "slow", "L"), "bo", "office", 2.6, 1.1, 107),
    Clip("tune-8", _swipes(_HORIZONTAL, "slow"), "femi", "evening", 2.4, 1.2, 108, 0.1),
    Clip("tune-9", Action("walk", walk_m=2.6, walk_mps=0.95), "dora", "studio", 4.6, 1.2, 109),
    Clip("tune-10", Action("turn", turn_deg=(60.0, -75.0)), "ada", "window", 2.8, 1.1, 110),
    Clip("tune-11", _real("131_01", 1.0, 5.0, 0.0), "bo", "office", 4.4, 1.2, 111),
    Clip("tune-12", _real("131_03", 1.0, 5.0, -40.0), "chen", "studio", 4.2, 1.3, 112),
    Clip("tune-13", _real("17_10", 4.0, 5.0, 20.0), "dora", "evening", 3.2, 1.1, 113),
    Clip("tune-14", _real("32_01", 0.0, 2.8, 180.0), "emil", "studio", 3.8, 1.4, 114),
    Clip("tune-15", _real("indian_06", 4.0, 5.0, 0.0), "femi", "window", 3.4, 1.2, 115),
    Clip("tune-16", _real("indian_14", 4.0, 5.0, 120.0), "ada", "office", 3.8, 1.3, 116),
    Clip("tune-17", _real("ui_m05_s08_e02", 0.0, 2.2, 10.0), "bo", "evening", 3.2, 1.1, 117),
    Clip("tune-18", _real("ui_m04_s08_e02", 0.0, 2.2, 60.0), "chen", "window", 3.6, 1.2, 118),
    Clip("tune-19", _real("17_03", 0.0, 3.6, -90.0), "dora", "studio", 4.2, 1.0, 119),
    Clip("tune-20", _real("131_02", 3.0, 5.0, 170.0), "emil", "office", 4.0, 1.2, 120),
)
"""Other clips, by which the weights of the fit and its statements are chosen (``--tuning``);
those with the motion of real people are of the persons whose errors calibrate."""


ALL_CLIPS = (*CLIPS, *REAL_MOTION, *TUNING)


def clip_named(name: str) -> Clip:
    """The clip of a name; Sd2Error if there is none."""
    known = {clip.name: clip for clip in ALL_CLIPS}
    if name not in known:
        raise Sd2Error(f"There is no clip {name!r}", ", ".join(known))
    return known[name]


def make_fit_truth(
    out: Path,
    clips: Sequence[Clip] = CLIPS,
    progress: Progress = silent,
    motions: Path | None = None,
) -> list[Path]:
    """Make clips that are not there yet, and return the folders of all, in order.

    Parameters
    ----------
    out : Path
        A folder, made if need be; every clip becomes a folder in it, and appears there when it is
        complete. Sd2Error if one of that name is there and is not this clip.
    progress : Progress
        Counts frames of the clips to be made.
    motions : Path, optional
        Folder made by ``python -m tools.motion_capture``, for clips of :data:`REAL_MOTION`.
    """
    out = Path(out)
    if not out.absolute().parent.is_dir():
        raise Sd2Error(f"The folder {out.absolute().parent} does not exist", "an existing folder")
    out.mkdir(exist_ok=True)
    missing = [clip for clip in clips if not _is_made(out / clip.name, clip)]
    total, done = sum(_frame_count(clip) for clip in missing), 0
    for clip in missing:
        before = done
        with atomic_folder(out / clip.name) as folder:
            _fill(folder, clip, motions, lambda frames, _: progress(before + frames, total))  # noqa: B023
        done += _frame_count(clip)
    progress(total, total)
    return [out / clip.name for clip in clips]


@dataclass(frozen=True, eq=False)
class Scene:
    """A clip before it is drawn."""

    shape: BodyShape
    times_s: NDArray[np.float64]  # (T,)
    # (T, B, 3, 4), of the bones, in the camera frame.
    transforms: NDArray[np.float64]
    skeleton: Skeleton
    spans: tuple[Span, ...]
    camera: Camera

    def mesh(self, space: ShapeSpace, resolution: Resolution) -> MeshSequence:
        """The moving surface in the camera frame, float32."""
        body = space.load(resolution, self.shape)
        vertices = pose_vertices(body, self.transforms)
        return MeshSequence(vertices, body.faces, Timebase(self.times_s), source="simulated body")


def scene(clip: Clip, space: ShapeSpace, motions: Path | None = None) -> Scene:
    """Everything about a clip but its picture; ``motions`` as :func:`make_fit_truth` takes it."""
    shape = PEOPLE[clip.person].shape(space)
    skeleton = space.skeleton(shape)
    times_s = np.arange(_frame_count(clip)) / FRAMES_PER_S
    camera = Camera(above_floor_m=clip.camera_m)
    place = np.array([clip.across_m, clip.camera_m, clip.distance_m])
    if clip.action.kind == "captured":
        role: Role = "calibrate" if clip in TUNING else "measure"
        transforms = _captured(space, shape, clip.action, place, motions, role)
        return Scene(shape, times_s, transforms, skeleton, (), camera)
    scale = arm_length_m(skeleton) / arm_length_m(space.base_skeleton)
    motion, spans = perform(skeleton, clip.action, times_s, clip.seed, scale)
    transforms = skeleton.transforms(motion.rotations, motion.translation_m + place)
    return Scene(shape, times_s, transforms, skeleton, spans, camera)


def _captured(
    space: ShapeSpace,
    shape: BodyShape,
    action: Action,
    place_m: Floats,
    motions: Path | None,
    role: Role,
) -> Floats:
    """Transforms (T, B, 3, 4) of bones: the middle of the way, on the floor, is at ``place_m``."""
    if motions is None:
        raise Sd2Error(f"The motion {action.trial} is not at hand", "--motions MOTIONS", _REMEDY)
    path = motions / f"{action.trial}.npz"
    if not path.is_file():
        raise Sd2Error(f"{path} does not exist", "a motion of that name", _REMEDY)
    motion = BodyMotion.load(path)
    if motion.role != role:
        raise Sd2Error(f"{path} is a motion to {motion.role}", f"one to {role}")
    start = round(action.start_s * RATE_HZ)
    frames = slice(start, start + round(action.length_s * RATE_HZ))
    if len(motion) < frames.stop:
        raise Sd2Error(f"{path} has {len(motion)} frames", f"{frames.stop} or more")
    whole, rig = space.skeleton(shape), KeypointSpace(space).rig(shape)
    pose = motion.pose_on(whole, space.skeleton(motion.shape), frames)
    transforms = whole.transforms(rig.body_rotations(pose.turns), pose.translation_m)
    return _before_camera(whole, transforms, action.heading_deg, place_m)


def _before_camera(
    skeleton: Skeleton, transforms: Floats, heading_deg: float, place_m: Floats
) -> Floats:
    """Turned about the vertical until the start has the wanted heading, then moved."""
    root = skeleton.heads_m[0]
    ahead = -transforms[0, 0, :, 2]  # at rest the body looks along -z
    facing_deg = np.degrees(np.arctan2(-ahead[0], -ahead[2]))
    turn = turn_about(1, np.array([heading_deg - facing_deg]))[0]
    way_m = applied(turn, applied(transforms[:, 0, :, :3], root) + transforms[:, 0, :, 3])
    middle_m = 0.5 * (way_m.min(axis=0) + way_m.max(axis=0))
    return moved_transforms(transforms, turn, place_m - middle_m * [1.0, 0.0, 1.0])


def renderer(clip: Clip, space: ShapeSpace, known: Scene) -> Renderer:
    """Draws this clip's person in this clip's room."""
    body = space.load("high", known.shape)
    nearest_m = clip.distance_m - (clip.action.walk_m if clip.action.kind == "walk" else 0.0)
    farthest_m = clip.distance_m
    if clip.action.kind == "captured":
        away_m = known.transforms[:, 0, 2, 3]
        nearest_m, farthest_m = away_m.min(), away_m.max()
    studio = replace(
        ROOMS[clip.room],
        wall_m=max(farthest_m + 1.1, 3.5),
        shadow_m=3.2 + farthest_m - nearest_m,
        shadow_depth_m=0.5 * (farthest_m + nearest_m),
        noise=NOISE,
    )
    clothes = Clothes.of(Body.load("high"), PEOPLE[clip.person].outfit)
    return Renderer(body, Camera(above_floor_m=clip.camera_m), studio, clothes)


def _frame_count(clip: Clip) -> int:
    return round(duration_s(clip.action, clip.seed) * FRAMES_PER_S)


def _is_made(folder: Path, clip: Clip) -> bool:
    if not folder.exists():
        return False
    if read_truth(folder).description != _description(clip):
        raise Sd2Error(
            f"{folder} is another clip of this name",
            "the clip that this version makes, or nothing",
            "Delete it, or choose another folder",
        )
    return True


def _fill(folder: Path, clip: Clip, motions: Path | None, progress: Progress) -> None:
    space = ShapeSpace()
    known = scene(clip, space, motions)
    camera = known.camera
    pictures = renderer(clip, space, known).frames(
        known.mesh(space, "high"), 1000 * clip.seed, progress
    )
    write_video(folder / "video.mp4", pictures, FRAMES_PER_S, (camera.width, camera.height))
    write_compact_mesh(known.mesh(space, RESOLUTION), folder / "mesh.zarr")
    truth = {
        "format": FORMAT,
        "version": VERSION,
        "simulated": True,
        "clip": _description(clip),
        "camera": asdict(camera),
        "stature_m": known.shape.stature_m,
        "spans": [span.model_dump() for span in known.spans],
    }
    (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", "utf-8")


def _description(clip: Clip) -> Any:
    """The clip as JSON gives it back."""
    return json.loads(json.dumps(asdict(clip)))
