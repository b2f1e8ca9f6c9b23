"""Points and cells of the body and of everything else in the scene; no VTK."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.mesh.sequence import MeshSequence

_LONGEST_GRID_M = 24.0
PYRAMID_POINTS = 5
_PYRAMID_WIDTH = 0.72

GridRectangle = tuple[float, float, float, float, float]
"""x0, z0, x1, z1 and the distance of the lines, metres."""


@dataclass(frozen=True)
class MetreLabel:
    """Distance along z, written at either end of a grid line."""

    text: str
    left_m: tuple[float, float, float]
    right_m: tuple[float, float, float]


@dataclass(frozen=True)
class Ground:
    """Grid on the floor: its lines, those at whole metres apart from the others, and labels."""

    points: NDArray[np.float32]  # (n, 3)
    opacity: NDArray[np.float32]  # (n,), fading outwards
    minor: NDArray[np.int32]  # segments (m, 2)
    major: NDArray[np.int32]
    labels: tuple[MetreLabel, ...]


def cone(rim: NDArray[np.floating]) -> tuple[NDArray, NDArray, NDArray]:
    """Points (n + 1, 3), triangles (n, 3) and wire segments (n + 4, 2) of a cone around +z.

    It has its apex, point 0, at the origin, and a ``rim`` of n unit vectors, so that a wide angle
    does not make a huge one. The wire is the rim and four ribs.
    """
    points = np.concatenate([np.zeros((1, 3)), rim]).astype(np.float32)
    here = np.arange(len(rim), dtype=np.int32) + 1
    following = np.roll(here, -1)
    triangles = np.stack([np.zeros_like(here), here, following], axis=1)
    corners = here[len(rim) // 8 :: len(rim) // 4]
    ribs = np.stack([np.zeros_like(corners), corners], axis=1)
    rim_segments = np.stack([here, following], axis=1)
    return points, triangles, np.concatenate([rim_segments, ribs])


def ring(sides: int = 32) -> tuple[NDArray, NDArray]:
    """Unit circle in the xz plane: points and segments."""
    angle = np.arange(sides) * (2 * math.pi / sides)
    points = np.stack([np.cos(angle), np.zeros(sides), np.sin(angle)], axis=1)
    here = np.arange(sides, dtype=np.int32)
    return points.astype(np.float32), np.stack([here, np.roll(here, -1)], axis=1)


def frustum(length: float) -> tuple[NDArray, NDArray]:
    """Wire camera along +z with its optical centre at the origin: points and segments."""
    points = np.array(
        [
            (0, 0, 0), (-2, -1.5, 3.4), (2, -1.5, 3.4), (2, 1.5, 3.4), (-2, 1.5, 3.4),
            (-0.7, -1.68, 3.4), (0.7, -1.68, 3.4), (0, -2.25, 3.4),
        ]
    )  # fmt: skip
    segments = np.array(
        [(0, 1), (0, 2), (0, 3), (0, 4), (1, 2), (2, 3), (3, 4), (4, 1), (5, 6), (6, 7), (7, 5)]
    )
    return length / 3.4 * points, segments


def pyramids(
    positions: NDArray[np.floating], axes: NDArray[np.floating], length: float
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Points (5 N, 3) and triangles (6 N, 3) of pyramids whose tips point ahead.

    ``axes``, (N, 3, 3), has the rows right, down and ahead of each, with its tip first, then its
    base, with the given position in the middle.
    """
    half = _PYRAMID_WIDTH / 2
    one = np.array(
        [(0, 0, 1), (-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)]
    )
    points = positions[:, None] + length * (one @ axes)
    sides = np.array([(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 1), (1, 3, 2), (1, 4, 3)], np.int32)
    first = PYRAMID_POINTS * np.arange(len(positions), dtype=np.int32)
    triangles = (first[:, None, None] + sides).reshape(-1, 3)
    return points.reshape(-1, 3).astype(np.float32), triangles


def grid_rectangle(low_xz: NDArray[np.float64], high_xz: NDArray[np.float64]) -> GridRectangle:
    """Rectangle of whole grid cells around another, with room around it."""
    half = np.clip((high_xz - low_xz) / 2 + 0.6, 1.2, _LONGEST_GRID_M / 2)
    middle = (low_xz + high_xz) / 2
    step = 0.5 if half.max() <= 4.0 else 1.0
    x0, z0 = np.floor((middle - half) / step) * step
    x1, z1 = np.ceil((middle + half) / step) * step
    return (float(x0), float(z0), float(x1), float(z1), step)


def ground(floor_m: float, x0: float, z0: float, x1: float, z1: float, step: float) -> Ground:
    """A grid on the floor that fades outwards, with a label at every metre."""
    xs, zs = (
        np.linspace(low, high, round((high - low) / step) + 1) for low, high in ((x0, x1), (z0, z1))
    )
    x, z = np.meshgrid(xs, zs, indexing="ij")
    away = np.maximum(abs(2 * x - x0 - x1) / (x1 - x0), abs(2 * z - z0 - z1) / (z1 - z0))
    points = np.stack([x, np.full_like(x, floor_m), z], axis=-1).reshape(-1, 3)
    number = np.arange(x.size, dtype=np.int32).reshape(x.shape)
    along_z, along_x = _segments(number), _segments(number.T)
    whole_x, whole_z = (abs(values - values.round()) < 1e-6 for values in (xs, zs))
    minor = _joined(along_z[~whole_x], along_x[~whole_z])
    major = _joined(along_z[whole_x], along_x[whole_z])
    labels = tuple(
        MetreLabel(f"{at:.0f} m".replace("-", "\u2212"), (x0, floor_m, at), (x1, floor_m, at))
        for at in map(float, zs[whole_z])
    )
    opacity = np.clip(1.25 - away**2, 0.12, 1.0).ravel()
    return Ground(points.astype(np.float32), opacity.astype(np.float32), minor, major, labels)


def _segments(number: NDArray[np.int32]) -> NDArray[np.int32]:
    """Segments (lines, n - 1, 2) of lines whose n points have these numbers, (lines, n)."""
    return np.stack([number[:, :-1], number[:, 1:]], axis=-1)


def _joined(*lines: NDArray[np.int32]) -> NDArray[np.int32]:
    return np.concatenate([segments.reshape(-1, 2) for segments in lines])


_SAMPLED_FRAMES = 9
_SAMPLED_VERTICES = 400
_SHADOW_CELL_M = 0.03
_FEW_FACES = 4000


@dataclass(frozen=True, eq=False)
class Extent:
    """Bounds of the body during the whole clip, from a few frames."""

    points_m: NDArray[np.float64]  # (n, 3): a sample of vertices of several frames
    low_m: NDArray[np.float64]  # (3,), with high_m the box around them
    high_m: NDArray[np.float64]
    floor_m: float  # y of the floor: where the feet are

    @classmethod
    def of_points(cls, points: NDArray[np.floating], floor_m: float | None = None) -> Extent:
        """Extent of points; the floor is at the lowest unless given."""
        points = np.asarray(points, np.float64).reshape(-1, 3)
        low, high = points.min(axis=0), points.max(axis=0)
        return cls(points, low, high, float(high[1]) if floor_m is None else floor_m)

    @classmethod
    def of_mesh(cls, mesh: MeshSequence) -> Extent:
        """Extent from a few frames over the clip, so that a long one stays on disk."""
        count = min(mesh.frame_count, _SAMPLED_FRAMES)
        frames = np.linspace(0, mesh.frame_count - 1, count).astype(int)
        stride = max(mesh.vertex_count // _SAMPLED_VERTICES, 1)
        kept, feet = [], []
        for index in frames:
            vertices = mesh.frame(int(index))
            feet.append(float(vertices[:, 1].max()))
            extremes = np.concatenate([vertices.argmin(axis=0), vertices.argmax(axis=0)])
            kept.append(np.concatenate([vertices[::stride], vertices[extremes]]))
        return cls.of_points(np.concatenate(kept), float(np.median(feet)))

    @property
    def centre_m(self) -> NDArray[np.float64]:
        """Middle of the box."""
        return 0.5 * (self.low_m + self.high_m)


def is_closed_outward(vertices: NDArray[np.floating], faces: NDArray[np.int32]) -> bool:
    """True if the surface is closed and its faces point outwards.

    Then the back of no face can be seen from outside, and drawing them is wasted.
    """
    from sd2core.scattering.visibility import encloses  # with kernels

    corners = np.asarray(vertices, np.float64)[faces] - np.mean(vertices, axis=0)  # (F, 3, 3)
    volume = np.einsum("fi,fi->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    return bool(volume > 0) and encloses(faces)


def coarse_faces(
    vertices: NDArray[np.floating], faces: NDArray[np.integer], cell_m: float = _SHADOW_CELL_M
) -> NDArray[np.int32]:
    """Fewer triangles over the same vertices, (n, 3), good enough for a shadow.

    Vertices in one cube of ``cell_m`` are replaced by one of them; triangles
    that collapse or coincide are dropped.
    """
    if len(faces) <= _FEW_FACES:
        return np.asarray(faces, np.int32)
    points = np.asarray(vertices, np.float64)
    low = points.min(axis=0)
    cell_m = max(cell_m, float((points.max(axis=0) - low).max()) / 1000.0)
    cube = np.floor((points - low) / cell_m).astype(np.int64)  # (V, 3), below 1001
    _, first, member = np.unique(
        cube @ [1 << 20, 1 << 10, 1], return_index=True, return_inverse=True
    )
    coarse = np.sort(first[member][faces], axis=1)
    solid = (coarse[:, 0] != coarse[:, 1]) & (coarse[:, 1] != coarse[:, 2])
    return np.unique(coarse[solid], axis=0).astype(np.int32)
