"""Radars by name, to simulate: typical settings of known devices, and carriers without range.

Each is one of many settings that its device can be given; what holds for the device are its
band, its way of sampling and its converter. Nothing here was compared with hardware, but for the
paper's radar and the BGT60, whose recordings this program reads.

Sources: Infineon, *BGT60TR13C* data sheet (57 to 63 GHz, 12 bits, 2 MHz); Texas Instruments,
*IWR6843* (60 to 64 GHz), *IWR1443* and *AWR1843* (76 to 81 GHz) data sheets: complex samples;
Acconeer, *A121* data sheet (60.5 GHz, pulsed); ITU Radio Regulations, article 5 (24 to 24.25 GHz
and 5.725 to 5.875 GHz for industry, science and medicine); IEEE 802.11 (channels around 2.44 and
5.25 GHz).
"""

from __future__ import annotations

from sd2core.plug_ins import Group
from sd2core.radar_config import PAPER_RADAR, SPEED_OF_LIGHT_MPS, RadarConfig
from sd2core.sensor import Beam

PAPER = "paper"
"""Name of the paper's radar."""

_UNVERIFIED = "unverified against hardware"


_SWEEPS = {
    # name, first and last Hz, samples, chirps, v_max in m/s, frames/s, samples/s
    "bgt60": ("Infineon BGT60, 61 GHz", 60.5e9, 61.5e9, 64, 64, 3.1, 30.0, 2e6),
    "iwr6843": ("TI IWR6843, 60 to 64 GHz", 60.25e9, 63.25e9, 128, 64, 3.5, 20.0, 4e6),
    "iwr1443": ("TI IWR1443 or AWR1843, 77 to 81 GHz", 77.25e9, 80.25e9, 128, 64, 3.5, 20.0, 4e6),
    # Range is formed by a sweep as wide as a pulse of profile 3 (0.14 m); its shape is not that of
    # the pulse.
    "a121": ("Acconeer A121, 60.5 GHz, as a sweep", 59.965e9, 61.035e9, 32, 32, 3.0, 25.0, 2e6),
    "k-band": ("24 GHz, K band", 24.0e9, 24.25e9, 64, 64, 3.1, 15.0, 1e6),
}
_CARRIERS = {
    # name, Hz, samples, frames/s
    "cw-5.8ghz": ("5.8 GHz", 5.8e9, 32, 10.0),
    "wifi-5ghz": ("Wi-Fi carrier at 5.25 GHz", 5.25e9, 32, 10.0),
    "wifi-2.4ghz": ("Wi-Fi carrier at 2.44 GHz", 2.44e9, 32, 5.0),
}
_READ = {"bgt60"}
"""Whose recordings this program reads."""


def _sweep(
    name: str,
    first_hz: float,
    last_hz: float,
    samples: int,
    chirps: int,
    v_max_mps: float,
    frames_per_s: float,
    sample_rate_hz: float,
    *,
    read: bool,
) -> RadarConfig:
    """FMCW radar whose chirps follow one another as v_max asks, λ / (4 v_max)."""
    wavelength_m = 2.0 * SPEED_OF_LIGHT_MPS / (first_hz + last_hz)
    return RadarConfig(
        start_frequency_hz=first_hz,
        end_frequency_hz=last_hz,
        samples_per_chirp=samples,
        chirps_per_frame=chirps,
        chirp_repetition_s=wavelength_m / (4.0 * v_max_mps),
        frame_repetition_s=1.0 / frames_per_s,
        sample_rate_hz=sample_rate_hz,
        adc_bits=12 if read else 16,
        name=name if read else f"{name} ({_UNVERIFIED})",
        sampling="real" if read else "complex",
    )


def _carrier(name: str, carrier_hz: float, samples: int, frames_per_s: float) -> RadarConfig:
    """Doppler of a carrier: complex samples of a continuous wave, without gaps."""
    sample_s = 1.0 / (samples * frames_per_s)
    return RadarConfig(
        start_frequency_hz=carrier_hz,
        end_frequency_hz=carrier_hz,
        samples_per_chirp=1,
        chirps_per_frame=samples,
        chirp_repetition_s=sample_s,
        frame_repetition_s=1.0 / frames_per_s,
        sample_rate_hz=1.0 / sample_s,
        adc_bits=16,
        name=f"{name}, continuous wave, no range ({_UNVERIFIED})",
        sampling="complex",
    )


RADARS: dict[str, RadarConfig] = {
    PAPER: PAPER_RADAR,
    **{name: _sweep(*row, read=name in _READ) for name, row in _SWEEPS.items()},
    **{name: _carrier(*row) for name, row in _CARRIERS.items()},
}
"""Radars by name.

Examples
--------
>>> from sd2core.radar_profiles import RADARS
>>> round(1e3 * RADARS["wifi-2.4ghz"].wavelength_m), RADARS["wifi-2.4ghz"].is_continuous
(123, True)
"""

BEAMS: dict[str, Beam] = {"iwr1443": Beam(56.0, 28.0)}
"""Beams of the antennas on some radars' boards, where their maker states them.

Texas Instruments, *IWR1443BOOST* user's guide: half power at ±28° across and ±14° in height.
"""

RADAR_PLUG_INS = Group("radars", RadarConfig, RADARS)
"""Radars by name of other packages."""


def find_radar(name: str) -> RadarConfig | None:
    """Radar of this name, of the program or of a plug-in; None if there is none.

    Raises Sd2Error for a plug-in that cannot be used.
    """
    if name in RADARS:
        return RADARS[name]
    plug_in = RADAR_PLUG_INS.find(name)
    return None if plug_in is None else plug_in.load()
