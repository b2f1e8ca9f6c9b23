"""Raw samples of an FMCW radar from a moving scene by a simple path, to compare the program with.

Beat signal of one scatterer after M. A. Richards, *Fundamentals of Radar Signal
Processing*: cos(2 pi (f_c tau + S tau t)) with the round-trip delay tau, the
chirp's slope S and the time t from the middle of the chirp. Within a frame every
scatterer moves at constant velocity. Its range advances the phase from chirp to
chirp and within a chirp; the beat frequency is that of the frame's middle. The
residual video phase S tau^2 / 2 (0.002 turns at 2 m for the paper's radar) is
left out, as is multipath.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Literal

import numpy as np
from facet_scatterers import Scatterers, point_scatterers, scatterers_at
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.fmcw.converter import check_converter, digitise, simulated_capture
from sd2core.fmcw.options import SignalOptions
from sd2core.fmcw.scene import MeshScene, radar_times_s
from sd2core.io.radar.capture import RadarCapture
from sd2core.mesh.presence import runs
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import Progress, silent
from sd2core.radar_config import SPEED_OF_LIGHT_MPS, RadarConfig
from sd2core.sensor import VirtualSensor

_CHUNK = 4096
"""Scatterers per matrix product: their phasors stay in the cache."""


def simulate_capture(
    mesh: MeshSequence,
    config: RadarConfig,
    *,
    sensor: VirtualSensor | None = None,
    visibility: NDArray[np.bool_] | Literal["facing"] = "facing",
    options: SignalOptions | None = None,
    progress: Progress = silent,
) -> RadarCapture:
    """Simulate the raw samples of a moving mesh.

    Parameters
    ----------
    mesh : MeshSequence
        With faces.
    sensor : VirtualSensor
        At the camera by default.
    visibility : bool array, shape (T, F), or "facing"
        Per mesh frame, the facets that nothing hides from the sensor;
        ``facing`` takes all whose normal points towards it.
    progress : Progress
        Counts radar frames.

    Returns
    -------
    RadarCapture
        ``simulated``; frame k is at k times the frame repetition time after the
        mesh's first frame, the middle of its burst of chirps.
    """
    sensor = sensor or VirtualSensor()
    scene = MeshScene(mesh, config, sensor, visibility)
    times_s = radar_times_s(mesh.timebase, config)
    return capture_scene(
        partial(scatterers_at, scene),
        times_s,
        config,
        there=np.array([scene.is_present(time_s) for time_s in times_s.tolist()]),
        sensor=sensor,
        options=options,
        source=mesh.source,
        progress=progress,
    )


def capture_scene(
    scatterers_at: Callable[[float], Scatterers],
    times_s: NDArray[np.float64],
    config: RadarConfig,
    *,
    there: NDArray[np.bool_] | None = None,
    sensor: VirtualSensor | None = None,
    options: SignalOptions | None = None,
    source: str = "",
    progress: Progress = silent,
) -> RadarCapture:
    """Simulate the raw samples of any scene that is known at every radar frame.

    Parameters
    ----------
    scatterers_at : callable
        Time in seconds → :class:`~facet_scatterers.Scatterers`.
    times_s : float64 array, shape (frames,)
        Middle of every frame's burst of chirps, increasing.
    there : bool array, shape (frames,), optional
        False where there is no person; the signal-to-noise ratio is that of the others.

    Other parameters and the result are those of :func:`simulate_capture`.
    """
    sensor, options = sensor or VirtualSensor(), options or SignalOptions()
    check_converter(config)
    if config.sampling != "real":
        raise Sd2Error(f"{config.name} samples I and Q", "a radar with real samples")
    frames = len(times_s)
    shape = (frames, config.receivers, config.chirps_per_frame, config.samples_per_chirp)
    signal = np.empty(shape)
    for frame, time_s in enumerate(times_s):
        progress(frame, frames)
        signal[frame] = echo(scatterers_at(float(time_s)), config, sensor)
    there = np.ones(frames, bool) if there is None else there
    power = float(np.mean(signal[there] ** 2)) if there.any() else 0.0
    signal += _static(options, config, sensor)
    samples = np.empty(shape, np.uint16)
    levels = digitise(signal, float(np.abs(signal).max()), power, config, options, samples)
    progress(frames, frames)
    return simulated_capture(
        samples,
        config,
        times_s,
        source,
        sensor=sensor,
        options=options,
        levels=levels,
        nobody=runs(~there),
    )


def echo(scatterers: Scatterers, config: RadarConfig, sensor: VirtualSensor) -> NDArray[np.float64]:
    """Beat signal of one frame without noise, (receivers, chirps, samples).

    The transmitter is at the sensor; receivers stand half a wavelength apart to
    its left and right.
    """
    signal = np.zeros((config.receivers, config.chirps_per_frame, config.samples_per_chirp))
    # float64 throughout: rounding then stays far below one converter count, and
    # the quantised result does not depend on the machine's matrix product.
    carrier = 4.0 * np.pi / config.wavelength_m  # phase per metre of range
    slope = 4.0 * np.pi * config.slope_hz_per_s / SPEED_OF_LIGHT_MPS
    for start in range(0, len(scatterers.amplitude), _CHUNK):
        part = slice(start, start + _CHUNK)
        to_transmitter = _range_and_rate(scatterers, part, np.asarray(sensor.position_m))
        for receiver, position in enumerate(_receivers(config, sensor)):
            to_receiver = _range_and_rate(scatterers, part, position)
            range_m, rate_mps = (
                0.5 * (a + b) for a, b in zip(to_transmitter, to_receiver, strict=True)
            )
            per_chirp = carrier * config.chirp_repetition_s * rate_mps
            per_sample = (slope * range_m + carrier * rate_mps) / config.sample_rate_hz
            # Chirps are centred on the frame; samples start where the sweep does.
            first = carrier * range_m - 0.5 * (config.chirps_per_frame - 1) * per_chirp
            slow = _phasors(first, per_chirp, config.chirps_per_frame)
            first = -0.5 * config.samples_per_chirp * per_sample
            fast = _phasors(first, per_sample, config.samples_per_chirp)
            signal[receiver] += ((scatterers.amplitude[part] * slow) @ fast.T).real
    return signal


def _phasors(
    first_rad: NDArray[np.float64], step_rad: NDArray[np.float64], count: int
) -> NDArray[np.complex128]:
    """Phasors exp(j (first + k step)) for k < count, (count, n), by doubling."""
    phasors = np.empty((count, len(first_rad)), dtype=np.complex128)
    phasors[0] = np.exp(1j * first_rad)
    step = np.exp(1j * step_rad)
    done = 1
    while done < count:
        more = min(done, count - done)
        np.multiply(phasors[:more], step, out=phasors[done : done + more])
        step = step * step
        done += more
    return phasors


def _receivers(config: RadarConfig, sensor: VirtualSensor) -> NDArray[np.float64]:
    azimuth = math.radians(sensor.azimuth_deg)
    right = np.array([math.cos(azimuth), 0.0, -math.sin(azimuth)])
    steps = np.arange(config.receivers) - 0.5 * (config.receivers - 1)
    offset_m = steps[:, None] * (0.5 * config.wavelength_m * right)
    positions: NDArray[np.float64] = np.asarray(sensor.position_m) + offset_m
    return positions


def _range_and_rate(
    scatterers: Scatterers, part: slice, position_m: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Distance from a place and its rate of change."""
    away = scatterers.position_m[part] - position_m
    range_m = np.linalg.norm(away, axis=1)
    growth = np.einsum("ni,ni->n", away, scatterers.velocity_mps[part])
    return range_m, growth / np.maximum(range_m, 1e-9)


def _static(
    options: SignalOptions, config: RadarConfig, sensor: VirtualSensor
) -> NDArray[np.float64]:
    if not options.reflectors:
        return np.zeros((config.receivers, 1, 1))
    positions = [reflector.position_m for reflector in options.reflectors]
    areas = [reflector.area_m2 for reflector in options.reflectors]
    return echo(point_scatterers(positions, (0.0, 0.0, 0.0), areas, sensor), config, sensor)
