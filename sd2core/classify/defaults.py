"""Defaults of gesture classifiers, for the command line too, whose help loads no NumPy."""

from __future__ import annotations

from argparse import ArgumentTypeError
from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal

from sd2core.denoise.registry import Architecture
from sd2core.options.bounds import Bounds
from sd2core.plug_ins import Group

if TYPE_CHECKING:
    from sd2core.runs.pace import Kind


FeatureKind = Literal["columns", "peak"]
"""What is seen of a frame, see :mod:`sd2core.classify.features`."""

WIDTH = 32
"""Units or channels of every layer (the paper's: 16)."""

WIDTHS = Bounds(1, 1024, whole=True)

DELAY_S = 0.5
"""Frames of so many seconds after a frame are seen before its answer (the paper's: none)."""

DELAYS_S = Bounds(0.0, 5.0)

ENTRIES: Mapping[str, Architecture] = {
    "lstm": Architecture(
        "sd2core.classify.models.LstmClassifier",
        "the paper's",
        {"width": WIDTH, "depth": 2, "dropout": 0.2},
    ),
    "s4": Architecture(
        "sd2core.classify.models.S4Classifier",
        "layers of the denoiser",
        {"width": WIDTH, "depth": 2, "state_size": 16, "dropout": 0.2},
    ),
    "kernel": Architecture(
        "sd2core.classify.kernel.KernelClassifier",
        "in closed form, for few data",
        # The frames follow from the delay.
        {"frames": 29, "references": 1024},
    ),
}
"""Classifiers of the program."""

MODELS = tuple(ENTRIES)

CLASSIFIERS = Group("classifiers", Architecture, ENTRIES)
"""Those, and classifiers of other packages."""


def model_names() -> tuple[str, ...]:
    """Names of all classifiers, those of plug-ins last."""
    return (*MODELS, *CLASSIFIERS.names())


def model_name(text: str) -> str:
    """Read the name of a classifier."""
    if text in CLASSIFIERS:
        return text
    raise ArgumentTypeError(f"{text!r} is none of {', '.join(model_names())}")


def pace_kind(model: str, features: str, width: int) -> Kind:
    """Kind of work whose items are steps of a training, see :mod:`sd2core.runs.pace`."""
    return ("classify train", model, features, width)
