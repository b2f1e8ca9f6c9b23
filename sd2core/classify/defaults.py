"""Defaults of gesture classifiers, for the command line too, whose help loads no NumPy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, get_args

from sd2core.options.bounds import Bounds

if TYPE_CHECKING:
    from sd2core.runs.pace import Kind

Model = Literal["lstm", "s4", "kernel"]
MODELS: tuple[Model, ...] = get_args(Model)
"""The paper's network, one of the denoiser's S4 layers, and one in closed form for few data."""

FeatureKind = Literal["columns", "peak"]
"""What is seen of a frame, see :mod:`sd2core.classify.features`."""

WIDTH = 32
"""Units or channels of every layer (the paper's: 16)."""

WIDTHS = Bounds(1, 1024, whole=True)

DELAY_S = 0.5
"""Frames of so many seconds after a frame are seen before its answer (the paper's: none)."""

DELAYS_S = Bounds(0.0, 5.0)


def pace_kind(model: str, features: str, width: int) -> Kind:
    """Kind of work whose items are steps of a training, see :mod:`sd2core.runs.pace`."""
    return ("classify train", model, features, width)
