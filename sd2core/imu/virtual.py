"""A virtual inertial sensor on a moving mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sd2core.errors import Sd2Error, wanted
from sd2core.imu.mounting import mounted
from sd2core.imu.sensor_errors import with_errors
from sd2core.imu.signals import MIN_FRAMES, UP, InertialSignals, imu_signals, usual_cutoff_hz
from sd2core.mesh.sequence import MeshSequence
from sd2core.options.inertial import SensorErrors
from sd2core.progress import Progress, silent
from sd2core.sensor import Vector
from sd2core.timebase import Timebase
from sd2core.version import __version__

RATE_HZ = 100.0
_MAX_HZ = 10_000.0


def virtual_imu(
    mesh: MeshSequence,
    at: str | int,
    *,
    rate_hz: float = RATE_HZ,
    cutoff_hz: float | None = None,
    up: Vector = UP,
    errors: SensorErrors | None = None,
    progress: Progress = silent,
) -> InertialSignals:
    """Acceleration and turn rate of a sensor fixed to a moving mesh.

    Parameters
    ----------
    mesh : MeshSequence
        In metres, of one person. Its frames may come unevenly; in a gap nothing is known.
    at : str or int
        Place on the bundled body, such as ``"left-wrist"``, or the number of a vertex of any
        surface; see :func:`sd2core.imu.mounting.mounted`, also for the sensor's axes.
    rate_hz : float
        Samples per second, from the time of the first frame to that of the last.
    cutoff_hz : float, optional
        Cut-off of the low pass, see :func:`sd2core.imu.signals.imu_signals`; by default 6 Hz,
        or a fifth of the mesh's frame rate if that is lower.
    up : tuple of 3 floats
        Direction upwards in the world; by default that of a camera held level.
    errors : SensorErrors, optional
        Of the sensor; None: an ideal one.

    Returns
    -------
    InertialSignals
        NaN where nothing is known.

    Raises
    ------
    Sd2Error
        When the sensor cannot sit there, the mesh has no six frames on end with a body, or the
        rate is below twice the cut-off.

    Examples
    --------
    >>> import sd2core as sd2
    >>> from sd2core.files.resources import resource_path
    >>> mesh = sd2.load_mesh(resource_path("swipes.sd2") / "mesh.zarr")
    >>> wrist = sd2.virtual_imu(mesh, "right-wrist", rate_hz=100)
    >>> wrist.acceleration_mps2.shape, wrist.turn_rate_radps.shape
    ((1497, 3), (1497, 3))
    """
    wanted(mesh, MeshSequence, 'Read one with sd2.load_mesh("walk.npz")')
    if not 0 < rate_hz <= _MAX_HZ:
        raise Sd2Error(f"The rate is {rate_hz:g} Hz", f"above 0, up to {_MAX_HZ:,.0f} Hz")
    cutoff_hz = usual_cutoff_hz(mesh.timebase.frames_per_s) if cutoff_hz is None else cutoff_hz
    if rate_hz < 2 * cutoff_hz:
        raise Sd2Error(
            f"{rate_hz:g} samples per second, of motion up to {cutoff_hz:g} Hz",
            f"{2 * cutoff_hz:g} or more",
            "Raise --rate, or lower --cutoff",
        )
    mesh = mesh.body()
    start_s, end_s = mesh.times_s[[0, -1]]
    count = int(np.floor((end_s - start_s) * rate_hz + 1e-6)) + 1
    times = Timebase.regular(count, rate_hz, float(start_s))
    signals = _ideal(mesh, at, times, cutoff_hz, up, progress)
    return signals if errors is None else with_errors(signals, errors)


def imu_at_frames(mesh: MeshSequence, at: str | int) -> InertialSignals:
    """Signals of an ideal sensor at the times of the frames.

    The usual cut-off lets nothing pass that they do not hold.
    """
    cutoff_hz = usual_cutoff_hz(mesh.timebase.frames_per_s)
    return _ideal(mesh, at, mesh.timebase, cutoff_hz, UP, silent)


def _ideal(
    mesh: MeshSequence,
    at: str | int,
    times: Timebase,
    cutoff_hz: float,
    up: Vector,
    progress: Progress,
) -> InertialSignals:
    mounting = mounted(mesh, at, up)
    path = mounting.path(mesh, progress)
    if not path.stretches:
        raise Sd2Error(
            f"{mesh.source or 'The mesh'} has no {MIN_FRAMES} frames on end with a body",
            f"{MIN_FRAMES} at least",
        )
    signals = imu_signals(path, times.times_s, cutoff_hz, up)
    about = {
        "at": mounting.name,
        **({"person": mesh.person} if mesh.person else {}),
        "axes": mounting.axes,
        "rate_hz": round(times.frames_per_s, 6),
        "frames_per_s": round(mesh.timebase.frames_per_s, 6),
        "simulated": True,
        "source": mesh.source,
        "made_by": f"SD² Studio {__version__}",
    }
    return replace(signals, meta=about | signals.meta)
