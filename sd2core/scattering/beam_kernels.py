"""Compiled form of :mod:`sd2core.scattering.beam`: both planes are looked up in tables."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.numerics.compiled import compiled
from sd2core.scattering.beam import by_plane, sensor_axes
from sd2core.sensor import Beam, VirtualSensor

_PER_DEGREE = 64
"""Entries of the compiled tables per degree: between them a beam of 10° is right to 1e-5."""

_PER_RADIAN = np.float32(_PER_DEGREE * 180.0 / math.pi)
_PI, _QUARTER = np.float32(math.pi), np.float32(math.pi / 2)
_TINY = np.float32(1e-30)
_RUN = 512


class BeamTables(NamedTuple):
    """A sensor's axes and two-way power by angle, as kernels take them; empty without a beam."""

    axes: NDArray[np.float64]  # (3, 3): right, down, ahead
    across: NDArray[np.float32]  # from -180 to 180 degrees
    up: NDArray[np.float32]  # likewise


_NO_BEAM = BeamTables(np.eye(3), np.empty(0, np.float32), np.empty(0, np.float32))


def beam_tables(sensor: VirtualSensor | None) -> BeamTables:
    """Tables for the kernels of a sensor's beam."""
    if sensor is None or sensor.beam is None:
        return _NO_BEAM
    return BeamTables(sensor_axes(sensor), *_two_way(sensor.beam))


@lru_cache(maxsize=8)
def _two_way(beam: Beam) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    angles_deg = np.arange(-180 * _PER_DEGREE, 180 * _PER_DEGREE + 2) / _PER_DEGREE
    across, up = by_plane(beam, angles_deg, angles_deg)
    return (across**2).astype(np.float32), (up**2).astype(np.float32)


@compiled
def _place(y, x):  # type: ignore[no-untyped-def]
    """Place of the angle atan2(y, x) in a table, in operations that become vectors.

    To 1e-7 rad: Abramowitz and Stegun, *Handbook of Mathematical Functions*, 4.4.49.
    """
    wide, high = abs(x), abs(y)
    t = min(wide, high) / max(max(wide, high), _TINY)
    s = t * t
    p = np.float32(-0.0161657367) + s * np.float32(0.0028662257)
    p = np.float32(-0.0752896400) + s * (np.float32(0.0429096138) + s * p)
    p = np.float32(-0.1420889944) + s * (np.float32(0.1065626393) + s * p)
    p = np.float32(-0.3333314528) + s * (np.float32(0.1999355085) + s * p)
    angle = t + t * s * p
    angle = _QUARTER - angle if high > wide else angle
    angle = _PI - angle if x < 0 else angle
    angle = -angle if y < 0 else angle
    return (angle + _PI) * _PER_RADIAN


@compiled
def _looked_up(table, place):  # type: ignore[no-untyped-def]
    """Value of a table at a place between two entries."""
    entry = np.uint32(place)  # without a sign it is not looked at for being negative
    low = table[entry]
    return low + np.float32(place - entry) * (table[entry + np.uint32(1)] - low)


@compiled
def gain_towards(right, high, ahead, across, up):  # type: ignore[no-untyped-def]
    """Two-way power in a direction along the sensor's axes, by the tables of :class:`BeamTables`.

    Parameters
    ----------
    right, high, ahead : float
        The direction, of any length.
    across, up
        The tables.
    """
    level = np.sqrt(right * right + ahead * ahead)
    return _looked_up(across, _place(right, ahead)) * _looked_up(up, _place(high, level))


@compiled
def weigh_by_beam(x, y, z, sx, sy, sz, axes, across, up, weight):  # type: ignore[no-untyped-def]
    """Multiply the weights of vertices by the two-way power of a beam.

    Parameters
    ----------
    x, y, z : (n,)
        Places of the vertices.
    sx, sy, sz : float
        Place of the sensor.
    axes, across, up
        Those of :class:`BeamTables`.
    weight : float32 (n,)
        Multiplied in place.
    """
    of = x.dtype.type
    rx, ry, rz = of(axes[0, 0]), of(axes[0, 1]), of(axes[0, 2])
    dx, dy, dz = of(axes[1, 0]), of(axes[1, 1]), of(axes[1, 2])
    ax, ay, az = of(axes[2, 0]), of(axes[2, 1]), of(axes[2, 2])
    level_at, high_at = np.empty(_RUN, x.dtype), np.empty(_RUN, x.dtype)
    for first in range(0, weight.shape[0], _RUN):
        count = min(_RUN, weight.shape[0] - first)
        for i in range(count):
            qx, qy, qz = x[first + i] - sx, y[first + i] - sy, z[first + i] - sz
            right = rx * qx + ry * qy + rz * qz
            high = -(dx * qx + dy * qy + dz * qz)
            ahead = ax * qx + ay * qy + az * qz
            level_at[i] = _place(right, ahead)
            high_at[i] = _place(high, np.sqrt(right * right + ahead * ahead))
        # Apart, so that the loop above is of vectors.
        for i in range(count):
            gain = _looked_up(across, level_at[i]) * _looked_up(up, high_at[i])
            weight[first + i] *= gain
