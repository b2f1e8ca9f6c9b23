"""A body fitted to the landmarks of a clip: shape once, pose in every frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sd2core.body.array_store import ArrayStore
from sd2core.body.camera import PinholeCamera
from sd2core.body.evidence import Evidence, evidence_of, joined, sight_of, trust_of
from sd2core.body.fit_windows import Windows
from sd2core.body.fitted import BodyFit, FittedMotion, mean_over_limbs
from sd2core.body.initial import Pose, initial_pose
from sd2core.body.lifter import LiftedTrack, Lifter
from sd2core.body.limbs import LIMBS
from sd2core.body.rig import KeypointSpace, Rig
from sd2core.body.rotations import Floats
from sd2core.body.shape import DEFAULT_STATURE_M, BodyShape, ShapeSpace, check_stature
from sd2core.body.shaping import shape_of_lengths, shape_of_outlines
from sd2core.body.solve import ROUNDS, solve, solve_stills
from sd2core.body.track import LANDMARKS, PART_FRAMES, LandmarkTrack, parts
from sd2core.errors import Sd2Error
from sd2core.progress import Progress, silent

_SEEN = 0.5
"""Sight from which on a landmark counts as seen."""

_FINISHED_FRAMES = 600
_MASK_SURE = 128
_OUTLINES = 8

_ACROSS_PER_S = 3.9
"""Error of a fit's velocity across the view per error of a landmark there (docs/decisions/0022)."""


def fit_motion(
    track: LandmarkTrack,
    camera: PinholeCamera,
    *,
    stature_m: float | None = None,
    workspace: Path | None = None,
    progress: Progress = silent,
) -> FittedMotion:
    """Fit a body to a clip of any length.

    Parameters
    ----------
    stature_m : float, optional
        The person's height, which fixes the scale; :data:`DEFAULT_STATURE_M` without.
    workspace : Path, optional
        Existing folder in which finished stretches are kept, so that a stopped fit goes on there.
    progress : Progress
        Counts steps of the solver, at most.

    Raises
    ------
    Sd2Error
        If the height is none of a person, or no frame shows one.
    """
    fitting = Fitting(track, camera, stature_m, None, workspace)
    along_mps, across_mps = np.zeros((2, len(track), len(LIMBS)), np.float32)
    done, seen = 0, np.zeros(len(LANDMARKS))
    residual_m = quality = 0.0
    for part in fitting.finished(progress):
        frames = slice(done, done + len(part))
        along_mps[frames] = mean_over_limbs(part.along_sd_mps)
        across_mps[frames] = mean_over_limbs(part.across_sd_mps)
        seen += np.isfinite(part.residual_m).sum(axis=0)
        residual_m += float(np.nansum(part.residual_m))
        quality += float(part.quality[part.present].sum())
        done = frames.stop
    return FittedMotion(
        timebase=track.timebase,
        shape=part.shape,
        pose=fitting.windows.pose(),
        present=track.present,
        along_sd_mps=along_mps,
        across_sd_mps=across_mps,
        seen=seen / int(track.present.sum()),
        residual_m=residual_m / max(seen.sum(), 1.0),
        quality=quality / int(track.present.sum()),
    )


class Fitting:
    """Fit of one clip, window by window."""

    def __init__(
        self,
        track: LandmarkTrack,
        camera: PinholeCamera,
        stature_m: float | None,
        lifted: LiftedTrack | None,
        workspace: Path | None,
    ) -> None:
        stature_m = DEFAULT_STATURE_M if stature_m is None else stature_m
        check_stature(stature_m)
        if not track.present.any():
            raise Sd2Error("No frame of the video shows a person", "at least one")
        self._track, self._camera, self._stature_m = track, camera, stature_m
        self._lifter, self._lifted = Lifter.load(), lifted
        self.windows = Windows(track.present, ArrayStore(workspace))

    def finished(self, progress: Progress) -> Iterator[BodyFit]:
        """Fits of successive stretches, once the pose of all is known."""
        spans = self.windows.spans
        looked = sum(1 for _ in parts(len(self._track)))
        total = looked + len(spans) * ROUNDS
        if self._lifted is None:

            def looking(frames: int, of: int) -> None:
                progress(looked * frames // of, total)

            self._lifted = self._lifter.lift(self._track, self._camera, looking)
        space = ShapeSpace()
        keypoints = KeypointSpace(space)
        shape = self._shape(space, keypoints)
        rig = keypoints.rig(shape)
        for number in range(len(spans)):
            progress(looked + number * ROUNDS, total)

            def tick(rounds: int, number: int = number) -> None:
                progress(looked + number * ROUNDS + rounds, total)

            self._solve(rig, number, tick)
        pose = self.windows.pose()
        for first, last in pairwise([0, *(start for start, *_ in spans[1:]), len(self._track)]):
            for start in range(first, last, _FINISHED_FRAMES):
                yield self._finished(rig, shape, pose, start, min(start + _FINISHED_FRAMES, last))
        progress(total, total)

    def _part(self, start: int, stop: int) -> tuple[Evidence, LandmarkTrack, LiftedTrack]:
        """Evidence of frames ``start`` to ``stop``, with its track and lifted track."""
        assert self._lifted is not None
        track, lifted = self._track.part(start, stop), self._lifted.part(start, stop)
        return evidence_of(track, lifted, self._camera, self._stature_m), track, lifted

    def _chosen(self, frames: NDArray[np.intp]) -> tuple[Evidence, Floats]:
        """Evidence of some frames (ascending), and the trust in their landmarks (n, 33)."""
        pieces, trust = [], []
        for start, stop in parts(len(self._track)):
            rows = frames[(frames >= start) & (frames < stop)] - start
            if len(rows):
                evidence, track, _ = self._part(start, stop)
                pieces.append(evidence[rows])
                trust.append(trust_of(track)[rows])
        return joined(pieces), np.concatenate(trust)

    def _solve(self, rig: Rig, number: int, tick: Callable[[int], None]) -> None:
        start, stop, _ = self.windows.spans[number]
        part, track, _ = self._part(start, stop)
        if self.windows.resumed(part):
            return
        first = initial_pose(rig, part.points_m, trust_of(track))
        self.windows.keep(part, solve(rig, part, first, tick))

    def _shape(self, space: ShapeSpace, keypoints: KeypointSpace) -> BodyShape:
        """Bone lengths from evenly chosen frames, then girth from those with outlines."""
        track = self._track
        present = track.present & ~track.bridged
        present = present if present.any() else track.present
        outlined = _outlined(track, present)
        outlined_frames = track.silhouette_frames[outlined]
        frames = _thinned(np.flatnonzero(present), PART_FRAMES)
        known = np.union1d(frames, outlined_frames)
        evidence, trust = self._chosen(known)
        rows = np.searchsorted(known, frames)
        shape, spread = shape_of_lengths(
            space, keypoints, evidence[rows].points_m, trust[rows], self._stature_m
        )
        if not len(outlined):
            return shape
        rig = keypoints.rig(shape)
        rows = np.searchsorted(known, outlined_frames)
        stills = evidence[rows]
        pose = solve_stills(rig, stills, initial_pose(rig, stills.points_m, trust[rows]))
        root = rig.skeleton.heads_m[0]
        rotations = rig.body_rotations(pose.turns)

        def transforms_of(other: BodyShape) -> Floats:
            changed = space.skeleton(other)
            # The pelvis stays where it is when the legs grow.
            return changed.transforms(rotations, pose.translation_m + root - changed.heads_m[0])

        outlines = [mask >= _MASK_SURE for mask in track.silhouettes[outlined]]
        return shape_of_outlines(space, shape, spread, transforms_of, self._camera, outlines)

    def _finished(self, rig: Rig, shape: BodyShape, whole: Pose, start: int, stop: int) -> BodyFit:
        evidence, track, lifted = self._part(start, stop)
        before = min(start, 1)
        frames = slice(start - before, stop)
        pose = whole.at(frames)
        keypoints_m = rig.keypoints.positions(rig.transforms(*pose))
        fast_mps = speed_mps(keypoints_m, self._track.timebase.times_s[frames])[before:]
        pose, keypoints_m = pose.at(slice(before, None)), keypoints_m[before:]
        # A landmark lies on its ray; how far the trunk is, is the fit's own finding.
        trunk_m = keypoints_m[:, evidence.trunk, 2].mean(axis=1)
        seen_m = replace(evidence, trunk_m=trunk_m).points_m
        residual_m = np.linalg.norm(keypoints_m - seen_m, axis=-1)
        residual_m[~track.present[:, None] | (sight_of(track) < _SEEN)] = np.nan
        along_sd_mps = self._lifter.fit_sigma_mps(shape.stature_m * lifted.velocity_sigma, fast_mps)
        return BodyFit(
            timebase=track.timebase,
            shape=shape,
            turns=pose.turns,
            translation_m=pose.translation_m,
            present=track.present,
            keypoints_m=keypoints_m,
            residual_m=residual_m,
            along_sd_mps=_masked(along_sd_mps, track.present),
            across_sd_mps=_masked(
                _ACROSS_PER_S * lifted.across_sigma * keypoints_m[..., 2], track.present
            ),
        )


def _outlined(track: LandmarkTrack, present: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Numbers of the outlines that the girth is taken from, evenly spread."""
    seen = (track.silhouettes >= _MASK_SURE).any(axis=(1, 2))
    return _thinned(np.flatnonzero(present[track.silhouette_frames] & seen), _OUTLINES)


def _thinned(rows: NDArray[np.intp], most: int) -> NDArray[np.intp]:
    """At most so many of the rows, evenly spread."""
    if not len(rows):
        return rows
    return rows[np.linspace(0, len(rows) - 1, min(most, len(rows))).astype(int)]


def speed_mps(points_m: Floats, times_s: Floats) -> Floats:
    """Speed (T, N) of points (T, N, 3) since the frame before; 0 of the first."""
    moved_m = np.linalg.norm(np.diff(points_m, axis=0, prepend=points_m[:1]), axis=-1)
    return np.asarray(moved_m / np.diff(times_s, prepend=times_s[0] - 1.0)[:, None])


def _masked(values: Floats, present: NDArray[np.bool_]) -> Floats:
    return np.where(present[:, None], values, 0.0)
