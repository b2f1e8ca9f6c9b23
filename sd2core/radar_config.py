"""FMCW radar configuration and the limits that follow from it."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any, Literal, get_args

from sd2core.errors import Sd2Error

SPEED_OF_LIGHT_MPS = 299_792_458.0

Clutter = Literal["none", "mean", "regression", "moving"]
"""Ways of taking out static echoes, see :class:`~sd2core.fmcw.ProcessingOptions`."""

CLUTTER: Clutter = "regression"
"""Filter of the maps of recordings and campaigns, where nobody chooses another."""

Sampling = Literal["real", "complex", "complex with image band"]
"""Samples of one mixer, of an I/Q mixer, or of one whose negative frequencies hold no echoes."""

_LOWEST_HZ, _HIGHEST_HZ = 1e8, 1e12
"""Limits of radar frequencies; values outside were probably meant in MHz or GHz."""


@dataclass(frozen=True)
class RadarConfig:
    """A radar whose frames are bursts of chirps: sawtooth FMCW, pulsed, or a continuous wave.

    Parameters
    ----------
    start_frequency_hz, end_frequency_hz : float
        Frequencies at the first and last sample of a chirp. Equal for a continuous wave, which
        has one complex sample per chirp and no range.
    chirps_per_frame : int
        Chirps of one transmitter.
    chirp_repetition_s : float
        Between two chirps of the same transmitter: transmitters that take turns (TDM) divide
        the largest velocity by their number.
    adc_bits : int
        Resolution of the converter.
    name : str
        Name of the radar on screen.
    sampling : {"real", "complex", "complex with image band"}
        With an image band, as with real samples, half of the beat frequencies hold echoes.
    transmitters : int
        Transmitters that take turns.
    ranges_m : tuple of float
        Distances of the samples of a radar that forms range itself, such as a pulsed one;
        start and end frequency are then those of a pulse of this range resolution. Empty: range
        follows from the beat frequency.

    Notes
    -----
    Derived limits after M. A. Richards, *Fundamentals of Radar Signal
    Processing*, and V. Winkler, "Range Doppler detection for automotive FMCW
    radars" (EuMC 2007): v_max = lambda / (4 T_c), dv = lambda / (2 N T_c),
    dR = c / (2 B), R_max = dR * samples / 2 for real samples, twice that for complex ones.
    A continuous wave has neither dR nor R_max: both are infinite.

    Examples
    --------
    >>> from dataclasses import replace
    >>> import sd2core as sd2
    >>> wide = replace(sd2.PAPER_RADAR, end_frequency_hz=60.875e9)
    >>> round(wide.range_resolution_m, 3), round(wide.v_max_mps, 2)
    (0.15, 3.18)
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
    sampling: Sampling = "real"
    transmitters: int = 1
    ranges_m: tuple[float, ...] = ()

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
        if self.sampling not in get_args(Sampling):
            raise Sd2Error(
                f"The radar's sampling is {self.sampling!r}",
                f"one of {', '.join(get_args(Sampling))}",
            )
        self._check_sweep()
        if self.start_frequency_hz < _LOWEST_HZ or self.end_frequency_hz > _HIGHEST_HZ:
            raise Sd2Error(
                f"The radar sweeps from {self.start_frequency_hz:g} Hz"
                f" to {self.end_frequency_hz:g} Hz",
                "radar frequencies, between 100 MHz and 1 THz",
                "State them in Hz: 60 GHz is 60e9",
            )
        for key, least in (
            ("samples_per_chirp", 2 if self.has_beat else 1),
            ("chirps_per_frame", 2),
            ("receivers", 1),
            ("transmitters", 1),
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

    def _check_sweep(self) -> None:
        """Raise Sd2Error for frequencies and samples that contradict each other."""
        if self.ranges_m and not (
            len(self.ranges_m) == self.samples_per_chirp
            and all(math.isfinite(one) for one in self.ranges_m)
            and self.sampling == "complex"
        ):
            raise Sd2Error(
                f"The radar has {self.samples_per_chirp} {self.sampling} samples at"
                f" {len(self.ranges_m)} distances",
                "complex samples, and a finite distance in metres for each",
            )
        if self.is_continuous:
            if self.samples_per_chirp != 1 or self.sampling != "complex":
                raise Sd2Error(
                    f"The chirp starts and ends at {self.start_frequency_hz:g} Hz, with"
                    f" {self.samples_per_chirp} {self.sampling} samples",
                    "an end frequency above the start frequency, or one complex sample per chirp:"
                    " a continuous wave",
                )
        elif not self.end_frequency_hz > self.start_frequency_hz:
            raise Sd2Error(
                f"The chirp ends at {self.end_frequency_hz:g} Hz"
                f" and starts at {self.start_frequency_hz:g} Hz",
                "an end frequency above the start frequency",
            )

    def as_dict(self) -> dict[str, Any]:
        """Fields as JSON holds them, without those that describe a plain FMCW radar as such."""
        content = asdict(self)
        for name, plain in (("sampling", "real"), ("transmitters", 1), ("ranges_m", ())):
            if content[name] == plain:
                del content[name]
        return content

    @property
    def is_continuous(self) -> bool:
        """True for a continuous wave, which tells no ranges apart."""
        return self.end_frequency_hz == self.start_frequency_hz

    @property
    def has_beat(self) -> bool:
        """True if range is in the beat frequency of the samples of a chirp."""
        return not (self.is_continuous or self.ranges_m)

    @property
    def channels(self) -> int:
        """Number of pairs of transmitter and receiver."""
        return self.transmitters * self.receivers

    @property
    def bandwidth_hz(self) -> float:
        """Bandwidth swept during the samples of one chirp."""
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
        """Wavelength at the centre frequency."""
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
        return math.inf if self.is_continuous else SPEED_OF_LIGHT_MPS / (2.0 * self.bandwidth_hz)

    @property
    def range_max_m(self) -> float:
        """Largest range before the beat frequency folds, or the last distance."""
        if self.ranges_m:
            return max(self.ranges_m)
        share = 1.0 if self.sampling == "complex" else 0.5
        return share * self.range_resolution_m * self.samples_per_chirp


def range_in_words(range_m: float, digits: int = 1) -> str:
    """Range or resolution in metres; that of a continuous wave is none.

    Examples
    --------
    >>> from sd2core.radar_config import range_in_words
    >>> range_in_words(9.594), range_in_words(float("inf"))
    ('9.6 m', 'none')
    """
    return f"{range_m:.{digits}f} m" if math.isfinite(range_m) else "none"


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
"""Radar of the paper, as far as it is published.

Examples
--------
>>> import sd2core as sd2
>>> round(sd2.PAPER_RADAR.velocity_resolution_mps, 2), round(sd2.PAPER_RADAR.range_max_m, 1)
(0.1, 9.6)
"""
