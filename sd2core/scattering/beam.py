"""Weight of a direction by the antennas' beam, compiled and in NumPy."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sd2core.numerics.compiled import compiled
from sd2core.sensor import Beam, VirtualSensor

_PER_DEGREE = 64
"""Entries of the compiled tables per degree: between them a beam of 10° is right to 1e-5."""

_PER_RADIAN = np.float32(_PER_DEGREE * 180.0 / math.pi)
_PI, _QUARTER = np.float32(math.pi), np.float32(math.pi / 2)
_LEAST = np.float32(1e-30)
_RUN = 512


class BeamTables(NamedTuple):
    """A sensor's axes and two-way power by angle, as kernels take them; empty without a beam."""

    axes: NDArray[np.float64]  # (3, 3): right, down, ahead
    across: NDArray[np.float32]  # from -180 to 180 degrees
    up: NDArray[np.float32]  # likewise


_NO_BEAM = BeamTables(np.eye(3), np.empty(0, np.float32), np.empty(0, np.float32))


def sensor_axes(sensor: VirtualSensor) -> NDArray[np.float64]:
    """Axes of the sensor in the camera frame, (3, 3): rows right, down and along the boresight."""
    azimuth = math.radians(sensor.azimuth_deg)
    right = np.array([math.cos(azimuth), 0.0, -math.sin(azimuth)])
    ahead = np.asarray(sensor.boresight)
    return np.stack([right, np.cross(ahead, right), ahead])


def beam_tables(sensor: VirtualSensor | None) -> BeamTables:
    """Tables for the kernels of a sensor's beam."""
    if sensor is None or sensor.beam is None:
        return _NO_BEAM
    return BeamTables(sensor_axes(sensor), *_two_way(sensor.beam))


@lru_cache(maxsize=8)
def _two_way(beam: Beam) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    angles_deg = np.arange(-180 * _PER_DEGREE, 180 * _PER_DEGREE + 2) / _PER_DEGREE
    across, up = one_way(beam, angles_deg, 0.0), one_way(beam, 0.0, angles_deg)
    middle = one_way(beam, 0.0, 0.0)
    return (across**2).astype(np.float32), ((up / middle) ** 2).astype(np.float32)


def one_way(beam: Beam, across_deg: ArrayLike, up_deg: ArrayLike) -> NDArray[np.float64]:
    """Power that an antenna sends into directions, or takes from them; 1 at most.

    Parameters
    ----------
    beam : Beam
        Pattern of the antenna.
    across_deg, up_deg : float or ndarray
        Angles to the right of the boresight and above it.
    """
    if not beam.cuts:
        width = beam.azimuth_width_deg, beam.elevation_width_deg
        off = (np.asarray(across_deg) / width[0]) ** 2 + (np.asarray(up_deg) / width[1]) ** 2
        power: NDArray[np.float64] = np.exp(-4.0 * math.log(2.0) * off)
        return power
    angles, azimuth, elevation = np.array(beam.cuts).T
    across_db = np.interp(np.asarray(across_deg, np.float64), angles, azimuth)
    up_db = np.interp(np.asarray(up_deg, np.float64), angles, elevation)
    return np.asarray(10.0 ** (0.1 * (across_db + up_db)))


def two_way_gain(
    sensor: VirtualSensor, points_m: NDArray[Any], place_m: NDArray[Any] | None = None
) -> NDArray[np.float64]:
    """Share of an echo's power that the sensor's beam lets pass, there and back, (V,).

    Parameters
    ----------
    sensor : VirtualSensor
        With its beam, or without: ones.
    points_m : ndarray, (3, V)
        Where the echoes come from.
    place_m : ndarray, (3,), optional
        Place of the sensor in the frame of the points; by default that in the camera frame.
    """
    if sensor.beam is None:
        return np.ones(points_m.shape[1])
    return np.asarray(one_way(sensor.beam, *_angles_of(sensor, points_m, place_m)) ** 2)


def _angles_of(
    sensor: VirtualSensor, points_m: NDArray[Any], place_m: NDArray[Any] | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    place = np.asarray(sensor.position_m if place_m is None else place_m, np.float64)
    return angles_deg(sensor_axes(sensor), np.asarray(points_m, np.float64) - place[:, None])


def angles_deg(
    axes: NDArray[np.float64], away: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Angles (V,) of directions (3, V) to the right of the boresight and above it.

    The axes are those of :func:`sensor_axes`.
    """
    right, down, ahead = axes @ away
    across = np.degrees(np.arctan2(right, ahead))
    return across, np.degrees(np.arctan2(-down, np.hypot(right, ahead)))


def beam_of_cuts(rows: NDArray[np.float64]) -> Beam:
    """Beam of a table (n, 3) of angle_deg, azimuth_db, elevation_db; its levels may have any zero.

    Raises Sd2Error where the angles do not ascend from below 0 to above it.
    """
    rows = rows - np.array([0.0, *rows[:, 1:].max(axis=0)])
    angles_deg = np.arange(0.0, 180.0, 0.01)
    widths = []
    for level_db in rows.T[1:]:
        sides = (np.interp(way * angles_deg, rows[:, 0], level_db) for way in (-1.0, 1.0))
        below = (np.append(side, -np.inf) < 10.0 * math.log10(0.5) for side in sides)
        widths.append(float(sum(0.01 * np.argmax(one) for one in below)))
    azimuth_deg, elevation_deg = (max(width, 1.0) for width in widths)
    return Beam(azimuth_deg, elevation_deg, tuple(map(tuple, rows.tolist())))


def half_power_rim(beam: Beam, sides: int = 48) -> NDArray[np.float64]:
    """Directions (sides, 3) of half power around the boresight: right, down, ahead.

    The first that has half the power on the way outwards; where there is none, behind.
    """
    turn = np.arange(sides) * (2.0 * math.pi / sides)
    away_deg = np.linspace(0.0, 180.0, 3601)[:, None]
    across, up = away_deg * np.cos(turn), np.clip(away_deg * np.sin(turn), -90.0, 90.0)
    power = one_way(beam, across, up)
    power[-1] = 0.0
    first = np.argmax(power < 0.5, axis=0), np.arange(sides)
    azimuth, elevation = np.radians(across[first]), np.radians(up[first])
    level = np.cos(elevation)
    return np.stack([np.sin(azimuth) * level, -np.sin(elevation), np.cos(azimuth) * level], axis=1)


def share_in_beam(
    sensor: VirtualSensor, points_m: NDArray[Any], echo: NDArray[Any]
) -> float | None:
    """Share of a body's echo that comes from within the half power of the sensor's beam.

    Parameters
    ----------
    sensor : VirtualSensor
        None comes back where it has no beam, or where there is no echo.
    points_m : ndarray, (3, V)
        Vertices in the camera frame.
    echo : ndarray, (V,)
        What each sends back to an antenna that weighs all directions alike.
    """
    if sensor.beam is None or not (total := float(np.sum(echo))) > 0:
        return None
    power = one_way(sensor.beam, *_angles_of(sensor, points_m))
    return float(np.sum(echo[power >= 0.5]) / total)


@compiled
def _place(y, x):  # type: ignore[no-untyped-def]
    """Place of the angle atan2(y, x) in a table, in operations that become vectors.

    To 1e-7 rad: Abramowitz and Stegun, *Handbook of Mathematical Functions*, 4.4.49.
    """
    wide, high = abs(x), abs(y)
    t = min(wide, high) / max(max(wide, high), _LEAST)
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
    """Multiply the weights of vertices by :func:`two_way_gain`, compiled.

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


def compile_kernels() -> None:
    """Call every kernel of this module once in single and once in double precision."""
    tables = beam_tables(VirtualSensor(beam=Beam(60.0, 60.0)))
    for precision in (np.float32, np.float64):
        line, weight = np.zeros(1, precision), np.ones(1, np.float32)
        weigh_by_beam(line, line, line, line[0], line[0], line[0], *tables, weight)
    gain_towards(0.0, 0.0, 1.0, tables.across, tables.up)
