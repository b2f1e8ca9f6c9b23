"""Bodies in the motion of real people: driven once, kept in a folder, posed on any shape."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sd2core.body.rotations import applied, product, to_vector
from sd2core.errors import Sd2Error
from sd2core.mocap.body_motion import BodyMotion
from sd2core.mocap.driving import SkeletonClip, puppet_of, resample_pose
from sd2core.processes import end_with_parent
from sd2core.progress import Progress, silent
from tools.motion_capture.catalogue import RATE_HZ, Trial, trials
from tools.motion_capture.points import MARKERS

Floats = NDArray[np.float64]

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
            trial.what,
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
