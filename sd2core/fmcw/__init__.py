"""FMCW radar: raw samples to Doppler maps, and raw samples from a mesh."""

from __future__ import annotations

from sd2core.fmcw.chain import ProcessingOptions
from sd2core.fmcw.link import LinkBudget
from sd2core.fmcw.live import LiveMap
from sd2core.fmcw.options import Mirror, Reflector, SignalOptions, WaveOptions
from sd2core.fmcw.processing import RangeDoppler, doppler_map, limits, range_doppler
from sd2core.fmcw.simulation import simulate_radar
from sd2core.fmcw.spectra import frame_spectra

__all__ = [
    "LinkBudget",
    "LiveMap",
    "Mirror",
    "ProcessingOptions",
    "RangeDoppler",
    "Reflector",
    "SignalOptions",
    "WaveOptions",
    "doppler_map",
    "frame_spectra",
    "limits",
    "range_doppler",
    "simulate_capture",
    "simulate_radar",
]

simulate_capture = simulate_radar
"""Name in earlier versions."""
