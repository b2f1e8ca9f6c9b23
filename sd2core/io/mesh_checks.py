"""Checks of meshes that are read, and safe repairs."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.texts import errors_in
from sd2core.io.mesh_arrays import RawMesh
from sd2core.io.stored_vertices import StoredVertices
from sd2core.mesh.presence import checked
from sd2core.mesh.sequence import VertexArray, checked_faces, place_in_words
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.numerics.precision import ROUNDING, SHARE_OF_A_BIN, stored_velocity_error_mps
from sd2core.plausibility.clock import judge_clock
from sd2core.plausibility.mesh import (
    LARGEST_BODY_M,
    BodyPoints,
    judge_motion,
    judge_place,
    judge_size,
)
from sd2core.sensor import VelocityAxis

_SAMPLE_FRAMES = 5
_POINTS = 128
"""Vertices of a frame whose motion is judged."""
_STRETCH_FRAMES, _JUDGED_ON_DISK_BYTES = 64, 32 * 2**20
_MIN_VERTICES = 3
"""Of so few vertices nothing is judged: they are no body."""
_CLOSED_SHARE = 0.95
_MIXED_SHARE = 0.01
_SMPL_VERTICES = 6890


def mark_empty_frames(raw: RawMesh, source: str) -> None:
    """Mark frames without a finite vertex, or all in one point, as empty; refuse other gaps.

    Trackers write such frames where they lost the person. They hold the last known
    pose (before the first known one, that). Vertices that stay on disk are not touched
    here: they are checked as they are read.
    """
    frames = int(raw.vertices.shape[0])
    if raw.present is not None:
        with errors_in(source, remedy=""):
            raw.present = checked(raw.present, frames)
    if isinstance(raw.vertices, StoredVertices):
        return
    vertices: NDArray[Any] = np.asarray(raw.vertices)
    finite = np.isfinite(vertices).all(axis=2)  # (T, V)
    if vertices.shape[1] > _MIN_VERTICES:
        # Slots of an array that were never filled, or frames that were lost.
        lost = (vertices[:, 0] == vertices[:, -1]).all(axis=1)
        lost[lost] = (vertices[lost] == vertices[lost, :1]).all(axis=(1, 2))
        finite &= ~lost[:, None] | lost.all()
    whole = finite.all(axis=1)
    if whole.all():
        return
    present = np.ones(frames, bool) if raw.present is None else raw.present
    # In frames without a person by the file, vertices say nothing.
    empty = ~finite.any(axis=1) | (~present & ~whole)
    if not whole.any() and empty.all():
        raise Sd2Error(
            f"{source}: no frame holds a finite vertex (all NaN or infinite)",
            "coordinates in metres",
            "Look at how the file was written",
        )
    partial = np.flatnonzero(~whole & ~empty)
    if partial.size:
        frame = int(partial[0])
        bad = np.flatnonzero(~finite[frame])
        raise Sd2Error(
            f"{source}: vertex {bad[0]} of frame {frame} is at"
            f" {place_in_words(vertices[frame, bad[0]])} ({bad.size:,} vertices of that frame are"
            f" NaN or infinite, {partial.size:,} frames in all)",
            "finite coordinates in metres; only frames that are wholly NaN can be left empty",
            "Fill those vertices where the file is written",
        )
    known = np.maximum.accumulate(np.where(empty, -1, np.arange(frames)))
    raw.vertices = vertices[np.where(known < 0, np.argmin(empty), known)]
    unsaid = np.flatnonzero(empty & present)
    if unsaid.size:
        raw.notes.append(_no_body(unsaid, "all NaN, or all vertices in one point"))
    raw.present = present & ~empty


def _no_body(frames: NDArray[np.int64], why: str) -> str:
    return (
        f"{len(frames):,} {'frame holds' if len(frames) == 1 else 'frames hold'} no body ({why}),"
        f" the first is frame {frames[0]}; taken as time without a person."
    )


def mark_gaps(raw: RawMesh) -> None:
    """Put one frame without a person where video frames are missing, lasting as long.

    Of vertices that stay on disk, the frame before is taken for it.
    """
    numbers = raw.frame_numbers
    if numbers is None or not (np.diff(numbers) > 0).all():
        return  # what does not increase is said when times are made of it
    gaps = np.flatnonzero(np.diff(numbers) > 1)
    if not gaps.size:
        return
    missing = int(numbers[-1] - numbers[0] + 1 - len(numbers))
    raw.notes.append(
        f"{missing:,} video frames hold no mesh, the first after frame {numbers[gaps[0]]}; they are"
        " taken as time without a person."
    )
    present = np.ones(len(numbers), bool) if raw.present is None else np.array(raw.present, bool)
    if isinstance(raw.vertices, StoredVertices):
        present[gaps] = False
        raw.present = present
        return
    held = np.insert(np.arange(len(numbers)), gaps + 1, gaps)
    raw.vertices = np.asarray(raw.vertices)[held]
    raw.frame_numbers = np.insert(numbers, gaps + 1, numbers[gaps] + 1)
    raw.present = np.insert(present, gaps + 1, False)


def uncertainty_of(raw: RawMesh, source: str) -> VelocityUncertainty | None:
    """Uncertainty of velocities that a file states, or None."""
    if raw.uncertainty is None:
        return None
    vertex_limb, along, across = raw.uncertainty
    limbs = raw.limbs or tuple(f"limb {number}" for number in range(np.shape(along)[-1]))
    with errors_in(source, remedy=""):
        return VelocityUncertainty(limbs, vertex_limb, along, across)


def check_mesh(raw: RawMesh, times_s: NDArray[np.float64], source: str, check_size: bool) -> None:
    """Check size, rounding and faces on a few frames; flip faces that look inwards.

    Parameters
    ----------
    raw : RawMesh
        Changed in place: notes are added; faces become int32 and are turned over where they look
        inwards.
    times_s : float64 array, shape (T,)
        Times of the frames.
    source : str
        Name of the file, for errors.
    check_size : bool
        False if whoever reads it has said that the size is right.

    Raises
    ------
    Sd2Error
        For a size that no body has, or faces that cannot belong to the mesh.
    """
    count = int(raw.vertices.shape[0])
    chosen = np.unique(np.linspace(0, count - 1, _SAMPLE_FRAMES).astype(int))
    sample = [np.asarray(raw.vertices[int(k)], dtype=np.float64) for k in chosen]  # (V, 3) each
    if check_size and sample[0].shape[0] > 3:
        _check_size(raw, sample, source)
    _note_rounding(raw, sample, times_s)
    if raw.faces is None:
        _note_missing_faces(raw)
    else:
        _check_faces(raw, sample[0], source)


def _check_size(raw: RawMesh, sample: list[NDArray[np.float64]], source: str) -> None:
    extent_m = float(np.median([np.ptp(frame, axis=0).max() for frame in sample]))
    finding = judge_size(extent_m)
    if finding is not None and extent_m > LARGEST_BODY_M:
        raise finding.within(source)
    if finding is not None:
        raw.findings.append(finding)


def judge_body(raw: RawMesh, times_s: NDArray[np.float64]) -> None:
    """Add findings on clock, place and motion; those on disk are judged in some stretches.

    Frames there whose vertices all lie in one point become frames without a person.
    """
    frames = int(raw.vertices.shape[0])
    present = np.ones(frames, bool) if raw.present is None else np.array(raw.present, bool)
    seen = []
    for start, stop in _stretches(raw.vertices):
        with suppress(Sd2Error):  # vertices that are not finite: said when these frames are used
            seen.append(_looked_at(np.asarray(raw.vertices[start:stop]), start))
    if not seen:
        return
    numbers, points_m, extent_m = (np.concatenate(part) for part in zip(*seen, strict=True))
    if points_m.shape[1] > _MIN_VERTICES:
        empty = numbers[~extent_m.any(axis=1) & present[numbers]]
        if 0 < len(empty) < int(present[numbers].sum()):
            present[empty] = False
            raw.present = present
            raw.notes.append(_no_body(empty, "all vertices in one point"))
    raw.findings += judge_clock(times_s, present, of_a_mesh=True)
    if points_m.shape[1] > _MIN_VERTICES:
        body = BodyPoints(numbers, points_m, times_s[numbers], present[numbers], extent_m)
        raw.findings += [*judge_place(body), *judge_motion(body)]


def _stretches(vertices: VertexArray) -> list[tuple[int, int]]:
    """Frames that are judged: all in memory, of those on disk stretches spread evenly."""
    frames = int(vertices.shape[0])
    if not isinstance(vertices, StoredVertices):
        return [(0, frames)]
    length = _STRETCH_FRAMES if vertices.large_chunks else vertices.frames_per_chunk
    frame_bytes = vertices.chunk_bytes // vertices.frames_per_chunk
    starts = np.arange(0, frames, length)
    most = max(_JUDGED_ON_DISK_BYTES // (length * frame_bytes), 1)
    if len(starts) > most:
        starts = starts[np.linspace(0, len(starts) - 1, most).astype(int)]
    return [(int(start), min(int(start) + length, frames)) for start in starts]


def _looked_at(
    vertices: NDArray[Any], first: int
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Numbers of frames, some of their vertices (n, N, 3), and the extent of these (n, 3).

    It is 0 for none but frames with all vertices in one point.
    """
    some = np.unique(np.linspace(0, vertices.shape[1] - 1, _POINTS).astype(int))
    points_m = vertices[:, some].astype(np.float64)
    extent_m = np.ptp(points_m, axis=1)
    for frame in np.flatnonzero(~extent_m.any(axis=1)):
        extent_m[frame] = np.ptp(vertices[frame], axis=0)
    return np.arange(first, first + len(vertices)), points_m, extent_m


def _note_rounding(
    raw: RawMesh, sample: list[NDArray[np.float64]], times_s: NDArray[np.float64]
) -> None:
    """Note if single precision in the file itself spoils the velocities."""
    if np.dtype(raw.vertices.dtype) != np.float32 or len(times_s) < 2:
        return
    duration_s = 2.0 * float(np.median(np.diff(times_s)))
    reach_m = max(float(np.abs(frame).max()) for frame in sample)
    allowed_mps = SHARE_OF_A_BIN * VelocityAxis().bin_width_mps
    if not 0 < duration_s * allowed_mps < stored_velocity_error_mps(reach_m, 1.0):
        return
    raw.notes.append(
        f"Coordinates reach {reach_m:,.4g} m and are stored in single precision, to"
        f" {ROUNDING * reach_m * 1000:.2g} mm: velocities from frame to frame are wrong by up to"
        f" {stored_velocity_error_mps(reach_m, duration_s):.2g} m/s. Store them in double"
        " precision, or nearer to the origin."
    )


def _note_missing_faces(raw: RawMesh) -> None:
    note = (
        "The file holds no faces: it is a point cloud without a surface, of which every point "
        "is seen (visibility 'none' only). Pass --faces with a .npy, .npz or .obj to make it a "
        "mesh."
    )
    if raw.vertices.shape[1] == _SMPL_VERTICES:
        note += (
            f" Its {_SMPL_VERTICES:,} vertices are SMPL's; that model's faces are licensed with "
            "it and cannot be included here, so give those of your copy."
        )
    raw.notes.append(note)


def _check_faces(raw: RawMesh, vertices: NDArray[np.float64], source: str) -> None:
    numbers = np.asarray(raw.faces)
    plain = numbers.dtype.kind in "iuf" and numbers.size > 0
    if plain and numbers.min() == 1 and numbers.max() == len(vertices):
        numbers = numbers - 1
        raw.notes.append("The faces number the vertices from 1; they are read as such.")
    faces = checked_faces(numbers, len(vertices), source)
    corners = vertices[faces]  # (F, 3, 3)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    empty = int((np.linalg.norm(normals, axis=1) < 1e-12).sum())
    if empty:
        raw.notes.append(
            f"{empty:,} of {len(faces):,} faces have no area; they are kept and hide nothing."
        )
    closed, mixed = _edge_shares(faces)
    if mixed > _MIXED_SHARE:
        raw.notes.append(
            f"The faces are not wound alike ({mixed:.0%} of the edges join faces that look "
            "opposite ways), so what looks away from the sensor may be taken for its front."
        )
    elif closed >= _CLOSED_SHARE and _signed_volume(vertices, faces) < 0:
        faces = faces[:, ::-1]
        raw.notes.append("The faces looked inwards (clockwise from outside); they are turned over.")
    raw.faces = np.ascontiguousarray(faces)


def _edge_shares(faces: NDArray[np.int32]) -> tuple[float, float]:
    """Shares of edges that two faces use in opposite directions, and in the same."""
    if not faces.size:
        return 0.0, 0.0
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    forward = edges[:, 0] < edges[:, 1]
    span = np.int64(edges.max()) + 1
    key = edges.min(axis=1) * span + edges.max(axis=1)
    _, inverse = np.unique(key, return_inverse=True)
    along = np.bincount(inverse, weights=forward)
    against = np.bincount(inverse, weights=~forward)
    closed = (along == 1) & (against == 1)
    mixed = ((along == 2) & (against == 0)) | ((along == 0) & (against == 2))
    return float(closed.mean()), float(mixed.mean())


def _signed_volume(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> float:
    corners = vertices[faces] - vertices.mean(axis=0)
    turned = np.cross(corners[:, 1], corners[:, 2])
    return float(np.einsum("ij,ij->", corners[:, 0], turned)) / 6.0
