"""A body fitted to the landmarks of a clip: shape once, pose in every frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sd2core.body.camera import PinholeCamera
from sd2core.body.evidence import Evidence, evidence_of
from sd2core.body.fitted import BodyFit
from sd2core.body.initial import Pose, initial_pose
from sd2core.body.keypoints import KeypointSpace
from sd2core.body.landmark_files import read_arrays, write_arrays
from sd2core.body.leaning import with_leaning_arms
from sd2core.body.lifted import LiftedTrack
from sd2core.body.lifter import Lifter
from sd2core.body.rig import JOINTS, Rig
from sd2core.body.rotations import Floats, from_vector, to_vector, transposed
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.body.shaping import shape_of_lengths, shape_of_outlines
from sd2core.body.solve import ROUNDS, solve, solve_stills
from sd2core.body.track import LandmarkTrack
from sd2core.errors import Sd2Error
from sd2core.presence import runs
from sd2core.progress import Progress, silent

Lift = Callable[[LandmarkTrack, PinholeCamera], LiftedTrack]

DEFAULT_STATURE_M = 1.72
"""Where nobody says how tall the person is; distances and speeds scale with it."""

STATURES_M = (0.5, 2.6)

_WINDOW_FRAMES = 600
_OVERLAP_FRAMES = 60
_MASK_SURE = 128
_OUTLINES = 16
_TOLD_BY = ("slopes", "depth_m", "trunk_m")
"""What tells that a kept window was fitted to the same evidence."""

# Measured on simulated people (docs/decisions/0022): what the lifter says of its
# velocities, and the fit's error across the view per error of a landmark there.
_ALONG = 0.22
_ACROSS_PER_S = 3.0

_UNSEEN_MPS = 0.3
"""What a limb may do that the picture cuts off or something hides; a guess, not measured."""


def fit_body(
    track: LandmarkTrack,
    camera: PinholeCamera,
    *,
    stature_m: float | None = None,
    lift: Lift | None = None,
    workspace: Path | None = None,
    progress: Progress = silent,
) -> BodyFit:
    """Fit a body to landmarks.

    Parameters
    ----------
    track : LandmarkTrack
    camera : PinholeCamera
    stature_m : float, optional
        The person's height, which fixes the scale; :data:`DEFAULT_STATURE_M` without.
    lift : callable, optional
        Gives the landmarks their depth: the bundled lifter, where not given.
    workspace : Path, optional
        An existing folder where finished stretches are kept, so that a stopped fit
        goes on there.
    progress : Progress
        Counts steps of the solver, at most.

    Returns
    -------
    BodyFit

    Raises
    ------
    Sd2Error
        When the height is none of a person, or no frame shows one.
    """
    stature_m = DEFAULT_STATURE_M if stature_m is None else stature_m
    if not STATURES_M[0] <= stature_m <= STATURES_M[1]:
        raise Sd2Error(
            f"a body height of {stature_m} m", f"metres, from {STATURES_M[0]} to {STATURES_M[1]}"
        )
    if not track.present.any():
        raise Sd2Error("No frame of the video shows a person", "at least one")
    lifted = (lift or Lifter.load().lift)(track, camera)
    evidence = evidence_of(track, lifted, camera, stature_m)
    trust = track.visibility.astype(np.float64)
    people = _People()
    shape = _shape(people, track, evidence, trust, camera, stature_m)
    rig = people.rig(shape)
    windows = [window for stretch in runs(track.present) for window in _windows(*stretch)]
    total = len(windows) * ROUNDS
    pose = Pose(np.tile(np.eye(3), (len(track), len(JOINTS), 1, 1)), np.zeros((len(track), 3)))
    for number, (start, stop, overlap) in enumerate(windows):
        progress(number * ROUNDS, total)
        part = evidence[slice(start, stop)]

        def tick(done: int, number: int = number) -> None:
            progress(number * ROUNDS + done, total)

        found = _kept(workspace, number, part)
        if found is None:
            leaning = with_leaning_arms(part, rig)
            first = initial_pose(rig, leaning.points_m, trust[start:stop])
            found = solve(rig, leaning, first, tick)
            _keep(workspace, number, part, found)
        _blend(pose, found, start, overlap)
    progress(total, total)
    return _finished(track, lifted, evidence, rig, shape, pose)


class _People:
    """Rigs of bodies of any shape."""

    def __init__(self) -> None:
        self.space = ShapeSpace()
        self.keypoints = KeypointSpace(self.space)

    def rig(self, shape: BodyShape) -> Rig:
        return Rig(self.space.skeleton(shape), self.keypoints.of(shape))


def _windows(start: int, stop: int) -> Iterator[tuple[int, int, int]]:
    """Windows (start, stop, frames shared with the one before) of one stretch."""
    step = _WINDOW_FRAMES - _OVERLAP_FRAMES
    count = max(-(-(stop - start - _OVERLAP_FRAMES) // step), 1)
    size = -(-(stop - start + (count - 1) * _OVERLAP_FRAMES) // count)
    for number in range(count):
        first = start + number * (size - _OVERLAP_FRAMES)
        yield first, min(first + size, stop), _OVERLAP_FRAMES if number else 0


def _shape(
    people: _People,
    track: LandmarkTrack,
    evidence: Evidence,
    trust: Floats,
    camera: PinholeCamera,
    stature_m: float,
) -> BodyShape:
    """Bone lengths from all frames, then girth from those whose outlines are kept."""
    there = track.present & ~track.bridged
    there = there if there.any() else track.present
    shape, spread = shape_of_lengths(
        people.space,
        people.keypoints,
        evidence[np.flatnonzero(there)].points_m,
        trust[there],
        stature_m,
    )
    seen = (track.silhouettes >= _MASK_SURE).any(axis=(1, 2))
    outlined = np.flatnonzero(there[track.silhouette_frames] & seen)
    outlined = outlined[
        np.linspace(0, len(outlined) - 1, min(_OUTLINES, len(outlined))).astype(int)
    ]
    if not len(outlined):
        return shape
    frames = track.silhouette_frames[outlined]
    rig = people.rig(shape)
    stills = evidence[frames]
    pose = solve_stills(rig, stills, initial_pose(rig, stills.points_m, trust[frames]))
    root = rig.skeleton.heads_m[0]

    def transforms_of(other: BodyShape) -> Floats:
        changed = people.rig(other)
        # The pelvis stays where it is when the legs grow.
        moved = pose.translation_m + root - changed.skeleton.heads_m[0]
        whole = people.space.skeleton(other)
        return whole.transforms(changed.body_rotations(pose.turns), moved)

    outlines = [mask >= _MASK_SURE for mask in track.silhouettes[outlined]]
    return shape_of_outlines(people.space, shape, spread, transforms_of, camera, outlines)


def _blend(pose: Pose, found: Pose, start: int, overlap: int) -> None:
    """Write a window's pose, going over from the one before where they overlap."""
    stop = start + len(found.turns)
    if overlap:
        shared = slice(start, start + overlap)
        share = np.linspace(0.0, 1.0, overlap + 2)[1:-1]
        share = share**3 * (10.0 + share * (6.0 * share - 15.0))  # no kink in velocity
        between = to_vector(transposed(pose.turns[shared]) @ found.turns[:overlap])
        pose.turns[shared] = pose.turns[shared] @ from_vector(share[:, None, None] * between)
        pose.translation_m[shared] += share[:, None] * (
            found.translation_m[:overlap] - pose.translation_m[shared]
        )
    rest = slice(start + overlap, stop)
    pose.turns[rest], pose.translation_m[rest] = (
        found.turns[overlap:],
        found.translation_m[overlap:],
    )


def _finished(
    track: LandmarkTrack,
    lifted: LiftedTrack,
    evidence: Evidence,
    rig: Rig,
    shape: BodyShape,
    pose: Pose,
) -> BodyFit:
    known = np.flatnonzero(track.present)
    frames = np.arange(len(track))
    # Empty frames hold the last known pose, those before it the first.
    held = known[np.clip(np.searchsorted(known, frames, side="right") - 1, 0, None)]
    turns, translation_m = pose.turns[held], pose.translation_m[held]
    keypoints_m = rig.keypoints.positions(rig.transforms(turns, translation_m))
    # A landmark lies on its ray; how far the trunk is, is the fit's own finding.
    trunk_m = keypoints_m[:, evidence.trunk, 2].mean(axis=1)
    residual_m = np.linalg.norm(keypoints_m - replace(evidence, trunk_m=trunk_m).points_m, axis=-1)
    residual_m[~track.present] = np.nan
    unseen = 1.0 - np.clip(track.visibility.astype(np.float64), 0.0, 1.0)
    return BodyFit(
        timebase=track.timebase,
        shape=shape,
        turns=turns,
        translation_m=translation_m,
        present=track.present.copy(),
        keypoints_m=keypoints_m,
        residual_m=residual_m,
        along_sd_mps=_there(
            np.hypot(_ALONG * shape.stature_m * lifted.velocity_sigma, _UNSEEN_MPS * unseen**4),
            track.present,
        ),
        across_sd_mps=_there(
            _ACROSS_PER_S * evidence.slopes_sd * keypoints_m[..., 2], track.present
        ),
    )


def _there(values: Floats, present: NDArray[np.bool_]) -> Floats:
    return np.where(present[:, None], values, 0.0)


def _kept(workspace: Path | None, number: int, part: Evidence) -> Pose | None:
    """A finished window of an earlier run with the same evidence."""
    if workspace is None:
        return None
    try:
        arrays, _ = read_arrays(_window_file(workspace, number))
        if all(np.array_equal(arrays[name], getattr(part, name)) for name in _TOLD_BY):
            return Pose(arrays["turns"], arrays["translation_m"])
    except (Sd2Error, KeyError):
        pass  # Missing or damaged: it is made again.
    return None


def _keep(workspace: Path | None, number: int, part: Evidence, found: Pose) -> None:
    if workspace is not None:
        told = {name: getattr(part, name) for name in _TOLD_BY}
        write_arrays(_window_file(workspace, number), told | found._asdict(), {})


def _window_file(workspace: Path, number: int) -> Path:
    return workspace / f"pose-{number:05d}.npz"
