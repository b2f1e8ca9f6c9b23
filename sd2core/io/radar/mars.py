"""The MARS recordings: a Kinect skeleton and a radar's points of the same movements.

S. An and U. Y. Ogras, "MARS: mmWave-based assistive rehabilitation system for smart
healthcare", ACM TECS 20(5s), 2021. A folder holds one person in one or more parts::

    kinect_data_PART.csv    25 joints per row: JOINT_X, JOINT_Y (depth), JOINT_Z (height)
    radar_data_PART.csv     one row per point: Frame #, Doppler, Intensity and more

Kinect row k belongs to the k-th frame number in the radar's file. A frame in which the
radar detected nothing is in neither: its number is left out. Numbers that jump far
separate one movement from the next. Doppler is positive when receding, and turned here.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.io.radar.point_tables import TextTable
from sd2core.io.radar.points import LONGEST_GAP_FRAMES

JOINTS = (
    "SpineBase",
    "SpineMid",
    "Neck",
    "Head",
    "ShoulderLeft",
    "ElbowLeft",
    "WristLeft",
    "HandLeft",
    "ShoulderRight",
    "ElbowRight",
    "WristRight",
    "HandRight",
    "HipLeft",
    "KneeLeft",
    "AnkleLeft",
    "FootLeft",
    "HipRight",
    "KneeRight",
    "AnkleRight",
    "FootRight",
    "SpineShoulder",
    "HandTipLeft",
    "ThumbLeft",
    "HandTipRight",
    "ThumbRight",
)
"""The Kinect's joints; left and right are the person's own."""

FRAMES_PER_S = 10.0
"""Frame rate of the radar; the files' own times are too coarse."""
DOPPLER_STEP_MPS = 0.356
"""Velocities of points are multiples of it: the radar's resolution."""

_FARTHEST_M = 100.0
_FRAME, _DOPPLER, _INTENSITY = "Frame #", "Doppler", "Intensity"
_KINECT, _RADAR = "kinect_data_{}.csv", "radar_data_{}.csv"


@dataclass(frozen=True, eq=False)
class MarsStretch:
    """One uninterrupted stretch: n rows, in which the radar detected something."""

    frames: NDArray[np.int64]  # (n,) radar's frame number from the first; gaps: no points
    joints_m: NDArray[np.float64]  # (n, 25, 3) JOINTS in the camera frame, radar at the origin
    point_rows: NDArray[np.intp]  # (P,) row of each of the radar's points; ascending
    point_mps: NDArray[np.float64]  # (P,) radial velocity, positive when approaching
    point_intensity: NDArray[np.float64]  # (P,)

    @property
    def frame_count(self) -> int:
        """Number of frames, those without points included."""
        return int(self.frames[-1]) + 1

    @property
    def times_s(self) -> NDArray[np.float64]:
        """Time of every row from the first, (n,)."""
        return self.frames / FRAMES_PER_S

    def mean_velocity_mps(self) -> NDArray[np.float64]:
        """Intensity-weighted mean velocity of the radar's points in every row, (n,)."""
        rows = len(self.frames)
        moment = np.bincount(self.point_rows, self.point_intensity * self.point_mps, rows)
        return np.asarray(moment / np.bincount(self.point_rows, self.point_intensity, rows))


@dataclass(frozen=True, eq=False)
class MarsPart:
    """One part of one person's recording."""

    subject: str  # "1" for a folder mars_subject1
    name: str  # "test" for kinect_data_test.csv
    stretches: tuple[MarsStretch, ...]
    source: str  # the folder, for provenance


def mars_parts(folder: Path | str) -> tuple[str, ...]:
    """Names of the parts in a folder, sorted; Sd2Error if there is none, or half of one."""
    folder = Path(folder)
    wanted = f"a folder with {_KINECT.format('PART')} and {_RADAR.format('PART')}"
    if not folder.is_dir():
        raise Sd2Error(f"There is no folder {folder}", wanted, "Check the path")
    kinect, radar = (
        {path.name[len(start) : -len(".csv")] for path in folder.glob(f"{start}*.csv")}
        for start in (_KINECT.partition("{")[0], _RADAR.partition("{")[0])
    )
    if not kinect and not radar:
        raise Sd2Error(f"{folder} holds no MARS recording", wanted)
    for name in sorted(kinect ^ radar):
        present, missing = (_KINECT, _RADAR) if name in kinect else (_RADAR, _KINECT)
        raise Sd2Error(
            f"{folder} holds {present.format(name)} and no {missing.format(name)}", "both files"
        )
    return tuple(sorted(kinect))


def read_mars(folder: Path | str, part: str) -> MarsPart:
    """Read one part.

    Raises Sd2Error if a file is missing or empty, lacks a column, holds what is not a finite
    number, or if the two files do not match.
    """
    folder = Path(folder)
    if part not in (names := mars_parts(folder)):
        raise Sd2Error(f"{folder} has no part {part!r}", f"one of {', '.join(names)}")
    kinect, radar = folder / _KINECT.format(part), folder / _RADAR.format(part)
    joints = _joints(kinect)
    points = _columns(radar, (_FRAME, _DOPPLER, _INTENSITY))
    numbers, first, rows = np.unique(points[:, 0], return_index=True, return_inverse=True)
    if (np.diff(rows) < 0).any():
        late = int(np.flatnonzero(np.diff(rows) < 0)[0]) + 1
        raise Sd2Error(
            f"{radar}: frame {points[late, 0]:g} comes after frame {points[late - 1, 0]:g}",
            "frame numbers that ascend",
        )
    if (numbers != np.round(numbers)).any():
        raise Sd2Error(f"{radar}: {_FRAME} {numbers[numbers % 1 != 0][0]:g}", "whole numbers")
    if len(numbers) != len(joints):
        raise Sd2Error(
            f"{kinect.name} has {len(joints)} rows, {radar.name} {len(numbers)} frames ({folder})",
            "one row of joints for every frame of the radar",
            "Take both files from the same part of the same recording",
        )
    if not (points[:, 2] > 0).all():
        bad = int(np.flatnonzero(points[:, 2] <= 0)[0])
        raise Sd2Error(
            f"{radar}: the intensity of point {bad + 1} is {points[bad, 2]:g}", "more than 0"
        )
    cuts = np.flatnonzero(np.diff(numbers) > LONGEST_GAP_FRAMES) + 1
    edges = [0, *cuts.tolist(), len(numbers)]
    starts = np.append(first, len(points))
    stretches = []
    for begin, end in pairwise(edges):
        inside = slice(starts[begin], starts[end])
        stretches.append(
            MarsStretch(
                frames=(numbers[begin:end] - numbers[begin]).astype(np.int64),
                joints_m=joints[begin:end],
                point_rows=rows[inside] - begin,
                point_mps=-points[inside, 1],
                point_intensity=points[inside, 2],
            )
        )
    # The person's number, where the folder's name ends in one.
    name = folder.resolve().name
    number = re.search(r"(\d+)$", name)
    return MarsPart(number[1] if number else name, part, tuple(stretches), str(folder))


def _joints(path: Path) -> NDArray[np.float64]:
    """Joints in the camera frame, (n, 25, 3)."""
    names = [f"{joint}_{axis}" for axis in "XYZ" for joint in JOINTS]
    table = _columns(path, names).reshape(-1, 3, len(JOINTS))
    right, depth, height = np.moveaxis(table, 1, 0)
    far = np.abs(table).max(axis=(1, 2)) > _FARTHEST_M
    if far.any():
        row = int(np.flatnonzero(far)[0])
        raise Sd2Error(
            f"{path}: a joint of row {row + 1} is at {np.abs(table[row]).max():g} m",
            f"metres, up to {_FARTHEST_M:g}",
        )
    return np.stack([right, -height, depth], axis=-1)


def _columns(path: Path, names: tuple[str, ...] | list[str]) -> NDArray[np.float64]:
    """Some columns of a file of numbers under a heading, (n, len(names))."""
    table = TextTable(path)
    missing = [name for name in names if name not in table.names]
    if missing:
        more = f" and {len(missing) - 3} more" if len(missing) > 3 else ""
        raise Sd2Error(
            f"{path} has no column {', '.join(missing[:3])}{more}",
            "the columns of the MARS recordings",
        )
    values = np.stack(table.read(tuple(map(table.names.index, names))), axis=1)
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0]
        raise Sd2Error(
            f"{path}: {names[column]} of row {row + 1} is {values[row, column]}", "a finite number"
        )
    return values
