"""MARS-like files of a person whose movement is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sd2core.body.rig import KeypointSpace
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.body.track import LANDMARKS
from sd2core.io.radar.mars import JOINTS

SPACE = ShapeSpace()
_SIDES = {"L": "Left", "R": "Right"}
_NAMES = {"index": "HandTip", "foot_index": "Foot"}


def joints_of(landmarks_m: np.ndarray) -> np.ndarray:
    """The Kinect's joints of a body's landmarks (T, 33, 3): (T, 25, 3)."""
    joints = np.repeat(landmarks_m[:, [11, 12, 23, 24]].mean(axis=1)[:, None], 25, axis=1)
    for row, landmark in enumerate(LANDMARKS):
        name, _, side = landmark.partition(".")
        joint = _NAMES.get(name, name.capitalize()) + _SIDES.get(side, "")
        if joint in JOINTS:
            joints[:, JOINTS.index(joint)] = landmarks_m[:, row]
    ears = [LANDMARKS.index("ear.L"), LANDMARKS.index("ear.R")]
    joints[:, JOINTS.index("Head")] = landmarks_m[:, ears].mean(axis=1)
    return joints


def standing(shape: BodyShape, place_m: np.ndarray) -> np.ndarray:
    """Joints of a person at rest at places (T, 3) of their feet: (T, 25, 3)."""
    rest = KeypointSpace(SPACE).of(shape).rest_m
    return joints_of(rest + place_m[:, None])


def approaching(frames: int, speed_mps: float, start_m: float = 3.0) -> np.ndarray:
    """Joints of somebody who comes nearer, ten frames a second."""
    place = np.zeros((frames, 3))
    place[:, 1] = 0.9
    place[:, 2] = start_m - speed_mps * np.arange(frames) / 10.0
    return standing(BodyShape(np.zeros(len(SPACE)), 1.75), place)


def write_part(
    folder: Path,
    part: str,
    joints_m: np.ndarray,
    frames: np.ndarray,
    points: list[tuple[int, float, float]],
) -> None:
    """Write joints (n, 25, 3) of the camera frame, and points (frame, receding m/s, intensity)."""
    folder.mkdir(exist_ok=True)
    heading = [f"{joint}_{axis}" for axis in "XYZ" for joint in JOINTS]
    right, down, ahead = np.moveaxis(joints_m, 2, 0)
    table = np.concatenate([right, ahead, -down], axis=1)
    lines = [",".join(heading), *(",".join(f"{value:.9g}" for value in row) for row in table)]
    (folder / f"kinect_data_{part}.csv").write_text("\n".join(lines) + "\n")
    lines = ["Frame #,# Obj,X,Y,Z,Doppler,Intensity,Abs Time"]
    lines += [f"{frame},9,0,2,0,{speed:.9g},{power:g},1.6e9" for frame, speed, power in points]
    (folder / f"radar_data_{part}.csv").write_text("\n".join(lines) + "\n")
    assert {frame for frame, _, _ in points} == set(frames.tolist())
