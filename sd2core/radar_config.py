"""FMCW radar configuration and the limits that follow from it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

from sd2core.errors import Sd2Error

SPEED_OF_LIGHT_MPS = 299_792_458.0

Clutter = Literal["none", "mean", "regression", "moving"]
"""Ways of taking out static echoes, see :class:`~sd2core.fmcw.ProcessingOptions`."""

CLUTTER: Clutter = "regression"
"""Filter of the maps of recordings and campaigns, where nobody chooses another."""

_LOWEST_HZ, _HIGHEST_HZ = 1e8, 1e12
"""Limits of radar frequencies; values outside were probably meant in MHz or GHz."""


@dataclass(frozen=True)
class RadarConfig:
    """A sawtooth FMCW radar with real sampling.

    Parameters
    ----------
    start_frequency_hz, end_frequency_hz : float
        Frequencies at the first and last sample of a chirp.
    adc_bits : int
        Resolution of the converter.
    name : str
        Name of the radar on screen.

    Notes
    -----
    Derived limits after M. A. Richards, *Fundamentals of Radar Signal
    Processing*, and V. Winkler, "Range Doppler detection for automotive FMCW
    radars" (EuMC 2007): v_max = lambda / (4 T_c), dv = lambda / (2 N T_c),
    dR = c / (2 B), R_max = dR * samples / 2 for real samples.

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
"""Radar of the paper, as far as it is published.

Examples
--------
>>> import sd2core as sd2
>>> round(sd2.PAPER_RADAR.velocity_resolution_mps, 2), round(sd2.PAPER_RADAR.range_max_m, 1)
(0.1, 9.6)
"""
