"""Rotation matrices, many at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def about(axis: Floats, angle_deg: Floats) -> Floats:
    """Rotations about one unit axis by many angles, (T, 3, 3); right-handed."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    square = np.outer(axis, axis) - np.eye(3) * (axis * axis).sum()
    angle = np.radians(angle_deg)[:, None, None]
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * square


def frame(first: Floats, normal: Floats) -> Floats:
    """Right-handed axes in columns: ``first``, ``normal`` made orthogonal to it, their cross."""
    x = first / np.linalg.norm(first, axis=-1, keepdims=True)
    y = normal - (normal * x).sum(axis=-1, keepdims=True) * x
    y = y / np.linalg.norm(y, axis=-1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def product(left: Floats, right: Floats) -> Floats:
    """Matrix product (..., 3, 3), summed in the same order on every machine."""
    return (
        left[..., :, 0, None] * right[..., None, 0, :]
        + left[..., :, 1, None] * right[..., None, 1, :]
        + left[..., :, 2, None] * right[..., None, 2, :]
    )


def applied(turn: Floats, point: Floats) -> Floats:
    """Points (..., 3) turned by (..., 3, 3), summed in the same order on every machine."""
    return (
        turn[..., 0] * point[..., 0, None]
        + turn[..., 1] * point[..., 1, None]
        + turn[..., 2] * point[..., 2, None]
    )


def transposed(turn: Floats) -> Floats:
    """Inverse of rotations (..., 3, 3)."""
    return np.swapaxes(turn, -1, -2)


def from_vector(vectors: Floats) -> Floats:
    """Rotations (..., 3, 3) by rotation vectors (..., 3) in radians (Rodrigues)."""
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1)
    cross = cross.reshape(*x.shape, 3, 3)
    # sin(a)/a and (1 - cos(a))/a², which np.sinc carries through zero.
    first = np.sinc(angle / np.pi)
    second = 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    return np.asarray(np.eye(3) + first * cross + second * (cross @ cross))


def to_vector(turns: Floats) -> Floats:
    """Rotation vectors (..., 3) in radians, no longer than π, of rotations (..., 3, 3)."""
    from scipy.spatial.transform import Rotation

    vectors = Rotation.from_matrix(turns.reshape(-1, 3, 3)).as_rotvec()
    return np.asarray(vectors.reshape(*turns.shape[:-2], 3))


def aligning(rest: Floats, seen: Floats, weights: Floats) -> Floats:
    """Rotations (T, 3, 3) that bring vectors at rest (T, n, 3) nearest to those seen (Kabsch)."""
    spread = np.einsum("tni,tnj,tn->tij", seen, rest, weights)
    left, _, right = np.linalg.svd(spread)
    flip = np.ones((len(spread), 3))
    flip[:, 2] = np.sign(np.linalg.det(left @ right))
    return np.asarray((left * flip[:, None]) @ right)
