"""Reflecting centres of a scene: facets, each with its phase in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sd2core.fmcw.kernels import NEAREST_M
from sd2core.fmcw.scene import MeshScene
from sd2core.radar_config import RadarConfig
from sd2core.sensor import VirtualSensor

_SERIES_BELOW_RAD = 1.0
_SERIES_TERMS = 16
"""The first term left out is below 1e-16 at the limit above."""


@dataclass(frozen=True, eq=False)
class Scatterers:
    """Reflecting centres at one instant."""

    position_m: NDArray[np.float64]  # Camera frame, (n, 3).
    velocity_mps: NDArray[np.float64]  # (n, 3).
    # Echo at the sensor, (n,): projected area in m^2 over R^2, times the mean phasor of the facet
    # about its centre.
    amplitude: NDArray[np.complex128]


def point_scatterers(
    position_m: ArrayLike,
    velocity_mps: ArrayLike,
    area_m2: ArrayLike,
    sensor: VirtualSensor,
) -> Scatterers:
    """Scatterers of a given effective area that reflect alike in all directions.

    Positions and velocities are (n, 3), areas (n,) or one number.
    """
    position = np.atleast_2d(np.asarray(position_m, dtype=np.float64))
    velocity = np.broadcast_to(np.asarray(velocity_mps, dtype=np.float64), position.shape)
    range_m = np.linalg.norm(position - np.asarray(sensor.position_m), axis=1)
    amplitude = np.asarray(area_m2, dtype=np.float64) / np.maximum(range_m, NEAREST_M) ** 2
    return Scatterers(position, velocity, amplitude.astype(np.complex128))


def facet_scatterers(
    vertices_m: NDArray[np.float64],
    velocity_mps: NDArray[np.float64],
    faces: NDArray[np.int32],
    sensor: VirtualSensor,
    config: RadarConfig,
    visible: NDArray[np.bool_] | None = None,
) -> Scatterers:
    """Scatterers of the facets that face the sensor, of amplitude area * cos(theta) / R^2.

    The phase is linear over a facet, so its sum over the facet is closed form
    (:func:`mean_phasor`). Points one per facet would have
    to lie well under a wavelength apart to add up to the same.

    Faces are counter-clockwise seen from outside. ``visible``, (F,), marks the facets that nothing
    hides; those that face away never count.
    """
    corners = vertices_m[faces] - np.asarray(sensor.position_m)  # (F, 3 corners, 3)
    normal = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    centre = corners.mean(axis=1)
    range_m = np.linalg.norm(centre, axis=1)
    # The normal's length is the area, so this is area * cos(theta).
    towards = -np.einsum("fi,fi->f", normal, centre)
    projected_m2 = towards / np.maximum(range_m, NEAREST_M)
    seen = projected_m2 > 0
    if visible is not None:
        seen &= visible
    corners, range_m = corners[seen], range_m[seen]
    wave_number = 4.0 * np.pi / config.wavelength_m
    phase = wave_number * (np.linalg.norm(corners, axis=2) - range_m[:, None])  # (F, 3)
    # Distance is convex: its mean excess over the centre is quadratic, and over a
    # triangle a quadratic has a quarter of its mean at the corners. Taking the
    # other three quarters off leaves an error of third order in the edge length.
    phase -= 0.75 * phase.mean(axis=1, keepdims=True)
    strength = projected_m2[seen] / np.maximum(range_m, NEAREST_M) ** 2
    return Scatterers(
        centre[seen] + np.asarray(sensor.position_m),
        velocity_mps[faces[seen]].mean(axis=1),
        strength * mean_phasor(phase),
    )


def scatterers_at(scene: MeshScene, time_s: float) -> Scatterers:
    """Facets at an instant, moving with the central difference over two mesh frames.

    None where there is no person.
    """
    if not scene.is_present(time_s):
        nothing = np.zeros((0, 3))
        return Scatterers(nothing, nothing, np.zeros(0, np.complex128))
    assert scene.mesh.faces is not None
    position, velocity = scene.moving(time_s)
    visible = scene.visible(time_s)
    return facet_scatterers(
        position, velocity, scene.mesh.faces, scene.sensor, scene.config, visible
    )


def mean_phasor(phase_rad: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Mean of exp(j phase) over triangles on which the phase is linear; (n, 3) to (n,).

    The mean is twice the second divided difference of exp at the three corner
    phases (Hermite-Genocchi). Differences of close numbers are avoided on two
    levels: the first differences are written with sinc, and triangles whose
    phases span less than one radian use the Taylor series about the mean phase,
    whose moments are complete symmetric polynomials of the corner phases.

    Exact to about 1e-15, whether or not phases coincide.
    """
    ordered = np.sort(phase_rad, axis=1)
    middle = ordered.mean(axis=1)
    low, mid, high = (ordered - middle[:, None]).T
    close = high - low < _SERIES_BELOW_RAD
    mean = np.empty(len(phase_rad), dtype=np.complex128)
    mean[close] = _series(low[close], mid[close], high[close])
    far = ~close
    low, mid, high = low[far], mid[far], high[far]
    mean[far] = 2j * (_first(low, mid) - _first(mid, high)) / (high - low)
    mean *= np.exp(1j * middle)
    return mean


def _first(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Mean of exp(j x) for x between a and b."""
    divided: NDArray[np.complex128] = np.exp(0.5j * (a + b)) * np.sinc((b - a) / (2.0 * np.pi))
    return divided


def _series(
    a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """Sum over k of 2 j^k h_k(a, b, c) / (k + 2)! for a + b + c = 0."""
    second = a * b + b * c + c * a
    third = a * b * c
    # h_k = -e2 h_(k-2) + e3 h_(k-3), because e1 = a + b + c = 0.
    before = [np.zeros_like(a), np.zeros_like(a), np.ones_like(a)]
    total = np.ones(len(a), dtype=np.complex128)
    factor = 1.0 + 0.0j
    for order in range(1, _SERIES_TERMS):
        factor *= 1j / (order + 2)
        term = third * before[0] - second * before[1]
        before = [before[1], before[2], term]
        total += factor * term
    return total
