"""Vertices that are made from those of another mesh whenever frames are read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import Vector


class MadeVertices:
    """Vertices (T, V, 3) of frames that a function makes when they are asked for.

    Parameters
    ----------
    shape : tuple of 3 int
    dtype : numpy dtype
        Of what is made.
    make : callable
        Takes numbers of frames (n,), at least one, and gives their vertices (n, V, 3).
    """

    def __init__(
        self,
        shape: tuple[int, int, int],
        dtype: Any,
        make: Callable[[NDArray[np.intp]], NDArray[Any]],
    ) -> None:
        self.shape, self.dtype, self._make = shape, np.dtype(dtype), make

    def __getitem__(self, key: Any) -> NDArray[Any]:
        frames, *rest = key if isinstance(key, tuple) else (key,)
        rows = np.arange(self.shape[0])[frames]
        if not rows.size:
            return np.empty((*rows.shape, *self.shape[1:]), self.dtype)[(slice(None), *rest)]
        made = self._make(np.atleast_1d(rows)).astype(self.dtype, copy=False)
        if rows.ndim == 0:
            return made[0][tuple(rest)]
        return made[(slice(None), *rest)]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.asarray(self[:], dtype)


def read_frames(mesh: MeshSequence, frames: NDArray[np.intp]) -> NDArray[Any]:
    """Vertices of some frames of a mesh, which is read from the first of them to the last."""
    low, high = int(frames.min()), int(frames.max()) + 1
    return mesh.read(low, high)[frames - low]


class ChangedVertices(MadeVertices):
    """Vertices that ``change`` makes of those of some frames of a mesh, (n, V, 3)."""

    def __init__(
        self, mesh: MeshSequence, change: Callable[[NDArray[np.float64]], NDArray[np.float64]]
    ) -> None:
        super().__init__(
            (mesh.frame_count, mesh.vertex_count, 3),
            mesh.vertices.dtype,
            lambda frames: change(read_frames(mesh, frames).astype(np.float64)),
        )


class ShiftedVertices(ChangedVertices):
    """Vertices of a mesh that is put elsewhere, and not turned.

    Whatever is known of ``mesh`` need not be found again: it is as if the sensor had moved.
    """

    def __init__(self, mesh: MeshSequence, by_m: Vector) -> None:
        super().__init__(mesh, lambda points: points + by_m)
        self.mesh, self.by_m = mesh, by_m


def shifted(mesh: MeshSequence, by_m: Vector) -> MeshSequence:
    """A mesh put elsewhere; the camera that saw it moves with it."""
    if not any(by_m):
        return mesh
    known = mesh.uncertainty
    if known is not None:
        x, y, z = (a + b for a, b in zip(known.camera_m, by_m, strict=True))
        known = replace(known, camera_m=(x, y, z))
    return replace(mesh, vertices=ShiftedVertices(mesh, by_m), uncertainty=known)


def unshifted(mesh: MeshSequence) -> tuple[MeshSequence, Vector]:
    """The mesh before it was put elsewhere, and by how much it was moved."""
    made = mesh.vertices
    return (made.mesh, made.by_m) if isinstance(made, ShiftedVertices) else (mesh, (0.0, 0.0, 0.0))


def same_bodies(one: MeshSequence, other: MeshSequence) -> bool:
    """True if the bodies of two scenes have the same vertices, wherever they are put."""
    ids = [[id(unshifted(body)[0].vertices) for body in scene.bodies] for scene in (one, other)]
    return ids[0] == ids[1]


def shifted_like(mesh: MeshSequence, other: MeshSequence) -> MeshSequence:
    """A mesh that was not shifted yet put where another one is, as the same person."""
    return replace(
        shifted(mesh, unshifted(other)[1]),
        person=other.person,
        placed=other.placed,
        surroundings=other.surroundings,
    )
