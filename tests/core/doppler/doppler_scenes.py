"""Small moving scenes whose velocities are known in closed form."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sd2core.doppler import PRESETS, SynthesisOptions, Synthesizer
from sd2core.doppler.masks import Occlusion, position_of
from sd2core.doppler.reference import at_frames
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

RAW = replace(
    PRESETS["paper"],
    null_bins=(),
    range_exponent=0.0,
    velocity_sigma_bins=0.0,
    time_sigma_s=0.0,
)
"""The plain histogram: nothing nulled, weighted or smoothed."""

CAMERA = VirtualSensor()


def sensor_at(*position_m: float) -> VirtualSensor:
    return VirtualSensor(position_m=(position_m[0], position_m[1], position_m[2]))


def sphere(radius_m: float = 0.3, divisions: int = 3) -> tuple[NDArray[Any], NDArray[np.int32]]:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=divisions, radius=radius_m)
    return np.asarray(ball.vertices), np.asarray(ball.faces, np.int32)


def plate(side_m: float = 0.4, cells: int = 9) -> tuple[NDArray[Any], NDArray[np.int32]]:
    line = np.linspace(-side_m / 2, side_m / 2, cells + 1)
    x, y = np.meshgrid(line, line)
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    right, below = corner + 1, corner + cells + 1
    faces = [np.stack([corner, below, right], 1), np.stack([right, below, below + 1], 1)]
    return vertices, np.concatenate(faces).astype(np.int32)


def moving(
    vertices: NDArray[Any], faces: NDArray[np.int32] | None, path_m: ArrayLike, times_s: ArrayLike
) -> MeshSequence:
    """A rigid surface carried along a path (T, 3)."""
    positions = np.asarray(path_m)[:, None, :] + vertices[None]
    return MeshSequence(positions, faces, Timebase(times_s), "scene")


def wobbling(frames: int = 40, seed: int = 7, divisions: int = 3) -> MeshSequence:
    """Two balls, one before the other, that sway and breathe at up to some m/s."""
    vertices, faces = sphere(0.3, divisions)
    both = np.concatenate([vertices, 0.5 * vertices + [0.1, 0.05, -0.6]])
    all_faces = np.concatenate([faces, faces + len(vertices)]).astype(np.int32)
    times = np.arange(frames) / 30.0
    random = np.random.default_rng(seed)
    sway = random.normal(scale=0.4, size=(3, 3))
    phase = 2 * np.pi * np.outer(times, [0.5, 1.1, 1.7])
    positions = (
        both * (1 + 0.1 * np.sin(phase[:, 1]))[:, None, None]
        + (np.sin(phase) @ sway)[:, None]
        + [0.0, 0.0, 2.2]
    )
    return MeshSequence(positions.astype(np.float32), all_faces, Timebase(times), "wobble")


def options(**changes: Any) -> SynthesisOptions:
    return replace(RAW, **changes)


def reference_velocities(
    mesh: MeshSequence, sensor: VirtualSensor, options: SynthesisOptions, frame: int
) -> NDArray[np.float64]:
    """Velocity of every vertex at each of a frame's moments, (moments, V), in double precision."""
    place = np.asarray(sensor.position_m, np.float64)
    return next(at_frames(mesh, place, options, frame, frame + 1))[0]


def cached_mask(
    maker: Synthesizer,
    sensor: VirtualSensor,
    frames: tuple[int, int] | None = None,
    visibility: Occlusion = "exact",
) -> NDArray[np.uint8] | None:
    """Exact or depth visibility (n, V) of some frames, or all, if it is kept for this place.

    Vertices that cannot change the map hold the facing test.
    """
    counts, parts = maker._frames, []
    place = position_of(counts.prepared.sensor(sensor.position_m))
    for index, low, high in counts.blocks_between(*(frames or (0, maker.mesh.frame_count))):
        start, _ = counts.prepared.span(index)
        rows = slice(low - start, high - start)
        mask = counts.masks.kept(index, rows, place, visibility)
        if mask is None:
            return None
        parts.append(mask)
    return np.concatenate(parts)
