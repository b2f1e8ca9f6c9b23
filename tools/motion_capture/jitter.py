"""Meshes as estimators give them: a known motion with jitter that whole limbs share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from sd2core.body.parts import body_parts
from sd2core.mesh.sequence import MeshSequence

Floats = NDArray[np.float64]


def wandering(generator: np.random.Generator, frames: int, count: int) -> Floats:
    """Noise (T, count, 3) of standard deviation 1 that is forgotten within half a second."""
    share = np.exp(-1.0 / 15.0)
    noise = generator.normal(size=(frames, count, 3))
    noise[1:] *= np.sqrt(1.0 - share**2)
    return np.asarray(lfilter([1.0], [1.0, -share], noise, axis=0))


def jittering(mesh: MeshSequence, white_m: float, lasting_m: float, seed: int) -> MeshSequence:
    """The mesh with jitter, half of its variance common to all limbs, depth twice as uncertain."""
    generator = np.random.default_rng(seed)
    parts = body_parts(mesh)
    assert parts is not None
    frames, limbs = mesh.frame_count, len(parts.names)
    white = generator.normal(size=(frames, limbs + 1, 3))
    lasting = wandering(generator, frames, limbs + 1)
    jitter = (white_m * white + lasting_m * lasting) / np.sqrt(2.0) * [1.0, 1.0, 2.0]
    moved = mesh.read(0, frames) + jitter[:, parts.numbers] + jitter[:, -1:]
    return replace(mesh, vertices=moved)


def approaching_mps(vertices: NDArray[np.floating], times_s: Floats) -> Floats:
    """Velocities (T - 2, V) towards the camera, over two frames."""
    away_m = np.linalg.norm(vertices.astype(np.float64), axis=2)
    return -(away_m[2:] - away_m[:-2]) / (times_s[2:] - times_s[:-2])[:, None]


def facing(vertices: NDArray[np.floating], normals: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Vertices that look towards the camera."""
    return np.asarray((vertices * normals).sum(axis=-1) < 0)
