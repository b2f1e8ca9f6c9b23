"""Points and cells of everything in the scene that is not the mesh; no VTK."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_LONGEST_GRID_M = 24.0
PYRAMID_POINTS = 5
_PYRAMID_WIDTH = 0.72


GridRectangle = tuple[float, float, float, float, float]
"""x0, z0, x1, z1 and the distance of the lines, metres."""


@dataclass(frozen=True)
class Lines:
    """Line segments with an opacity per point."""

    points: NDArray[np.float32]  # (n, 3)
    segments: NDArray[np.int32]  # (m, 2)
    opacity: NDArray[np.float32]  # (n,)


@dataclass(frozen=True)
class MetreLabel:
    """Distance along z, written at either end of a grid line."""

    text: str
    left_m: tuple[float, float, float]
    right_m: tuple[float, float, float]


@dataclass(frozen=True)
class Ground:
    """Grid lines on the floor, and their metre labels."""

    minor: Lines
    major: Lines
    labels: tuple[MetreLabel, ...]


def cone(field_of_view_deg: float, sides: int = 48) -> tuple[NDArray, NDArray, NDArray]:
    """Points (sides + 1, 3), triangles (sides, 3) and wire segments (sides + 4, 2) of a cone.

    It is along +z with its apex, point 0, at the origin. Rays at the edge of the field of view
    have length one, so a wide angle does not make a huge rim. The wire is the rim and four ribs.
    """
    half = math.radians(field_of_view_deg) / 2
    angle = np.arange(sides) * (2 * math.pi / sides)
    rim = np.stack(
        [
            math.sin(half) * np.cos(angle),
            math.sin(half) * np.sin(angle),
            np.full(sides, math.cos(half)),
        ],
        axis=1,
    )
    points = np.concatenate([np.zeros((1, 3)), rim]).astype(np.float32)
    here = np.arange(sides, dtype=np.int32) + 1
    following = np.roll(here, -1)
    triangles = np.stack([np.zeros_like(here), here, following], axis=1)
    corners = here[sides // 8 :: sides // 4]
    ribs = np.stack([np.zeros_like(corners), corners], axis=1)
    rim_segments = np.stack([here, following], axis=1)
    return points, triangles, np.concatenate([rim_segments, ribs])


def ring(sides: int = 32) -> tuple[NDArray, NDArray]:
    """Unit circle in the xz plane: points and segments."""
    angle = np.arange(sides) * (2 * math.pi / sides)
    points = np.stack([np.cos(angle), np.zeros(sides), np.sin(angle)], axis=1)
    here = np.arange(sides, dtype=np.int32)
    return points.astype(np.float32), np.stack([here, np.roll(here, -1)], axis=1)


def frustum(width: float = 4.0, height: float = 3.0, depth: float = 3.4) -> tuple[NDArray, NDArray]:
    """Wire camera along +z with its optical centre at the origin: points and segments."""
    w, h = width / 2, height / 2
    points = np.array(
        [
            (0, 0, 0),
            (-w, -h, depth),
            (w, -h, depth),
            (w, h, depth),
            (-w, h, depth),
            (-0.35 * w, -1.12 * h, depth),
            (0.35 * w, -1.12 * h, depth),
            (0, -1.5 * h, depth),
        ],
        np.float32,
    )
    segments = np.array(
        [
            (0, 1), (0, 2), (0, 3), (0, 4), (1, 2), (2, 3), (3, 4), (4, 1),
            (5, 6), (6, 7), (7, 5),
        ],
        np.int32,
    )  # fmt: skip
    return points / depth, segments


def pyramids(
    positions: NDArray[np.floating], directions: NDArray[np.floating], length: float
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Points (5 N, 3) and triangles (6 N, 3) of pyramids whose tips point along N unit vectors.

    Each has its tip first, then its base, with the given position in the middle.
    """
    half = _PYRAMID_WIDTH * length / 2
    # As rotation_to, for all at once.
    level = np.stack([directions[:, 2], np.zeros(len(directions)), -directions[:, 0]], axis=1)
    steepness = np.linalg.norm(level, axis=1, keepdims=True)
    right = np.where(steepness > 1e-9, level / np.maximum(steepness, 1e-9), (1.0, 0.0, 0.0))
    down = np.cross(directions, right)
    points = np.empty((len(positions), PYRAMID_POINTS, 3), np.float32)
    points[:, 0] = positions + length * directions
    for corner, (across, downward) in enumerate(((-1, -1), (1, -1), (1, 1), (-1, 1)), start=1):
        points[:, corner] = positions + half * (across * right + downward * down)
    sides = np.array([(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 1), (1, 3, 2), (1, 4, 3)], np.int32)
    first = PYRAMID_POINTS * np.arange(len(positions), dtype=np.int32)
    triangles = (first[:, None, None] + sides).reshape(-1, 3)
    return points.reshape(-1, 3), triangles


def rotation_to(direction: tuple[float, float, float]) -> NDArray[np.float64]:
    """Rotation (3, 3) that turns +z into ``direction`` and keeps the horizon level."""
    forward = np.asarray(direction, np.float64)
    forward = forward / np.linalg.norm(forward)
    level = np.array([forward[2], 0.0, -forward[0]])
    length = np.linalg.norm(level)
    right = level / length if length > 1e-9 else np.array([1.0, 0.0, 0.0])
    return np.stack([right, np.cross(forward, right), forward], axis=1)


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
    xs, zs = _ticks(x0, x1, step), _ticks(z0, z1, step)
    lines: dict[bool, list[tuple[NDArray, NDArray]]] = {False: [], True: []}
    for x in xs:
        lines[_is_major(x)].append((np.full(len(zs), x), zs))
    for z in zs:
        lines[_is_major(z)].append((xs, np.full(len(xs), z)))
    centre = np.array([(x0 + x1) / 2, (z0 + z1) / 2])
    reach = np.array([(x1 - x0) / 2, (z1 - z0) / 2])
    labels = tuple(
        MetreLabel(
            f"{z:.0f} m".replace("-", "\u2212"),
            (float(x0), floor_m, float(z)),
            (float(x1), floor_m, float(z)),
        )
        for z in zs
        if _is_major(z)
    )
    minor, major = (_joined(lines[kind], floor_m, centre, reach) for kind in (False, True))
    return Ground(minor, major, labels)


def _ticks(low: float, high: float, step: float) -> NDArray[np.float64]:
    return np.linspace(low, high, round((high - low) / step) + 1)


def _is_major(value: float) -> bool:
    return abs(value - round(value)) < 1e-6


def _joined(
    strips: list[tuple[NDArray, NDArray]],
    floor_m: float,
    centre: NDArray[np.float64],
    reach: NDArray[np.float64],
) -> Lines:
    points: list[NDArray] = []
    segments: list[NDArray] = []
    count = 0
    for x, z in strips:
        points.append(np.stack([x, np.full(len(x), floor_m), z], axis=1))
        first = np.arange(count, count + len(x) - 1)
        segments.append(np.stack([first, first + 1], axis=1))
        count += len(x)
    if not points:
        return Lines(np.zeros((0, 3), np.float32), np.zeros((0, 2), np.int32), np.zeros(0, "f4"))
    together = np.concatenate(points)
    away = np.abs((together[:, [0, 2]] - centre) / reach).max(axis=1)
    opacity = np.clip(1.25 - away**2, 0.12, 1.0)
    return Lines(
        together.astype(np.float32),
        np.concatenate(segments).astype(np.int32),
        opacity.astype(np.float32),
    )
