"""FMCW radar: raw samples to Doppler maps, and raw samples from a mesh."""

from __future__ import annotations

from sd2core.fmcw.processing import (
    ProcessingOptions,
    RangeDoppler,
    doppler_map,
    limits,
    range_doppler,
)

__all__ = ["ProcessingOptions", "RangeDoppler", "doppler_map", "limits", "range_doppler"]
