"""Scenes built to require one thing, or not to."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import trimesh
from numpy.typing import NDArray

from sd2core.mesh.sequence import MeshSequence
from sd2core.timebase import Timebase

FPS = 30.0
FRAMES = 60

Path = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Positions (T, 3) in metres at times (T,)."""


def ball(
    path: Path, *, radius_m: float = 0.2, fineness: int = 4, frames: int = FRAMES
) -> MeshSequence:
    """A ball that follows a path."""
    surface = trimesh.creation.icosphere(subdivisions=fineness, radius=radius_m)
    return moving(surface, path, frames)


def moving(surface: trimesh.Trimesh, path: Path, frames: int = FRAMES) -> MeshSequence:
    """A rigid surface that follows a path without turning."""
    times_s = np.arange(frames) / FPS
    vertices = path(times_s)[:, None] + np.asarray(surface.vertices)[None]
    return MeshSequence(
        vertices.astype(np.float32),
        np.asarray(surface.faces, np.int32),
        Timebase.regular(frames, FPS),
        "scene",
    )


def together(*parts: MeshSequence) -> MeshSequence:
    """Several meshes as one."""
    offsets = np.cumsum([0, *(part.vertex_count for part in parts)])
    faces = [
        part.faces + offset
        for part, offset in zip(parts, offsets, strict=False)
        if part.faces is not None
    ]
    vertices = np.concatenate([part.read(0, part.frame_count) for part in parts], axis=1)
    return MeshSequence(vertices, np.concatenate(faces), parts[0].timebase, "scene")


def steady(start_m: tuple[float, float, float], velocity_mps: tuple[float, float, float]) -> Path:
    """Uniform motion."""
    return lambda t: np.asarray(start_m) + t[:, None] * np.asarray(velocity_mps)


def swinging(middle_m: tuple[float, float, float], speed_mps: float, rate_hz: float) -> Path:
    """To and fro along the line of sight, with this top speed."""
    reach_m = speed_mps / (2 * np.pi * rate_hz)

    def path(t: NDArray[np.float64]) -> NDArray[np.float64]:
        along = reach_m * np.sin(2 * np.pi * rate_hz * t)
        return np.asarray(middle_m) + np.stack([0 * along, 0 * along, along], axis=1)

    return path


def waving(starts_s: NDArray[np.float64], lasting_s: float = 1.5) -> Path:
    """To and fro from time to time, and still in between."""

    def path(t: NDArray[np.float64]) -> NDArray[np.float64]:
        since = t[:, None] - starts_s
        within = (since > 0) & (since < lasting_s)
        along = np.where(within, 0.3 * np.sin(np.pi * since / lasting_s) ** 2, 0.0).sum(axis=1)
        return np.stack([0 * along, 0 * along, 3 - along], axis=1)

    return path


def plate(
    centre_m: tuple[float, float, float], width_m: float, height_m: float, frames: int = FRAMES
) -> MeshSequence:
    """A thin still box across the line of sight."""
    box = trimesh.creation.box((width_m, height_m, 0.02))
    return moving(box.subdivide().subdivide(), steady(centre_m, (0, 0, 0)), frames)
