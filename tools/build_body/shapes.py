"""Directions of shape: principal components of bodies of random Anny phenotypes.

Anny's phenotypes act through products of blend shapes. Bodies of random phenotypes,
scaled to one stature, are well described by a few directions (principal components):
those are exported, with a polynomial that leads from phenotypes to them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.shape import PHENOTYPES, phenotype_features

DIRECTIONS = 8
"""Leave 1.5 mm (root mean square over vertices) unexplained."""

_BODIES = 300
_SEED = 1
_TOO_TALL = 0.25
"""Anny's height is from 1.3 to 2.4 m; its outer quarters have other proportions."""
_HEAD_WEIGHT = 8.0
"""Bone heads count as much as many vertices: they are what landmarks tell of."""

Floats = NDArray[np.float64]


class Sampled(NamedTuple):
    """Rest vertices (V, 3) and bone heads (B, 3) of a body, on the floor."""

    vertices_m: Floats
    heads_m: Floats


def random_phenotypes() -> list[dict[str, float]]:
    """The same phenotypes every time, each from 0 to 1."""
    rng = np.random.default_rng(_SEED)
    values = rng.uniform(0.0, 1.0, (_BODIES, len(PHENOTYPES)))
    height = PHENOTYPES.index("height")
    values[:, height] = _TOO_TALL + (1.0 - 2.0 * _TOO_TALL) * values[:, height]
    return [dict(zip(PHENOTYPES, map(float, row), strict=True)) for row in values]


def shape_directions(
    base: Sampled, body_of: Callable[[dict[str, float]], Sampled]
) -> tuple[dict[str, NDArray[Any]], Floats]:
    """Directions of shape from the bodies of random phenotypes, which ``body_of`` makes.

    Returns arrays for the exported file: ``shape_heads`` (K, B, 3) and ``high_shape`` (K, V, 3),
    both in metres per unit; ``shape_mean`` and ``shape_sd`` (K,) of the coefficients over the
    bodies; ``shape_polynomial`` (features, K). And the coefficients of every body (N, K), to find
    the directions of other surfaces.
    """
    phenotypes = random_phenotypes()
    bodies = list(scaled(base, map(body_of, phenotypes)))
    vertices = np.stack([body.vertices_m - base.vertices_m for body in bodies])  # (N, V, 3)
    heads = np.stack([body.heads_m - base.heads_m for body in bodies])  # (N, B, 3)
    count = len(bodies)
    joined = np.concatenate(
        [vertices.reshape(count, -1), _HEAD_WEIGHT * heads.reshape(count, -1)], axis=1
    )
    left, sizes, _ = np.linalg.svd(joined, full_matrices=False)
    coefficients = left[:, :DIRECTIONS] * sizes[:DIRECTIONS]
    coefficients /= coefficients.std(axis=0)
    features = phenotype_features(phenotypes)
    return {
        "shape_heads": directions_of(coefficients, heads).astype(np.float32),
        "high_shape": directions_of(coefficients, vertices).astype(np.float16),
        "shape_mean": coefficients.mean(axis=0),
        "shape_sd": coefficients.std(axis=0),
        "shape_polynomial": np.linalg.lstsq(features, coefficients, rcond=None)[0],
    }, coefficients


def directions_of(coefficients: Floats, offsets_m: Floats) -> Floats:
    """Displacement by one unit of each coefficient, (K, points, 3), by least squares."""
    count, points, _ = offsets_m.shape
    solved = np.linalg.lstsq(coefficients, offsets_m.reshape(count, -1), rcond=None)[0]
    return np.asarray(solved.reshape(-1, points, 3))


def scaled(base: Sampled, bodies: Iterator[Sampled]) -> Iterator[Sampled]:
    """The bodies at the stature of the base."""
    stature_m = -base.vertices_m[:, 1].min()
    for body in bodies:
        factor = stature_m / -body.vertices_m[:, 1].min()
        yield Sampled(body.vertices_m * factor, body.heads_m * factor)
