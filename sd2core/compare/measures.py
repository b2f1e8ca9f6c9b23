"""Measures of a comparison, and meshes and Doppler maps made alike for it.

Velocities are those that the Doppler chain takes: the exact change of range over the
central difference, one-sided at the two ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sd2core.doppler import PRESETS, Synthesizer
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap
from sd2core.mesh.presence import Presence
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.map_accuracy import relative_l1
from sd2core.options.synthesis import HowCounted
from sd2core.progress import Progress, silent
from sd2core.scattering.resampling import SAME_S
from sd2core.scattering.velocity import moments, radial_velocity
from sd2core.sensor import VirtualSensor

Floats = NDArray[np.float64]

_MIN_FRAMES = 4


def line_of_sight_velocity(
    positions_m: NDArray[Any],
    times_s: Floats,
    sensor_m: ArrayLike = (0.0, 0.0, 0.0),
    presence: Presence | None = None,
) -> Floats:
    """Velocity (T, N) towards a sensor in m/s, positive when approaching.

    The velocity is 0 where nothing can be measured.

    Parameters
    ----------
    positions_m : ndarray, (T, N, 3)
        Paths of N points; T is 2 at least.
    times_s : float64 ndarray, (T,)
        Times of the frames.
    sensor_m : array-like, (3,)
        Place of the sensor; by default the camera.
    presence : Presence, optional
        Nothing is measured from one stretch with a person to another; by default all frames are
        one.
    """
    stencil = moments(times_s, np.arange(len(times_s)), 1, presence)
    paths = np.ascontiguousarray(np.swapaxes(positions_m, 1, 2), dtype=np.float64)  # (T, 3, N)
    return radial_velocity(
        paths[stencil.before[:, 0]], paths[stencil.after[:, 0]], sensor_m, stencil.duration_s
    )


def rms(values: NDArray[Any]) -> float:
    """Root of the mean square; 0 of nothing."""
    return float(np.sqrt(np.mean(np.square(values, dtype=np.float64)))) if np.size(values) else 0.0


def correlation(values: NDArray[Any], truth: NDArray[Any]) -> float:
    """Pearson's correlation over all elements; 1 for equals, NaN where either is constant."""
    if not np.size(values):
        return float("nan")
    a, b = (np.asarray(one, np.float64).ravel() for one in (values, truth))
    if np.array_equal(a, b):
        return 1.0
    a, b = a - a.mean(), b - b.mean()
    norm = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / norm if norm > 0 else float("nan")


def jitter(positions_m: NDArray[Any], times_s: Floats, presence: Presence | None = None) -> Floats:
    """RMS over time of the third difference of the path (T, N, 3), per joint: shape (N,).

    Metres per frame cubed, times the cube of the typical frame rate: m/s³ of evenly timed
    frames. 0 for fewer than four frames. No difference reaches from one stretch with a
    person to another.
    """
    third = np.diff(positions_m, 3, axis=0) / np.median(np.diff(times_s)) ** 3
    if presence is not None:
        third = third[(presence.first[3:] == presence.first[:-3]) & presence.present[3:]]
    if not len(third):
        return np.zeros(positions_m.shape[1])
    return np.asarray(np.sqrt((third**2).sum(axis=-1).mean(axis=0)))


def common_times(meshes: Sequence[MeshSequence], reference: int = 0) -> NDArray[np.float64]:
    """The reference's frame times within the stretch that all meshes cover.

    Raises Sd2Error if fewer than four frames are left.
    """
    times = meshes[reference].times_s
    first = max(float(mesh.times_s[0]) for mesh in meshes) - SAME_S
    last = min(float(mesh.times_s[-1]) for mesh in meshes) + SAME_S
    within: NDArray[np.float64] = times[(times >= first) & (times <= last)]
    if len(within) < _MIN_FRAMES:
        spans = ", ".join(f"{mesh.times_s[0]:.2f} to {mesh.times_s[-1]:.2f} s" for mesh in meshes)
        raise Sd2Error(
            f"The meshes have {len(within)} frames in common ({spans})",
            f"{_MIN_FRAMES} or more",
            "Give meshes of the same video; --fps places the frames of a file that has no times",
        )
    return within


def synthesize_alike(
    meshes: Sequence[MeshSequence],
    sensor: VirtualSensor,
    progress: Progress = silent,
    count: HowCounted = "plain",
) -> tuple[DopplerMap, ...]:
    """Doppler maps of all meshes by the paper's preset.

    Hidden vertices are left out where every mesh has faces; otherwise all vertices of
    all meshes count, so that none is compared with another kind of map.

    Parameters
    ----------
    meshes : sequence of MeshSequence
        A map is made of each, in order.
    sensor : VirtualSensor
        Of all maps.
    progress : Progress
        Counts the frames of all meshes; may raise Cancelled.
    count : {"plain", "expected"}
        Whether a vertex counts in one bin, or is spread as badly as its velocity is known.
    """
    options = replace(PRESETS["paper"], count=count)
    if any(mesh.faces is None for mesh in meshes):
        options = replace(options, visibility="none")
    total = sum(mesh.frame_count for mesh in meshes)
    maps, done = [], 0
    for mesh in meshes:
        before = done
        maps.append(
            Synthesizer(mesh, options).map(
                sensor,
                progress=lambda frames, _, before=before: progress(  # type: ignore[misc]
                    before + frames, total
                ),
            )
        )
        done += mesh.frame_count
    return tuple(maps)


def map_l1(values: DopplerMap, reference: DopplerMap) -> float:
    """Sum of absolute differences of two maps of one shape over the sum of the reference.

    0 when both are empty, infinite when only the reference is.
    """
    return relative_l1(values.values.astype(np.float64), reference.values.astype(np.float64))
