"""What a classifier is where nothing else is said; known without torch."""

from __future__ import annotations

MODELS = ("lstm", "s4")
"""The paper's network, and one of the denoiser's layers."""

WIDTH = 32
"""Units or channels of every layer (the paper's: 16)."""

DELAY_S = 0.5
"""So much of what follows a frame is seen before it is answered (the paper's: nothing)."""

LONGEST_DELAY_S = 5.0
