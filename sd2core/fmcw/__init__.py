"""FMCW radar: raw samples to Doppler maps, and raw samples from a mesh."""

from __future__ import annotations

from sd2core.fmcw.chain import ProcessingOptions
from sd2core.fmcw.link import LinkBudget
from sd2core.fmcw.live import LiveMap
from sd2core.fmcw.options import Mirror, Reflector, SignalOptions, WaveOptions
from sd2core.fmcw.processing import RangeDoppler, doppler_map, limits, range_doppler
from sd2core.fmcw.reference import Converged, converged_frame, doppler_marginal
from sd2core.fmcw.signal import capture_scene, simulate_capture
from sd2core.fmcw.simulation import simulate_radar
from sd2core.fmcw.spectra import frame_spectra, signal_spectra, velocity_response

__all__ = [
    "Converged",
    "LinkBudget",
    "LiveMap",
    "Mirror",
    "ProcessingOptions",
    "RangeDoppler",
    "Reflector",
    "SignalOptions",
    "WaveOptions",
    "capture_scene",
    "converged_frame",
    "doppler_map",
    "doppler_marginal",
    "frame_spectra",
    "limits",
    "range_doppler",
    "signal_spectra",
    "simulate_capture",
    "simulate_radar",
    "velocity_response",
]
