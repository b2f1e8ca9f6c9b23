"""FMCW radar: raw samples to Doppler maps, and raw samples from a mesh."""

from __future__ import annotations

from sd2core.fmcw.chain import ProcessingOptions
from sd2core.fmcw.processing import RangeDoppler, doppler_map, limits, range_doppler
from sd2core.fmcw.signal import Reflector, SignalOptions, capture_scene, simulate_capture

__all__ = [
    "ProcessingOptions",
    "RangeDoppler",
    "Reflector",
    "SignalOptions",
    "capture_scene",
    "doppler_map",
    "limits",
    "range_doppler",
    "simulate_capture",
]
