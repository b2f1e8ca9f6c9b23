"""Meshes that cost little: a sphere of 288 vertices that swings towards the camera and back."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sd2core.io.mesh import save_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.timebase import Timebase

_ROUND, _HIGH = 24, 12


def swinging_sphere(frames: int, swings_hz: float = 0.6) -> MeshSequence:
    """Radius 0.4 m, at 3 m, 30 frames/s."""
    down = np.linspace(0.15, np.pi - 0.15, _HIGH)
    around = np.linspace(0, 2 * np.pi, _ROUND, endpoint=False)
    one, other = (grid.ravel() for grid in np.meshgrid(down, around, indexing="ij"))
    points = 0.4 * np.stack(
        [np.sin(one) * np.cos(other), np.cos(one), np.sin(one) * np.sin(other)], axis=1
    )
    corner = np.arange((_HIGH - 1) * _ROUND)
    right = corner // _ROUND * _ROUND + (corner + 1) % _ROUND
    faces = np.concatenate(
        [
            np.stack([corner, corner + _ROUND, right], axis=1),
            np.stack([right, corner + _ROUND, right + _ROUND], axis=1),
        ]
    )
    times_s = np.arange(frames) / 30.0
    away_m = 3.0 + 0.3 * np.sin(2 * np.pi * swings_hz * times_s)
    place = np.stack([np.zeros(frames), np.zeros(frames), away_m], axis=1)
    vertices = (points + place[:, None]).astype(np.float32)
    return MeshSequence(vertices, faces.astype(np.int32), Timebase(times_s), "swinging sphere")


def save_spheres(folder: Path, count: int, frames: int = 40) -> list[Path]:
    """Meshes that swing at different rates, as ``m0.npz`` and so on."""
    folder.mkdir(exist_ok=True)
    paths = [folder / f"m{number}.npz" for number in range(count)]
    for number, path in enumerate(paths):
        save_mesh(swinging_sphere(frames, 0.4 + 0.15 * number), path)
    return paths


def maps_in(out: Path) -> dict[str, np.ndarray]:
    """Values of all maps of a batch, by their file."""
    maps = {}
    for kind in ("synthetic", "denoised"):
        for path in sorted((out / kind).glob("*/*.npz")):
            with np.load(path) as arrays:
                maps[path.relative_to(out).as_posix()] = arrays["values"]
    return maps
