"""Accelerations and turn rates that a sensor feels on a known path.

An accelerometer feels Rᵀ (p̈ + g u): R turns the sensor's axes into the world's, p is its place, u
points upwards and g is 9.81 m/s². At rest it reads g upwards, in free fall nothing. A gyroscope
feels the turn rate ω of Ṙ = R [ω]×, about the sensor's own axes (D. Titterton, J. Weston,
Strapdown Inertial Navigation Technology, 2004, chapter 3).

Places and unit quaternions of R pass a zero-phase low pass, then a quintic spline through them is
differentiated in closed form; decision 65 compares that with differences.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sd2core.body.rotations import Floats
from sd2core.denoise.resample_to_model import clips
from sd2core.errors import Sd2Error
from sd2core.sensor import Vector
from sd2core.timebase import Timebase

GRAVITY_MPS2 = 9.81
"""Acceleration of gravity g."""

UP: Vector = (0.0, -1.0, 0.0)
"""Upwards in the world, whose y axis points down, for a camera that is held level."""

MIN_FRAMES = 6
"""Frames on end from which something is known: as many as a quintic spline needs."""

_USUAL_CUTOFF_HZ = 6.0
_USUAL_SHARE = 5.0
"""Frames per second, over the highest usual cut-off."""
_HIGHEST_SHARE = 0.45
"""Highest cut-off, over the frame rate: nothing above half of it is in the frames."""
_ORDER = 4
_EVEN = 1e-3
"""Share of a frame duration by which frames may come early or late and still be evenly spaced."""
_SETTLED = 8.0
"""Periods of the cut-off by which a stretch is continued at its ends to filter it."""


@dataclass(frozen=True, eq=False)
class InertialSignals:
    """Samples of an accelerometer and a gyroscope, about the sensor's own axes x, y, z.

    Parameters
    ----------
    times_s : float64 array, shape (N,)
        Increasing.
    acceleration_mps2 : float64 array, shape (N, 3)
        As an accelerometer gives it, with gravity: at rest it points upwards. NaN where not known.
    turn_rate_radps : float64 array, shape (N, 3)
        Right-handed. NaN where not known.
    meta : dict
        Origin, axes and options, as JSON can hold them.

    Raises
    ------
    Sd2Error
        When the shapes do not fit, times do not increase, or a value is infinite.
    """

    times_s: NDArray[np.float64]
    acceleration_mps2: Floats
    turn_rate_radps: Floats
    meta: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        times_s = Timebase(self.times_s).times_s
        object.__setattr__(self, "times_s", times_s)
        for name in ("acceleration_mps2", "turn_rate_radps"):
            values = np.asarray(getattr(self, name), np.float64)
            if values.shape != (len(times_s), 3):
                raise Sd2Error(
                    f"{name} has shape {values.shape}", f"({len(times_s)}, 3): three axes per time"
                )
            if np.isinf(values).any():
                row = int(np.argwhere(np.isinf(values))[0, 0])
                raise Sd2Error(f"{name} is infinite at {times_s[row]:g} s", "finite values, or NaN")
            object.__setattr__(self, name, values)

    @property
    def simulated(self) -> bool:
        """True if they say that no sensor measured them."""
        return self.meta.get("simulated") is True

    def between(self, start: int, stop: int) -> InertialSignals:
        """Samples from one index to another, the last excluded."""
        part = slice(start, stop)
        return replace(
            self,
            times_s=self.times_s[part],
            acceleration_mps2=self.acceleration_mps2[part],
            turn_rate_radps=self.turn_rate_radps[part],
        )

    @property
    def rate_hz(self) -> float:
        """Typical number of samples per second."""
        return Timebase(self.times_s).frames_per_s

    @property
    def channels(self) -> NDArray[np.float32]:
        """Accelerations, then turn rates, (N, 6)."""
        return np.hstack([self.acceleration_mps2, self.turn_rate_radps]).astype(np.float32)

    @property
    def known(self) -> NDArray[np.bool_]:
        """Samples that are known, (N,)."""
        both = np.isfinite(self.acceleration_mps2) & np.isfinite(self.turn_rate_radps)
        return np.asarray(both.all(axis=1))


@dataclass(frozen=True, eq=False)
class RigidPath:
    """Places and rotations of a rigid thing, frame by frame."""

    timebase: Timebase
    position_m: Floats  # (T, 3) in the world
    rotation: Floats  # (T, 3, 3) from its own axes to the world's
    present: NDArray[np.bool_]  # (T,) False where it is not known

    @property
    def stretches(self) -> list[tuple[int, int]]:
        """Half-open runs of frames on end that are long enough to be differentiated."""
        pieces = clips(self.timebase.times_s, self.present, self.timebase.frames_per_s)
        return [(start, stop) for start, stop in pieces if stop - start >= MIN_FRAMES]


def usual_cutoff_hz(frames_per_s: float) -> float:
    """Cut-off of the low pass unless another is asked for: 6 Hz, or a fifth of the frame rate.

    Examples
    --------
    >>> usual_cutoff_hz(120.0), usual_cutoff_hz(10.0)
    (6.0, 2.0)
    """
    return min(_USUAL_CUTOFF_HZ, frames_per_s / _USUAL_SHARE)


def imu_signals(
    path: RigidPath, times_s: ArrayLike, cutoff_hz: float | None = None, up: Vector = UP
) -> InertialSignals:
    """Acceleration and turn rate that an ideal sensor feels on a path.

    Parameters
    ----------
    path : RigidPath
        Every run of frames on end is differentiated by itself, nothing across a gap: frames
        without the body, or more than five frame durations between two. Frames that come unevenly
        are brought to an even rate by the same spline first.
    times_s : array_like, shape (N,)
        Times of the samples on the clock of the path.
    cutoff_hz : float, optional
        Frequency at which half of the amplitude is left; see :func:`usual_cutoff_hz`.
    up : tuple of 3 floats
        Direction upwards in the world, of any length.

    Returns
    -------
    InertialSignals
        NaN at times in a gap, outside of the path, and in runs of fewer than six frames.

    Raises
    ------
    Sd2Error
        When the cut-off is above 0.45 of the frame rate, or there is no direction upwards.

    Examples
    --------
    A turntable at 1 rad/s, the sensor 0.5 m from its axis: x points outwards, y upwards.

    >>> import numpy as np
    >>> from sd2core.timebase import Timebase
    >>> time = Timebase.regular(frames=300, frames_per_s=30)
    >>> c, s, zero = np.cos(time.times_s), np.sin(time.times_s), np.zeros(300)
    >>> turns = np.stack([c, zero, s, zero, zero - 1, zero, s, zero, -c], axis=1)
    >>> turns = turns.reshape(-1, 3, 3)
    >>> path = RigidPath(time, 0.5 * turns[:, :, 0], turns, np.ones(300, bool))
    >>> one = imu_signals(path, [5.0])
    >>> print(*np.round(one.acceleration_mps2[0], 3) + 0.0)
    -0.5 9.81 0.0
    >>> print(*np.round(one.turn_rate_radps[0], 3) + 0.0)
    0.0 1.0 0.0
    """
    rate_hz = path.timebase.frames_per_s
    cutoff_hz = usual_cutoff_hz(rate_hz) if cutoff_hz is None else cutoff_hz
    if not 0 < cutoff_hz <= _HIGHEST_SHARE * rate_hz:
        raise Sd2Error(
            f"The cut-off is {cutoff_hz:g} Hz, of {rate_hz:.4g} frames/s",
            f"above 0, up to {_HIGHEST_SHARE * rate_hz:.4g} Hz",
            "Motion that is faster is not in these frames",
        )
    upwards = unit_up(up)
    wanted_s = Timebase(times_s).times_s
    acceleration, turn_rate = np.full((2, len(wanted_s), 3), np.nan)
    for start, stop in path.stretches:
        own_s = path.timebase.times_s[start:stop]
        first, last = np.searchsorted(wanted_s, own_s[[0, -1]] + [-1e-6, 1e-6])
        if first == last:
            continue
        at_s = np.clip(wanted_s[first:last], own_s[0], own_s[-1])
        moved = path.position_m[start:stop], path.rotation[start:stop]
        acceleration[first:last], turn_rate[first:last] = _felt_on_end(
            own_s, *moved, at_s, cutoff_hz, GRAVITY_MPS2 * upwards
        )
    meta = {"cutoff_hz": float(cutoff_hz), "gravity_mps2": GRAVITY_MPS2, "up": upwards.tolist()}
    return InertialSignals(wanted_s, acceleration, turn_rate, meta)


def unit_up(up: Vector) -> Floats:
    """Direction upwards as a unit vector; Sd2Error if it is none."""
    vector = np.asarray(up, np.float64)
    length = np.linalg.norm(vector)
    if vector.shape != (3,) or not (np.isfinite(length) and length > 0):
        raise Sd2Error(f"Upwards is {up}", "three numbers, not all of them zero, such as 0,-1,0")
    return np.asarray(vector / length)


def low_pass(values: Floats, rate_hz: float, cutoff_hz: float) -> Floats:
    """Low pass of columns (T, n) that delays nothing; half of the amplitude at the cut-off.

    A Butterworth filter of fourth order, run forwards and backwards. A parabola passes as it is.
    """
    from scipy.signal import butter, sosfiltfilt

    sections = butter(_ORDER, cutoff_hz, fs=rate_hz, output="sos")
    parabola = _parabola(values)
    values = values - parabola
    beyond = min(round(_SETTLED * rate_hz / cutoff_hz), len(values) - 1)
    continued = np.concatenate(
        [
            _before(values, beyond, rate_hz, cutoff_hz),
            values,
            _before(values[::-1], beyond, rate_hz, cutoff_hz)[::-1],
        ]
    )
    filtered = sosfiltfilt(sections, continued, axis=0, padtype=None)
    return np.asarray(filtered[beyond : beyond + len(values)] + parabola)


def _parabola(values: Floats) -> Floats:
    """Parabolas nearest to columns (T, n), by least squares."""
    powers = np.vander(np.linspace(-1.0, 1.0, len(values)), 3)
    return np.asarray(powers @ np.linalg.lstsq(powers, values, rcond=None)[0])


def _before(values: Floats, count: int, rate_hz: float, cutoff_hz: float) -> Floats:
    """Values (count, n) that continue a stretch before its start.

    They are mirrored through its first value, which keeps the slope, and bent as the parabola
    through its first period of the cut-off: without that the acceleration would end at zero.
    """
    near = min(max(round(rate_hz / cutoff_hz), _ORDER) + 1, len(values))
    bend = np.diff(_parabola(values[:near])[:3], n=2, axis=0)  # (1, n)
    steps = np.arange(count, 0, -1.0)[:, None]
    return np.asarray(2.0 * values[0] - values[count:0:-1] + bend * steps**2)


def _felt_on_end(
    times_s: Floats,
    position_m: Floats,
    rotation: Floats,
    wanted_s: Floats,
    cutoff_hz: float,
    gravity_mps2: Floats,
) -> tuple[Floats, Floats]:
    """Acceleration and turn rate (N, 3) within frames on end."""
    from scipy.interpolate import make_interp_spline
    from scipy.spatial.transform import Rotation

    # In the middle of the motion, where less of the digits is lost.
    values = np.concatenate([position_m - position_m.mean(axis=0), _quaternions(rotation)], axis=1)
    steps = round(float(times_s[-1] - times_s[0]) / Timebase(times_s).frame_duration_s)
    even_s = np.linspace(times_s[0], times_s[-1], max(steps + 1, MIN_FRAMES))
    step_s = even_s[1] - even_s[0]
    if len(even_s) != len(times_s) or np.abs(times_s - even_s).max() > _EVEN * step_s:
        values = make_interp_spline(times_s, values, 5)(even_s)  # (T, 7)
    values = low_pass(values, 1.0 / step_s, cutoff_hz)
    curve = make_interp_spline(even_s, values, 5)
    turns, turning = curve(wanted_s)[:, 3:], curve(wanted_s, 1)[:, 3:]  # (N, 4)
    turned, real = turns[:, :3], turns[:, 3:]
    # The vector part of 2 q* q̇ for a quaternion of any length.
    turn_rate = real * turning[:, :3] - turning[:, 3:] * turned - np.cross(turned, turning[:, :3])
    turn_rate *= 2.0 / np.square(turns).sum(axis=1, keepdims=True)
    acceleration = curve(wanted_s, 2)[:, :3] + gravity_mps2
    return Rotation.from_quat(turns).inv().apply(acceleration), turn_rate


def _quaternions(rotation: Floats) -> Floats:
    """Unit quaternions (T, 4), the real part last, without jumps between q and -q."""
    from scipy.spatial.transform import Rotation

    quaternions = Rotation.from_matrix(rotation).as_quat()
    same = (quaternions[1:] * quaternions[:-1]).sum(axis=1) >= 0
    quaternions[1:] *= np.cumprod(np.where(same, 1.0, -1.0))[:, None]
    return np.asarray(quaternions)
