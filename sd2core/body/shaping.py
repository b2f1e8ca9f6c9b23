"""Shape of the person in a clip: bone lengths from landmarks, girth from outlines."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.body.camera import PinholeCamera
from sd2core.body.model import Body
from sd2core.body.rig import KeypointSpace
from sd2core.body.rotations import Floats
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.body.skinning import pose_vertices
from sd2core.body.track import LANDMARK
from sd2core.numerics.raster import rasterise

Transforms = Callable[[BodyShape], Floats]

_SEGMENTS = (
    ("shoulder.L", "shoulder.R", 0.03),
    ("hip.L", "hip.R", 0.03),
    *((f"shoulder.{side}", f"hip.{side}", 0.04) for side in "LR"),
    *((f"shoulder.{side}", f"elbow.{side}", 0.02) for side in "LR"),
    *((f"elbow.{side}", f"wrist.{side}", 0.02) for side in "LR"),
    *((f"hip.{side}", f"knee.{side}", 0.03) for side in "LR"),
    *((f"knee.{side}", f"ankle.{side}", 0.03) for side in "LR"),
)
"""Landmarks, and how well their distance is known from a clip, in metres."""

_SEEN = 0.5
"""Trust from where on a landmark counts."""
_ENOUGH_FRAMES = 3
_OUTLINE_WEIGHT = 60.0
"""Worth of a whole overlap against half a squared standard deviation of shape."""
_TRIALS = 60

NEAREST_M = 0.05
"""Smallest depth that is drawn."""


def shape_of_lengths(
    space: ShapeSpace, keypoints: KeypointSpace, seen_m: Floats, trust: Floats, stature_m: float
) -> tuple[BodyShape, Floats]:
    """Likeliest shape for distances between landmarks, and its covariance (K, K).

    Parameters
    ----------
    space : ShapeSpace
        K directions of shape, with their spread over bodies.
    keypoints : KeypointSpace
        Landmarks on bodies of that space.
    seen_m : float64 ndarray, (T, 33, 3)
        Places of the landmarks, in one frame for each moment.
    trust : float64 ndarray, (T, 33)
        From 0 to 1; landmarks below a half are left out.
    stature_m : float
        Stature of the person, which is kept.
    """
    rows, lengths, sds = [], [], []
    for first, second, sd_m in _SEGMENTS:
        pair = LANDMARK[first], LANDMARK[second]
        seen = trust[:, pair].min(axis=1) > _SEEN
        if seen.sum() < min(_ENOUGH_FRAMES, len(seen)):
            continue
        along = seen_m[seen][:, pair[1]] - seen_m[seen][:, pair[0]]
        rows.append(pair)
        lengths.append(float(np.median(np.linalg.norm(along, axis=1))))
        sds.append(sd_m)
    if not rows:
        return BodyShape(space.mean.copy(), stature_m), np.diag(space.sd**2)
    pairs, sd = np.array(rows), np.array(sds)
    coefficients = space.mean.copy()
    for _ in range(5):
        shape = BodyShape(coefficients, stature_m)
        rest = keypoints.of(shape).rest_m
        along = rest[pairs[:, 1]] - rest[pairs[:, 0]]
        now = np.linalg.norm(along, axis=1)
        scale = stature_m / space.base_stature_m
        moves = scale * (
            keypoints.directions_m[:, pairs[:, 1]] - keypoints.directions_m[:, pairs[:, 0]]
        )  # (K, n, 3)
        slope = (moves * (along / now[:, None])).sum(axis=-1).T  # (n, K)
        precision = (slope.T / sd**2) @ slope + np.diag(1.0 / space.sd**2)
        pull = (slope.T / sd**2) @ (np.array(lengths) - now) + (
            space.mean - coefficients
        ) / space.sd**2
        coefficients = coefficients + np.linalg.solve(precision, pull)
    return BodyShape(coefficients, stature_m), np.linalg.inv(precision)


def shape_of_outlines(
    space: ShapeSpace,
    start: BodyShape,
    spread: Floats,
    transforms_of: Transforms,
    camera: PinholeCamera,
    outlines: Sequence[NDArray[np.bool_]],
) -> BodyShape:
    """Shape whose outlines overlap best with those seen, near one that fits the bones.

    Parameters
    ----------
    space : ShapeSpace
        K directions of shape.
    start, spread : BodyShape, float64 ndarray (K, K)
        Shape that fits the bones and its covariance, of :func:`shape_of_lengths`.
    transforms_of : callable
        Gives the poses (n, B, 3, 4) of the frames with outlines for a shape.
    camera : PinholeCamera
        Of the whole picture.
    outlines : sequence of n bool ndarray, (h, w)
        Masks of the person, which show the whole picture at any size.
    """
    from scipy.optimize import minimize

    sizes, directions = np.linalg.eigh(spread)
    basis = directions * np.sqrt(sizes)  # columns of one standard deviation each
    surface = Body.load("low")
    moves = space.directions_m("low")

    def shaped(steps: Floats) -> BodyShape:
        return BodyShape(start.coefficients + basis @ steps, start.stature_m)

    def loss(steps: Floats) -> float:
        shape = shaped(steps)
        body = space.shaped(surface, moves, shape)
        vertices = pose_vertices(body, transforms_of(shape))
        shares = [
            overlap(silhouette(frame, body.faces, camera, seen.shape[::-1]), seen)
            for frame, seen in zip(vertices, outlines, strict=True)
        ]
        return float(_OUTLINE_WEIGHT * (1.0 - np.mean(shares)) + 0.5 * (steps**2).sum())

    result = minimize(
        loss,
        np.zeros(len(space)),
        method="Powell",
        options={"maxfev": _TRIALS, "xtol": 0.05, "ftol": 1e-3},
        bounds=[(-2.5, 2.5)] * len(space),
    )
    return shaped(result.x)


def silhouette(
    vertices_m: NDArray[Any],
    faces: NDArray[np.int32],
    camera: PinholeCamera,
    size: tuple[int, int] | None = None,
) -> NDArray[np.bool_]:
    """Mask (height, width) of the pixels that a mesh in the camera frame covers.

    Parameters
    ----------
    vertices_m : ndarray, (V, 3)
        Triangles with a vertex less than 5 cm in front of the camera are left out.
    faces : int32 ndarray, (F, 3)
        Its triangles.
    camera : PinholeCamera
        Of the whole picture.
    size : tuple of 2 int, optional
        Width and height of the mask, which shows the whole picture; by default the picture's own.
    """
    width, height = size or (camera.width, camera.height)
    vertices = np.asarray(vertices_m, np.float64)
    ahead = vertices[:, 2] > NEAREST_M
    kept = faces[ahead[faces].all(axis=1)]
    depth = np.where(ahead, vertices[:, 2], 1.0)
    points = camera.project(np.concatenate([vertices[:, :2], depth[:, None]], axis=1))
    points *= np.array([width / camera.width, height / camera.height])
    buffer = np.zeros((height, width), np.float32)
    owner = np.full((height, width), -1, np.int32)
    rasterise(
        points.astype(np.float32),
        (1.0 / depth).astype(np.float32),
        np.ascontiguousarray(kept, np.int32),
        buffer,
        owner,
    )
    return owner >= 0


def overlap(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> float:
    """Intersection over union of two masks of one size; NaN when both are empty."""
    union = int(np.count_nonzero(one | other))
    return int(np.count_nonzero(one & other)) / union if union else float("nan")
