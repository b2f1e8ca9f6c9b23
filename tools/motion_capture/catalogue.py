"""The trials of motion capture: who, what, where, and what each is used for.

The folder is that of ``data/motion`` (its README gives sources and licences). Persons, not trials,
are divided into those learnt from, those that calibrate what the lifter says of its errors, and
those that only measure.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sd2core.body.rotations import applied, product, to_vector
from sd2core.errors import Sd2Error
from sd2core.mocap.body_motion import RATE_HZ, BodyMotion, Role
from sd2core.mocap.driving import SkeletonClip, puppet_of, resample_pose
from sd2core.processes import end_with_parent
from sd2core.progress import Progress, silent
from tools.motion_capture.skeletons import (
    CMU_ASF,
    HAHNE_BVH,
    KOYAMA_BVH,
    MARKERS,
    POSER_BVH,
    USED_MARKERS,
    points_of,
    points_of_markers,
    read_amc,
    read_bvh,
)

Floats = NDArray[np.float64]
MEASURED = frozenset({"cmu02", "cmu08", "cmu09", "cmu12", "cmu49", "ui09", "ui10"})
"""Persons that nothing is learnt from or tuned on."""

CALIBRATED = frozenset({"cmu17", "cmu32", "cmu131", "ui08", "indian"})
"""Persons whose errors calibrate the stated ones."""

_HAHNE_M, _POSER_M = 0.056444, 0.01
_NO_PERSON = frozenset({"127_01"})  # a motorcycle
_MISSING = -32768
_UI_RATE_HZ = 33.0
_REPETITIONS = frozenset({"e02", "e05", "e08"})
"""Of ten that are much alike."""


@dataclass(frozen=True)
class Trial:
    """One recording of one person."""

    name: str
    person: str
    path: Path
    skeleton: Path | None = None  # of an AMC file
    episode: int | None = None  # of a file of UI-PRMD

    @property
    def role(self) -> Role:
        """What the trial may be used for."""
        if self.person in MEASURED:
            return "measure"
        return "calibrate" if self.person in CALIBRATED else "learn"

    def points(self) -> tuple[Floats, float]:
        """The points (T, 20, 3), y up, in metres, and frames per second; Sd2Error if unreadable."""
        if self.episode is not None:
            return _ui_points(self.path, self.episode), _UI_RATE_HZ
        if self.skeleton is not None:
            return points_of(read_amc(self.path, self.skeleton), CMU_ASF), RATE_HZ
        converter = self.path.name.partition("_")[0]
        names = {"francisco": HAHNE_BVH, "yukikoyama": KOYAMA_BVH}.get(converter, POSER_BVH)
        unit_m = _POSER_M if names is POSER_BVH else _HAHNE_M
        motion, rate_hz = read_bvh(self.path, unit_m)
        # The first frame is a pose of the conversion's own.
        return points_of(motion, names)[1:], rate_hz


def trials(folder: Path) -> list[Trial]:
    """All trials of a folder, each motion once, by name; not those without a skeleton (subject 13).

    Raises Sd2Error if the folder is not one of motion capture.
    """
    by_name: dict[str, Trial] = {}
    for path in sorted((folder / "cmu_amc").glob("*.amc.gz")):
        stem = path.name.partition(".")[0]
        trial, dash, variant = stem.partition("-")  # 07_05-walk is trial 07_05 on 07-walk.asf
        subject = trial.partition("_")[0]
        skeleton = path.parent / f"{subject}{dash}{variant}.asf.gz"
        if skeleton.exists() and trial not in _NO_PERSON:
            by_name[trial] = Trial(trial, f"cmu{subject}", path, skeleton=skeleton)
    for path in sorted((folder / "cmu_bvh").glob("*.bvh.gz")):
        converter, _, trial = path.name.partition(".")[0].partition("_")
        person = trial.partition("_")[0]
        if converter != "dance":
            person = f"cmu{person}"
        if trial not in by_name:
            by_name[trial] = Trial(trial, person, path)
    for path in sorted((folder / "uiprmd").glob("m??_ok.npz")):
        with np.load(path) as data:
            names = [str(name) for name in data["names"]]
        for episode, name in enumerate(names):
            if name[-3:] in _REPETITIONS:
                trial = f"ui_{path.name[:3]}_{name}"
                by_name[trial] = Trial(trial, f"ui{name[1:3]}", path, episode=episode)
    if not by_name:
        raise Sd2Error(
            f"{folder} holds no motion capture", "a folder with cmu_amc/, cmu_bvh/ or uiprmd/"
        )
    return [by_name[name] for name in sorted(by_name)]


def _ui_points(path: Path, episode: int) -> Floats:
    """Points of one episode; single lost markers are bridged in a straight line."""
    with np.load(path) as data:
        start, stop = data["start"][episode : episode + 2]
        raw, centre_mm = data["pos"][start:stop], data["center_mm"][episode]
    markers_m = 1e-3 * (0.1 * raw.astype(np.float64) + centre_mm)
    lost = (raw == _MISSING).any(axis=2)
    frames = np.arange(len(raw))
    for marker in np.flatnonzero(lost.any(axis=0)):
        known = ~lost[:, marker]
        if marker not in USED_MARKERS:
            continue
        if not known.any():
            raise Sd2Error(f"{path}: marker {marker} of episode {episode} is never seen")
        for axis in range(3):
            column = markers_m[:, marker, axis]
            column[~known] = np.interp(frames[~known], frames[known], column[known])
    return points_of_markers(markers_m)


_GLITCH_MPS = 18.0
_MIN_S = 1.0
_MAX_S = 20.0
"""Of one recording; what follows is much alike."""
_NEAR_M = 4.0


def drive_bodies(
    source: Path, out: Path, processes: int = 2, progress: Progress = silent
) -> list[str]:
    """Drive a body by every trial of a folder that is not in ``out`` yet.

    All trials of one person drive one body. Returns what was left out, and why.
    """
    out.mkdir(parents=True, exist_ok=True)
    people: dict[str, list[Trial]] = defaultdict(list)
    for trial in trials(source):
        people[trial.person].append(trial)
    jobs = [one for one in people.values() if any(not path_of(out, t).exists() for t in one)]
    jobs.sort(key=len)
    total, done = sum(len(one) for one in jobs), 0
    notes: list[str] = []
    progress(0, total)
    with ProcessPoolExecutor(processes, get_context("spawn"), end_with_parent) as pool:
        for own, left_out in zip(jobs, pool.map(partial(_drive, out), jobs), strict=True):
            notes += left_out
            done += len(own)
            progress(done, total)
    return sorted(notes)


def path_of(out: Path, trial: Trial) -> Path:
    """Path of one trial's body."""
    return out / f"{trial.name}.npz"


def _drive(out: Path, own: Sequence[Trial]) -> list[str]:
    """Bodies of one person's trials."""
    notes: list[str] = []
    clips: dict[Trial, tuple[SkeletonClip, Floats]] = {}
    for trial in own:
        try:
            points_m, rate_hz = trial.points()
        except Sd2Error as error:
            notes.append(f"{trial.name}: {error}")
            continue
        shifted_clip = _clip(points_m, rate_hz)
        if shifted_clip is None:
            notes.append(f"{trial.name}: shorter than {_MIN_S} s without a jump")
        else:
            clips[trial] = shifted_clip
    if all(path_of(out, trial).exists() for trial in clips):
        return notes
    puppet = puppet_of([clip for clip, _ in clips.values()], MARKERS)
    for trial, (clip, shift_m) in clips.items():
        driven = puppet.pose(clip)
        times_s = np.arange(clip.times_s[0], clip.times_s[-1], 1.0 / RATE_HZ)
        pose = resample_pose(driven.pose, clip.times_s, times_s)
        motion = BodyMotion(
            trial.name,
            trial.person,
            trial.role,
            puppet.shape,
            to_vector(pose.turns),
            pose.translation_m - shift_m,
            float(np.nanmean(driven.residual_m)),
        )
        motion.save(path_of(out, trial))
    return notes


def _clip(points_m: Floats, rate_hz: float) -> tuple[SkeletonClip, Floats] | None:
    """The longest stretch without a jump, before a camera, and how far it was moved there.

    None if that is too short.
    """
    turned = points_m * np.array([1.0, -1.0, -1.0])
    fast = np.linalg.norm(np.diff(turned, axis=0), axis=-1).max(axis=1) * rate_hz > _GLITCH_MPS
    edges = np.concatenate([[0], np.flatnonzero(fast) + 1, [len(turned)]])
    longest = int(np.argmax(np.diff(edges)))
    start, stop = edges[longest : longest + 2]
    if stop - start < _MIN_S * rate_hz:
        return None
    kept = turned[start : min(stop, start + round(_MAX_S * rate_hz))]
    shift_m = np.array([0.0, 0.0, _NEAR_M - kept[..., 2].min()])
    return SkeletonClip(np.arange(len(kept)) / rate_hz, kept + shift_m), shift_m


def moved_transforms(transforms: Floats, turn: Floats, shift_m: Floats) -> Floats:
    """Transforms of bones (T, B, 3, 4) that are then turned (3, 3) and shifted (3,) as a whole."""
    moved = np.empty_like(transforms)
    moved[..., :3] = product(turn, transforms[..., :3])
    moved[..., 3] = applied(turn, transforms[..., 3]) + shift_m
    return moved
