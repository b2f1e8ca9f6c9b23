"""Body shapes: stature, and a few directions in which bodies of one stature differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sd2core.body.model import Body, Resolution, Skeleton, load_skeleton, read_body_arrays
from sd2core.errors import Sd2Error
from sd2core.options.bounds import STATURE_M

DEFAULT_STATURE_M = 1.72
"""Body height if none is given; distances and speeds scale with it."""

Floats = NDArray[np.float64]

PHENOTYPES = ("gender", "muscle", "weight", "height", "proportions")
"""Anny's names; each from 0 to 1, 0.5 the middle (gender: 0 male, 1 female)."""


@dataclass(frozen=True, eq=False)
class BodyShape:
    """Shape of one person."""

    coefficients: Floats  # (K,) along ShapeSpace's directions; all 0 is the bundled body
    stature_m: float  # standing height, without shoes


def check_stature(stature_m: float) -> None:
    """Refuse a height that no person has; Sd2Error."""
    if stature_m not in STATURE_M:
        raise Sd2Error(
            f"The body height is {stature_m:g} m",
            f"metres, {STATURE_M.low:g} to {STATURE_M.high:g}",
        )


class ShapeSpace:
    """Directions of shape of the bundled body.

    Attributes
    ----------
    mean, sd : float64 array, shape (K,)
        Of the coefficients over bodies of random phenotypes.
    heads_m : float64 array, shape (K, B, 3)
        Shift of the bones' heads per unit of each coefficient.
    base_stature_m, base_skeleton
        Of the body whose coefficients are 0.
    """

    def __init__(self) -> None:
        names = ("shape_heads", "shape_mean", "shape_sd", "shape_polynomial", "high_vertices")
        self.heads_m, self.mean, self.sd, self._polynomial, vertices = (
            array.astype(np.float64) for array in read_body_arrays(names)
        )
        self.base_stature_m = float(-vertices[:, 1].min())
        self.base_skeleton = load_skeleton()

    def __len__(self) -> int:
        return len(self.mean)

    def coefficients(self, **phenotypes: float) -> Floats:
        """Coefficients (K,) of phenotypes, 0.5 where not given; Sd2Error for an impossible one."""
        for name, value in phenotypes.items():
            if name not in PHENOTYPES or not 0.0 <= value <= 1.0:
                raise Sd2Error(
                    f"phenotype {name} = {value}", f"{', '.join(PHENOTYPES)} from 0 to 1"
                )
        middle = phenotype_features([{}]) @ self._polynomial
        return np.asarray((phenotype_features([phenotypes]) @ self._polynomial - middle)[0])

    def random(self, rng: np.random.Generator) -> BodyShape:
        """An adult of random phenotypes and stature (1.45 to 2.00 m)."""
        drawn = {name: float(rng.uniform(0.0, 1.0)) for name in PHENOTYPES if name != "height"}
        stature_m = 1.78 - 0.12 * drawn["gender"] + 0.07 * rng.standard_normal()
        return BodyShape(self.coefficients(**drawn), float(np.clip(stature_m, 1.45, 2.0)))

    def load(self, resolution: Resolution, shape: BodyShape) -> Body:
        """Body of one shape at rest, standing on the floor."""
        if shape.coefficients.shape != self.mean.shape:
            raise Sd2Error(
                f"a shape of {shape.coefficients.shape} coefficients", f"{self.mean.shape} of them"
            )
        return self.shaped(Body.load(resolution), self.directions_m(resolution), shape)

    def directions_m(self, resolution: Resolution) -> Floats:
        """Shift of the vertices per unit of each coefficient, (K, V, 3)."""
        (directions,) = read_body_arrays((f"{resolution}_shape",))
        return np.asarray(directions.astype(np.float64))

    def skeleton(self, shape: BodyShape) -> Skeleton:
        """Bones of one body at rest."""
        scale = shape.stature_m / self.base_stature_m
        heads = np.tensordot(shape.coefficients, self.heads_m, 1)
        base = self.base_skeleton
        return replace(base, heads_m=scale * (base.heads_m + heads))

    def shaped(self, body: Body, directions_m: Floats, shape: BodyShape) -> Body:
        """A body moved along directions (K, V, 3) and scaled to its stature."""
        scale = shape.stature_m / self.base_stature_m
        vertices = body.vertices_m + np.tensordot(shape.coefficients, directions_m, 1)
        return replace(body, vertices_m=scale * vertices, skeleton=self.skeleton(shape))


def phenotype_features(phenotypes: Sequence[Mapping[str, float]]) -> Floats:
    """Monomials up to the second degree of phenotypes about their middle, (N, 21)."""
    x = np.array([[2.0 * one.get(name, 0.5) - 1.0 for name in PHENOTYPES] for one in phenotypes])
    count = len(PHENOTYPES)
    squares = [x[:, i] * x[:, j] for i in range(count) for j in range(i, count)]
    return np.stack([np.ones(len(x)), *x.T, *squares], axis=1)
