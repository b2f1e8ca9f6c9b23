"""Options of a simulated FMCW signal: propagation, surface, antennas, surroundings, receiver."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.fmcw.link import LinkBudget
from sd2core.mesh.walls import Wall
from sd2core.radar_config import RadarConfig
from sd2core.scattering.beam import sensor_axes
from sd2core.sensor import Vector, VirtualSensor

Model = Literal["nufft", "direct"]
Motion = Literal["constant", "interpolated"]

CONCRETE = -0.39
"""Reflection at normal incidence, (1 - sqrt e) / (1 + sqrt e) with e = 5.24 for concrete
(Recommendation ITU-R P.2040, valid from 1 to 100 GHz)."""


@dataclass(frozen=True)
class Mirror:
    """Reflecting plane, a floor or wall, modelled by an image of the sensor."""

    point_m: Vector  # Any point of the plane, camera frame.
    normal: Vector  # Normal of the plane; length and side do not matter.
    reflection: float = CONCRETE  # Amplitude coefficient, from -1 to 1; the same for every angle.

    def __post_init__(self) -> None:
        values = (*self.point_m, *self.normal)
        if len(values) != 6 or not all(map(math.isfinite, values)) or not any(self.normal):
            raise Sd2Error(
                f"The plane is given by the point {self.point_m} and the normal {self.normal}",
                "three finite numbers each, and a normal that is not zero",
            )
        if not -1 <= self.reflection <= 1:
            raise Sd2Error(f"The reflection coefficient is {self.reflection}", "-1 to 1")

    @classmethod
    def of(cls, wall: Wall) -> Mirror:
        """A wall of the scene."""
        x, y, z = wall.outward.tolist()
        away_m = wall.distance_m
        amplitude = -(10.0 ** (-0.05 * wall.loss_db))
        return cls((away_m * x, away_m * y, away_m * z), (x, y, z), amplitude)

    @classmethod
    def ground(cls, y_m: float, reflection: float = CONCRETE) -> Mirror:
        """A floor ``y_m`` below the camera."""
        return cls((0.0, y_m, 0.0), (0.0, 1.0, 0.0), reflection)

    @classmethod
    def wall(cls, z_m: float, reflection: float = CONCRETE) -> Mirror:
        """A wall across the optical axis, ``z_m`` in front of the camera."""
        return cls((0.0, 0.0, z_m), (0.0, 0.0, 1.0), reflection)


@dataclass(frozen=True)
class WaveOptions:
    """Options of the sum of echoes: model, surface, motion, antennas, mirror.

    Parameters
    ----------
    model : {"nufft", "direct"}
        ``direct`` sums every facet at every sample in complex128 (the
        reference); ``nufft`` is the same sum by a non-uniform FFT (Barnett,
        Magland, af Klinteberg, SIAM J. Sci. Comput. 41, 2019) with a relative
        error of 1e-9, once per block.
    blocks : int
        The ``nufft`` holds every facet's beat frequency over a block of chirps.
        More blocks follow the change of range within a frame (range migration:
        Richards, *Fundamentals of Radar Signal Processing*); with one block per
        chirp the sum is complete.
    coherent : bool
        True: a smooth surface. Physical optics on every facet: the closed-form
        mean of cos(theta) / R^2 exp(j phase) over it, curvature of the wave front
        to first order, followed through the frame as the facet turns.
        False: a rough one. Every facet has a random phase that stays with it,
        and the constant-gamma power gamma A cos(theta) / R^4 (Skolnik, *Radar
        Handbook*, ground echo), so that power does not depend on how finely the
        surface is cut; gamma is set so that a facet of lambda^2 / 4 seen square
        on echoes as it would smooth and small.
    motion : {"constant", "interpolated"}
        Within a frame: constant velocity (of frames over 1/30 s in pieces of up to
        1/60 s), or vertices interpolated at every chirp (cubic Hermite over the mesh's
        frames; the reference, one sum per chirp).
    receiver_offsets_m : tuple of positions
        Receivers relative to the transmitter, which is at the sensor, in the
        sensor's frame: x to its right, y down, z along the boresight. Empty:
        half a wavelength apart, to its left and right.
    beam_width_deg : float or None
        Full width at half power of every antenna's cos^n power pattern about
        the boresight, n = ln(1/2) / ln(cos(width / 2)); nothing behind it
        (Balanis, *Antenna Theory*). None: the sensor's own beam, or isotropic.
    mirror : Mirror or None
        Two-ray propagation: out and back each directly or by the image
        (Skolnik, *Introduction to Radar Systems*, propagation over a plane).
        Facets hidden from the sensor count as hidden from its image. A mesh with walls
        has none.
    """

    model: Model = "nufft"
    blocks: int = 1
    coherent: bool = True
    motion: Motion = "constant"
    receiver_offsets_m: tuple[Vector, ...] = ()
    beam_width_deg: float | None = None
    mirror: Mirror | None = None

    def __post_init__(self) -> None:
        for name, choices in (("model", get_args(Model)), ("motion", get_args(Motion))):
            if getattr(self, name) not in choices:
                raise Sd2Error(f"{name} is {getattr(self, name)!r}", f"one of {', '.join(choices)}")
        if self.blocks < 1:
            raise Sd2Error(f"blocks is {self.blocks}", "1 or more")
        for offset in self.receiver_offsets_m:
            if len(offset) != 3 or not all(map(math.isfinite, offset)):
                raise Sd2Error(f"A receiver is at {offset}", "three finite numbers in metres")
        if self.beam_width_deg is not None and not 0 < self.beam_width_deg < 180:
            raise Sd2Error(
                f"The beam is {self.beam_width_deg} degrees wide", "between 0 and 180 degrees"
            )

    @property
    def pattern_exponent(self) -> float:
        """N of the power pattern cos^n; 0 is isotropic."""
        if self.beam_width_deg is None:
            return 0.0
        return math.log(0.5) / math.log(math.cos(math.radians(0.5 * self.beam_width_deg)))


@dataclass(frozen=True)
class Reflector:
    """Static point reflector."""

    position_m: Vector  # Camera frame.
    area_m2: float  # Effective area: it echoes like a facet of this area seen square on.


@dataclass(frozen=True)
class SignalOptions:
    """Options of the static surroundings and of the receiver.

    Parameters
    ----------
    snr_db : float
        Mean power of the moving scene's samples over the whole recording
        against that of the thermal noise; ``inf`` for no noise.
    reflectors : tuple of Reflector
        Static clutter.
    peak_share : float
        Share of the converter's half range that the strongest sample without
        noise reaches: this sets the gain.
    seed : int
        Seed of the noise.
    link : LinkBudget, optional
        Sets gain and noise in place of ``snr_db`` and ``peak_share``: those of one
        receiver, whatever the scene, so that what is farther away is weaker.
    """

    snr_db: float = 10.0
    reflectors: tuple[Reflector, ...] = ()
    peak_share: float = 0.5
    seed: int = 0
    link: LinkBudget | None = None

    def __post_init__(self) -> None:
        if not self.snr_db > -math.inf:
            raise Sd2Error(f"snr_db is {self.snr_db}", "decibels, or inf for no noise")
        if not 0 < self.peak_share <= 1:
            raise Sd2Error(f"peak_share is {self.peak_share}", "a share above 0, up to 1")


@dataclass(frozen=True, eq=False)
class Antenna:
    """Antenna, or its image: position (3,), axes (3, 3) right, down and ahead, and amplitude."""

    position_m: NDArray[np.float64]
    axes: NDArray[np.float64]
    gain: float = 1.0
    plane: NDArray[np.float64] | None = None
    """Of an image: normal and offset of the mirror, (4,), positive on the antenna's own side."""

    def mirrored(self, mirror: Mirror) -> Antenna:
        """The image behind a plane; Sd2Error for an antenna in it."""
        normal = np.asarray(mirror.normal, dtype=np.float64)
        normal = normal / np.linalg.norm(normal)
        offset_m = -float(normal @ np.asarray(mirror.point_m))
        above_m = float(self.position_m @ normal) + offset_m
        if above_m == 0.0:
            raise Sd2Error(
                f"The sensor at {tuple(self.position_m.tolist())} lies in the reflecting plane",
                "a sensor on one side of it",
            )
        return Antenna(
            self.position_m - 2.0 * above_m * normal,
            self.axes - 2.0 * np.outer(self.axes @ normal, normal),
            self.gain * mirror.reflection,
            math.copysign(1.0, above_m) * np.array([*normal, offset_m]),
        )


Pairs = list[tuple[Antenna, Antenna]]
"""Transmitters and receivers, or their images, between which waves travel."""


def paths(
    sensor: VirtualSensor, config: RadarConfig, options: WaveOptions, walls: Iterable[Wall] = ()
) -> list[dict[Wall | None, Pairs]]:
    """Ways of the waves for every receiver: without the walls, and out or back by each of them.

    Raises Sd2Error when receivers are placed, but not as many as the radar has.
    """
    offsets = np.array(options.receiver_offsets_m, dtype=np.float64).reshape(-1, 3)
    if not options.receiver_offsets_m:
        steps = np.arange(config.receivers) - 0.5 * (config.receivers - 1)
        offsets = steps[:, None] * np.array([0.5 * config.wavelength_m, 0.0, 0.0])
    if len(offsets) != config.receivers:
        raise Sd2Error(
            f"{len(offsets)} receivers are placed, and the radar has {config.receivers}",
            "one offset per receiver",
        )
    axes = sensor_axes(sensor)
    centre = np.asarray(sensor.position_m)
    transmitters = _with_image(Antenna(centre, axes), options.mirror)
    per_receiver = []
    by_way_of = {wall: Mirror.of(wall) for wall in walls}
    for place in centre + offsets @ axes:
        receivers = _with_image(Antenna(place, axes), options.mirror)
        ways: dict[Wall | None, Pairs] = {
            None: [(out, back) for out in transmitters for back in receivers]
        }
        out, back = transmitters[0], receivers[0]
        for wall, mirror in by_way_of.items():
            ways[wall] = [(out.mirrored(mirror), back), (out, back.mirrored(mirror))]
        per_receiver.append(ways)
    return per_receiver


def _with_image(antenna: Antenna, mirror: Mirror | None) -> list[Antenna]:
    return [antenna] if mirror is None else [antenna, antenna.mirrored(mirror)]
