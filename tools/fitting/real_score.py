"""Agreement of a fitted mesh with the person in a real video, whose motion is not known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.body.camera import PinholeCamera
from sd2core.body.model import own_resolution
from sd2core.body.shaping import overlap, silhouette
from sd2core.body.track import LANDMARKS, LandmarkTrack
from sd2core.compare.joints import JOINTS, own_patches
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence

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
