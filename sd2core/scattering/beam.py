"""Weight of a direction by the antennas' beam, in NumPy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sd2core.sensor import Beam, VirtualSensor


def sensor_axes(sensor: VirtualSensor) -> NDArray[np.float64]:
    """Axes of the sensor in the camera frame, (3, 3): rows right, down and along the boresight."""
    azimuth = math.radians(sensor.azimuth_deg)
    right = np.array([math.cos(azimuth), 0.0, -math.sin(azimuth)])
    ahead = np.asarray(sensor.boresight)
    return np.stack([right, np.cross(ahead, right), ahead])


def one_way(beam: Beam, across_deg: ArrayLike, up_deg: ArrayLike) -> NDArray[np.float64]:
    """Power that an antenna sends into directions, or takes from them; 1 at most.

    Parameters
    ----------
    beam : Beam
        Pattern of the antenna.
    across_deg, up_deg : float or ndarray
        Angles to the right of the boresight and above it.
    """
    across, up = by_plane(beam, across_deg, up_deg)
    return across * up


def by_plane(
    beam: Beam, across_deg: ArrayLike, up_deg: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Power one way by each angle alone, of which the product counts."""
    given = np.asarray(across_deg, np.float64), np.asarray(up_deg, np.float64)
    if not beam.cuts:
        widths_deg = beam.azimuth_width_deg, beam.elevation_width_deg
        across, up = (
            np.exp(-4.0 * math.log(2.0) * (angle / width) ** 2)
            for angle, width in zip(given, widths_deg, strict=True)
        )
        return across, up
    angles_deg, *levels_db = np.array(beam.cuts).T
    across, up = (
        np.asarray(10.0 ** (0.1 * np.interp(angle, angles_deg, level_db)))
        for angle, level_db in zip(given, levels_db, strict=True)
    )
    return across, up


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
    away = np.asarray(points_m, np.float64) - np.array(sensor.position_m)[:, None]
    power = one_way(sensor.beam, *angles_deg(sensor_axes(sensor), away))
    return float(np.sum(echo[power >= 0.5]) / total)
