"""Virtual sensor, radar configuration and the velocity axis they share.

World frame = camera frame: x right, y down, z forward, metres. Radial velocity
is positive when approaching the sensor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error

SPEED_OF_LIGHT_MPS = 299_792_458.0

FARTHEST_M = 1e9
"""No sensor is farther from the camera: squares of ranges stay within single precision."""

_LOWEST_HZ, _HIGHEST_HZ = 1e8, 1e12
"""No radar that sees a body works outside; figures outside are in MHz or GHz."""

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class VelocityAxis:
    """Evenly spaced velocity bins over ``[-v_max_mps, v_max_mps]``, ascending.

    Parameters
    ----------
    bins : int
        Number of bins, at least 2.
    v_max_mps : float
        Outer edge of the last bin.
    """

    bins: int = 32
    v_max_mps: float = 2.0

    def __post_init__(self) -> None:
        if self.bins < 2:
            raise Sd2Error(f"The velocity axis has {self.bins} bins", "2 or more")
        if not (math.isfinite(self.v_max_mps) and self.v_max_mps > 0):
            raise Sd2Error(
                f"The velocity axis ends at {self.v_max_mps} m/s", "a positive velocity in m/s"
            )

    @property
    def bin_width_mps(self) -> float:
        """Width of one bin."""
        return 2.0 * self.v_max_mps / self.bins

    @property
    def edges_mps(self) -> NDArray[np.float64]:
        """Bin edges, shape (bins + 1,)."""
        return np.arange(self.bins + 1, dtype=np.float64) * self.bin_width_mps - self.v_max_mps

    @property
    def centres_mps(self) -> NDArray[np.float64]:
        """Bin centres, shape (bins,)."""
        return (np.arange(self.bins, dtype=np.float64) + 0.5) * self.bin_width_mps - self.v_max_mps

    def bin_of(self, velocity_mps: float) -> int | None:
        """Bin that holds a velocity, or None beyond the axis."""
        if not -self.v_max_mps <= velocity_mps <= self.v_max_mps:
            return None
        return min(int((velocity_mps + self.v_max_mps) / self.bin_width_mps), self.bins - 1)


@dataclass(frozen=True)
class VirtualSensor:
    """A radar placed in the camera frame.

    Parameters
    ----------
    position_m : tuple of 3 floats
        x right, y down, z forward; the camera is the origin.
    azimuth_deg, elevation_deg : float
        Direction of the boresight: azimuth to the right of the optical axis,
        elevation above the horizon. (0, 0) looks along +z.
    field_of_view_deg : float
        Full opening angle that is drawn; the body is assumed inside it.
    """

    position_m: Vector = (0.0, 0.0, 0.0)
    azimuth_deg: float = 0.0
    elevation_deg: float = 0.0
    field_of_view_deg: float = 90.0

    def __post_init__(self) -> None:
        position = tuple(float(value) for value in self.position_m)
        if len(position) != 3 or not all(abs(value) <= FARTHEST_M for value in position):
            raise Sd2Error(
                f"The sensor position is {self.position_m}",
                f"three finite numbers x, y, z in metres, up to {FARTHEST_M:g}",
            )
        object.__setattr__(self, "position_m", position)
        for name in ("azimuth_deg", "elevation_deg"):
            if not math.isfinite(getattr(self, name)):
                raise Sd2Error(f"The sensor's {name} is {getattr(self, name)}", "a finite angle")
        if not 0 < self.field_of_view_deg < 180:
            raise Sd2Error(
                f"The field of view is {self.field_of_view_deg} degrees", "between 0 and 180"
            )

    @property
    def boresight(self) -> Vector:
        """Unit vector along which the sensor looks."""
        return direction_from_angles(self.azimuth_deg, self.elevation_deg)


def direction_from_angles(azimuth_deg: float, elevation_deg: float) -> Vector:
    """Unit vector in the camera frame (x right, y down, z forward)."""
    azimuth, elevation = math.radians(azimuth_deg), math.radians(elevation_deg)
    return (
        math.sin(azimuth) * math.cos(elevation),
        -math.sin(elevation),
        math.cos(azimuth) * math.cos(elevation),
    )


def position_from_spherical(
    target_m: Vector, range_m: float, azimuth_deg: float, elevation_deg: float
) -> Vector:
    """Sensor position at a range and angle as seen from a target.

    Azimuth 0, elevation 0 is on the target's camera side, straight along the
    optical axis; azimuth turns to the right in the image, elevation upwards.
    """
    towards = direction_from_angles(180.0 - azimuth_deg, elevation_deg)
    return (
        target_m[0] + range_m * towards[0],
        target_m[1] + range_m * towards[1],
        target_m[2] + range_m * towards[2],
    )


def spherical_from_position(target_m: Vector, position_m: Vector) -> tuple[float, float, float]:
    """Inverse of :func:`position_from_spherical`: ``(range_m, azimuth_deg, elevation_deg)``."""
    dx, dy, dz = (p - t for p, t in zip(position_m, target_m, strict=True))
    range_m = math.hypot(dx, dy, dz)
    if range_m == 0.0:
        return (0.0, 0.0, 0.0)
    azimuth_deg = math.degrees(math.atan2(dx, -dz)) if (dx or dz) else 0.0
    elevation_deg = math.degrees(math.atan2(-dy, math.hypot(dx, dz)))
    return (range_m, azimuth_deg, elevation_deg)


def aimed_at(sensor: VirtualSensor, target_m: Vector) -> VirtualSensor:
    """The same sensor with its boresight through a target; unchanged on the target itself."""
    dx, dy, dz = (t - p for t, p in zip(target_m, sensor.position_m, strict=True))
    if dx == dy == dz == 0.0:
        return sensor
    return replace(
        sensor,
        azimuth_deg=math.degrees(math.atan2(dx, dz)) if (dx or dz) else 0.0,
        elevation_deg=math.degrees(math.atan2(-dy, math.hypot(dx, dz))),
    )


@dataclass(frozen=True)
class RadarConfig:
    """A sawtooth FMCW radar with real sampling.

    Parameters
    ----------
    start_frequency_hz, end_frequency_hz : float
        Swept while the samples of one chirp are taken.
    samples_per_chirp, chirps_per_frame, receivers : int
    chirp_repetition_s, frame_repetition_s : float
    sample_rate_hz : float
    adc_bits : int
        Resolution of the converter.
    name : str
        What to call this radar on screen.

    Notes
    -----
    Derived limits after M. A. Richards, *Fundamentals of Radar Signal
    Processing*, and V. Winkler, "Range Doppler detection for automotive FMCW
    radars" (EuMC 2007): v_max = lambda / (4 T_c), dv = lambda / (2 N T_c),
    dR = c / (2 B), R_max = dR * samples / 2 for real samples.
    """

    start_frequency_hz: float
    end_frequency_hz: float
    samples_per_chirp: int
    chirps_per_frame: int
    chirp_repetition_s: float
    frame_repetition_s: float
    sample_rate_hz: float
    receivers: int = 1
    adc_bits: int = 12
    name: str = field(default="FMCW radar", compare=False)

    def __post_init__(self) -> None:
        for key in (
            "start_frequency_hz",
            "end_frequency_hz",
            "chirp_repetition_s",
            "frame_repetition_s",
            "sample_rate_hz",
        ):
            value = getattr(self, key)
            if not (math.isfinite(value) and value > 0):
                raise Sd2Error(f"The radar's {key} is {value}", "a positive number")
        if not self.end_frequency_hz > self.start_frequency_hz:
            raise Sd2Error(
                f"The chirp ends at {self.end_frequency_hz:g} Hz"
                f" and starts at {self.start_frequency_hz:g} Hz",
                "an end frequency above the start frequency",
            )
        if self.start_frequency_hz < _LOWEST_HZ or self.end_frequency_hz > _HIGHEST_HZ:
            raise Sd2Error(
                f"The radar sweeps from {self.start_frequency_hz:g} Hz"
                f" to {self.end_frequency_hz:g} Hz",
                "radar frequencies, between 100 MHz and 1 THz",
                "State them in Hz: 60 GHz is 60e9",
            )
        for key, least in (
            ("samples_per_chirp", 2),
            ("chirps_per_frame", 2),
            ("receivers", 1),
            ("adc_bits", 1),
        ):
            if getattr(self, key) < least:
                raise Sd2Error(f"The radar's {key} is {getattr(self, key)}", f"{least} or more")
        if self.chirps_per_frame * self.chirp_repetition_s > self.frame_repetition_s * (1 + 1e-9):
            raise Sd2Error(
                f"{self.chirps_per_frame} chirps of {self.chirp_repetition_s:g} s do not fit into"
                f" a frame of {self.frame_repetition_s:g} s",
                "chirps_per_frame * chirp_repetition_s <= frame_repetition_s",
            )

    @property
    def bandwidth_hz(self) -> float:
        """Swept during the samples of one chirp."""
        return self.end_frequency_hz - self.start_frequency_hz

    @property
    def centre_frequency_hz(self) -> float:
        """Middle of the sweep."""
        return 0.5 * (self.start_frequency_hz + self.end_frequency_hz)

    @property
    def slope_hz_per_s(self) -> float:
        """Chirp slope."""
        return self.bandwidth_hz * self.sample_rate_hz / self.samples_per_chirp

    @cached_property
    def wavelength_m(self) -> float:
        """At the centre frequency."""
        return SPEED_OF_LIGHT_MPS / self.centre_frequency_hz

    @property
    def v_max_mps(self) -> float:
        """Largest unambiguous radial velocity."""
        return self.wavelength_m / (4.0 * self.chirp_repetition_s)

    @property
    def velocity_resolution_mps(self) -> float:
        """Width of one Doppler bin."""
        return 2.0 * self.v_max_mps / self.chirps_per_frame

    @property
    def range_resolution_m(self) -> float:
        """Width of one range bin."""
        return SPEED_OF_LIGHT_MPS / (2.0 * self.bandwidth_hz)

    @property
    def range_max_m(self) -> float:
        """Largest range before the beat frequency folds."""
        return self.range_resolution_m * self.samples_per_chirp / 2.0


PAPER_RADAR = RadarConfig(
    # The paper states 60 GHz, 64 chirps, 32 samples and 30 frames/s. Sweep and
    # repetition are ours: 250 MHz reaches past the 6 m placement of its Fig. 4
    # (R_max 9.6 m), 390.625 us reaches past the 2 m/s axis (v_max 3.2 m/s).
    start_frequency_hz=59.875e9,
    end_frequency_hz=60.125e9,
    samples_per_chirp=32,
    chirps_per_frame=64,
    chirp_repetition_s=390.625e-6,
    frame_repetition_s=1.0 / 30.0,
    sample_rate_hz=2e6,
    name="60 GHz, 64 chirps, 32 samples, 30 frames/s",
)
