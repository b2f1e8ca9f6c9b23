"""Defaults of gesture classifiers, for the command line too, whose help loads no NumPy."""

from __future__ import annotations

MODELS = ("lstm", "s4")
"""The paper's network, and one of the denoiser's S4 layers."""

WIDTH = 32
"""Units or channels of every layer (the paper's: 16)."""

DELAY_S = 0.5
"""Frames of so many seconds after a frame are seen before its answer (the paper's: none)."""

LONGEST_DELAY_S = 5.0
