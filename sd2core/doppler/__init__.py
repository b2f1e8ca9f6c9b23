"""Synthetic Doppler maps of a moving mesh, by counting vertices per velocity bin."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from sd2core.doppler.options import PRESETS, SynthesisOptions

if TYPE_CHECKING:
    from sd2core.doppler.synthesizer import FrameScattering, MapFrames, Synthesizer

__all__ = ["PRESETS", "FrameScattering", "MapFrames", "SynthesisOptions", "Synthesizer"]


def __getattr__(name: str) -> Any:
    # Loaded when used: it brings numba, and the command line's --help only needs the presets.
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.synthesizer"), name)
