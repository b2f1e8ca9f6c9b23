"""Scores of a fitted mesh: against a clip of known motion, or the person in a real video."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from sd2core import MeshSequence, Sd2Error, Span, Synthesizer, VirtualSensor
from sd2core.body.camera import PinholeCamera
from sd2core.body.model import Body, own_resolution
from sd2core.body.shaping import overlap, silhouette
from sd2core.body.track import LANDMARKS, LandmarkTrack
from sd2core.compare.joints import JOINTS, JointPatches, own_patches
from sd2core.compare.measures import (
    common_times,
    correlation,
    line_of_sight_velocity,
    map_l1,
    rms,
    synthesize_alike,
)
from sd2core.doppler.body_error import body_error
from sd2core.mesh.presence import Presence
from sd2core.progress import Progress, silent
from sd2core.scattering.resampling import resample_mesh
from sd2core.scattering.velocity import moments
from tools.fitting.truth import Truth

Floats = NDArray[np.float64]

EDGE_FRAMES = 5
"""Frames at each end of a clip that count as its edge."""


LIMBS = ("hand", "elbow")
"""Parts of the moving arm that are measured during strokes."""

_MOVING_MPS = 0.1
"""Root mean square of the true velocity of a joint from which on it moves."""


def peak_kept(values: NDArray[Any], truth: NDArray[Any]) -> float:
    """Largest magnitude of one over that of the other; NaN when the truth has none."""
    peak = float(np.abs(truth).max(initial=0.0))
    return float(np.abs(values).max(initial=0.0)) / peak if peak > 0 else float("nan")


def speed_mps(positions_m: NDArray[Any], times_s: Floats) -> Floats:
    """Magnitude of the velocity, (T, N) for positions (T, N, 3)."""
    stencil = moments(times_s, np.arange(len(times_s)), 1)
    step = positions_m[stencil.after[:, 0]] - positions_m[stencil.before[:, 0]]
    return np.asarray(np.linalg.norm(step, axis=-1) / stencil.duration_s)


def coverage(errors: NDArray[Any], sigma: NDArray[Any]) -> float:
    """Share of errors no larger than their standard deviation (0.683 when it is right)."""
    known = np.isfinite(errors) & np.isfinite(sigma)
    if not known.any():
        return float("nan")
    return float((np.abs(errors[known]) <= sigma[known]).mean())


class Pair(NamedTuple):
    """Fitted and true samples of one quantity, each (n,)."""

    fitted: Floats
    truth: Floats

    @property
    def error(self) -> float:
        """RMS of the difference."""
        return rms(self.fitted - self.truth)

    @property
    def correlation(self) -> float:
        """Pearson's."""
        return correlation(self.fitted, self.truth)

    @property
    def peak_kept(self) -> float:
        """Largest magnitude of the fitted over that of the true."""
        return peak_kept(self.fitted, self.truth)


def pooled(pairs: list[Pair]) -> Pair:
    """Samples of several stretches as one."""
    if not pairs:
        return Pair(np.zeros(0), np.zeros(0))
    return Pair(*(np.concatenate(one) for one in zip(*pairs, strict=True)))


@dataclass(frozen=True, eq=False)
class StrokeScore:
    """One gesture."""

    stroke: Span
    speed: str
    velocity: dict[str, Pair]  # of each of LIMBS, along the line of sight
    tempo: Pair  # the hand's speed in space
    # Sums over the gesture's frames of the absolute difference of the smoothed Doppler maps, and of
    # the true one.
    map_difference: float
    map_total: float


@dataclass(frozen=True, eq=False)
class ClipScore:
    """One clip."""

    name: str
    kind: str
    strokes: tuple[StrokeScore, ...]
    distance_m: Floats  # (J,), mean distance of each joint
    quiet: bool  # true if no joint moves along the line of sight; then all joints count as moving
    velocity: Pair  # of all frames and the joints that move, along the line of sight, each (n,)
    # Of these joints' velocities within a frame, fitted over true (root mean square over frames);
    # NaN of quiet clips.
    spread: float
    # RMS over all vertices and frames of the velocity along the line of sight: for who stands
    # still, all of it is false.
    vertex_velocity_mps: float
    # Of the whole clip: of the fit's expected map, and of the plain one.
    map_l1: float
    plain_l1: float
    stated_l1: float | None  # what the fit's map states of it
    # (2,), RMS error of the first and last frames, and of those between: velocity along the line of
    # sight (m/s), then place (m), of all joints.
    edge: Floats
    middle: Floats
    # ``fitted`` holds standard deviations that the fit gave for the velocities of joints, ``truth``
    # their actual errors, each (n, J); NaN where a joint does not move.
    sigma: Pair | None = None
    seconds_per_frame: float | None = None  # that the fit took
    # Mean distance of joints from the landmarks that were found, in the picture at the joint's
    # depth.
    residual_m: float | None = None


def score_clip(
    truth: Truth,
    fitted: MeshSequence,
    *,
    seconds: float | None = None,
    track: LandmarkTrack | None = None,
    progress: Progress = silent,
) -> ClipScore:
    """Measure one fitted mesh; Sd2Error if its surface is none of ours or at other times.

    Parameters
    ----------
    fitted : MeshSequence
        Of this clip's video, in the camera frame. Where it says how well its velocities are known,
        that is measured too.
    seconds : float, optional
        That the whole fit took.
    track : LandmarkTrack, optional
        The landmarks that were fitted to.
    progress : Progress
        Counts frames of the two Doppler maps.
    """
    true = truth.mesh()
    times_s = common_times([true, fitted])
    pair = [
        _with_vertices_of(resample_mesh(one, times_s)[0], other)
        for one, other in ((true, fitted), (fitted, true))
    ]
    presence = pair[1].presence
    if not presence.measured.any():
        raise Sd2Error(f"{truth.name}: the fitted mesh has no person", "the person of the clip")
    pair = [replace(mesh, present=presence.present) for mesh in pair]
    patches = [_patches(mesh, truth.name) for mesh in pair]
    joints = [
        one.positions(np.asarray(mesh.vertices)) for one, mesh in zip(patches, pair, strict=True)
    ]
    velocity = [line_of_sight_velocity(one, times_s, presence=presence) for one in joints]
    tempo = [speed_mps(one, times_s) for one in joints]
    maps = synthesize_alike(pair, VirtualSensor(), progress, "expected")
    plain = synthesize_alike(pair, VirtualSensor())
    measured = presence.measured
    apart = np.linalg.norm(joints[1] - joints[0], axis=-1)
    strokes = []
    for stroke in truth.strokes:
        during = (times_s >= stroke.start_s) & (times_s < stroke.end_s) & measured
        if not during.any():
            continue
        rows = {limb: JOINTS.index(f"{limb}.{truth.hand}") for limb in LIMBS}
        hand = rows["hand"]
        difference = np.abs(maps[1].values - maps[0].values)[:, during].sum(dtype=np.float64)
        strokes.append(
            StrokeScore(
                stroke,
                truth.speed,
                {k: Pair(velocity[1][during, j], velocity[0][during, j]) for k, j in rows.items()},
                Pair(tempo[1][during, hand], tempo[0][during, hand]),
                float(difference),
                float(maps[0].values[:, during].sum(dtype=np.float64)),
            )
        )
    errors = np.stack([velocity[1] - velocity[0], apart])  # (2, T, J)
    moving = np.sqrt((velocity[0][measured] ** 2).mean(axis=0)) >= _MOVING_MPS
    quiet = not moving.any()
    moving |= quiet
    within = [one[measured][:, moving].var(axis=1).mean() for one in velocity]
    edge = np.zeros(len(times_s), bool)
    edge[:EDGE_FRAMES] = edge[-EDGE_FRAMES:] = True
    return ClipScore(
        name=truth.name,
        kind=truth.kind,
        strokes=tuple(strokes),
        distance_m=apart[measured].mean(axis=0),
        quiet=quiet,
        velocity=Pair(*(one[measured][:, moving].ravel() for one in velocity[::-1])),
        spread=np.nan if quiet else float(np.sqrt(within[1] / within[0])),
        vertex_velocity_mps=_vertex_velocity(pair[1], presence),
        map_l1=map_l1(maps[1], maps[0]),
        plain_l1=map_l1(plain[1], plain[0]),
        stated_l1=body_error(Synthesizer(pair[1]), VirtualSensor()),
        edge=np.array([rms(one[edge & measured]) for one in errors]),
        middle=np.array([rms(one[~edge & measured]) for one in errors]),
        sigma=_sigma(pair[1], patches[1], errors[0], measured[:, None] & moving),
        seconds_per_frame=None if seconds is None else seconds / len(fitted.timebase),
        residual_m=None
        if track is None
        else float(reprojection_m(fitted, track, truth.camera).mean()),
    )


def _patches(mesh: MeshSequence, name: str) -> JointPatches:
    resolution = own_resolution(mesh)
    if resolution is None:
        raise Sd2Error(
            f"{name}: the mesh of {mesh.vertex_count} vertices is no surface of SD² Studio",
            "a mesh made by `sd2 fit`",
            "Measure others with `sd2 compare-meshes`",
        )
    return own_patches(resolution)


def _with_vertices_of(mesh: MeshSequence, other: MeshSequence) -> MeshSequence:
    """The finest surface with the medium one's vertices, where the other has those."""
    if (own_resolution(mesh), own_resolution(other)) != ("high", "medium"):
        return mesh
    rows = medium_in_high()
    known = None if mesh.uncertainty is None else mesh.uncertainty.of_vertices(rows)
    return replace(mesh, vertices=mesh.vertices[:, rows], faces=other.faces, uncertainty=known)


@lru_cache(maxsize=1)
def medium_in_high() -> NDArray[np.intp]:
    """Vertices of the finest surface that are those of the medium one, (5000,)."""
    _, rows = cKDTree(Body.load("high").vertices_m).query(Body.load("medium").vertices_m)
    return np.asarray(rows, np.intp)


def _vertex_velocity(mesh: MeshSequence, presence: Presence) -> float:
    velocity = line_of_sight_velocity(np.asarray(mesh.vertices), mesh.times_s, presence=presence)
    return rms(velocity[presence.measured])


def _sigma(
    fitted: MeshSequence, patches: JointPatches, errors: Floats, chosen: NDArray[np.bool_]
) -> Pair | None:
    """Standard deviations of the chosen joints, as the vertices of their patches have them."""
    known = fitted.uncertainty
    if known is None:
        return None
    sigma = np.stack(
        [known.along_mps[:, known.vertex_limb[rows]].mean(axis=1) for rows in patches.rows], axis=1
    ).astype(np.float64)
    frames = chosen.any(axis=1)
    return Pair(*(np.where(chosen, one, np.nan)[frames] for one in (sigma, errors)))


# -- A real video, whose motion is not known -------------------------------------------------------

_SEEN = 0.5
"""Visibility from which a landmark is compared, and sureness from which a pixel is a person."""

_BOTH = tuple(name for name in LANDMARKS if name in JOINTS)
"""Landmarks that are joints: shoulders, elbows, wrists, hips, knees, ankles."""


@dataclass(frozen=True)
class RealScore:
    """One video."""

    name: str
    # Mean over frames of the intersection over union of the mesh's silhouette and the landmark
    # model's mask, within the picture.
    overlap: float
    # Mean distance of joints from their landmarks in the picture, at the joint's depth. Landmarks
    # that are hidden or outside the picture are left out.
    reprojection_m: float


def score_real(
    name: str, mesh: MeshSequence, track: LandmarkTrack, camera: PinholeCamera
) -> RealScore:
    """Measure a mesh against what the landmark model saw.

    Parameters
    ----------
    mesh : MeshSequence
        With a surface of ours, frame by frame of the track; otherwise Sd2Error.
    track : LandmarkTrack
        With silhouettes.
    """
    resolution = own_resolution(mesh)
    if resolution is None or mesh.faces is None or mesh.frame_count != len(track):
        raise Sd2Error(
            f"{name}: a mesh of {mesh.vertex_count} vertices and {mesh.frame_count} frames",
            f"one made by `sd2 fit` from this video of {len(track)} frames",
        )
    frames = [int(frame) for frame in track.silhouette_frames if track.present[frame]]
    masks = dict(zip(track.silhouette_frames.tolist(), track.silhouettes, strict=True))
    overlaps = []
    for frame in frames:
        seen = masks[frame] >= 255 * _SEEN
        height, width = seen.shape
        drawn = silhouette(mesh.frame(frame), mesh.faces, camera, (width, height))
        overlaps.append(overlap(drawn, seen))
    away_m = reprojection_m(mesh, track, camera)
    return RealScore(
        name,
        float(np.nanmean(overlaps)) if overlaps else float("nan"),
        float(away_m.mean()) if away_m.size else float("nan"),
    )


def reprojection_m(
    mesh: MeshSequence, track: LandmarkTrack, camera: PinholeCamera
) -> NDArray[np.float64]:
    """Distances (n,) of joints from their landmarks in the picture, in metres at their depth.

    Of shoulders, elbows, wrists, hips, knees and ankles in all frames in which they are seen; the
    mesh has a surface of ours, frame by frame of the track.
    """
    resolution = own_resolution(mesh)
    assert resolution is not None
    joints = own_patches(resolution).positions(mesh.read(0, mesh.frame_count))[
        :, [JOINTS.index(one) for one in _BOTH]
    ]
    rows = [LANDMARKS.index(one) for one in _BOTH]
    pixels = track.image_px[:, rows].astype(np.float64)
    inside = ((pixels >= 0) & (pixels <= (track.width, track.height))).all(axis=-1)
    seen = track.present[:, None] & (track.visibility[:, rows] >= _SEEN) & inside
    away_px = np.linalg.norm(camera.project(joints[seen]) - pixels[seen], axis=-1)
    return np.asarray(away_px * joints[seen][:, 2] / camera.focal_px)
