"""Accuracy against speed: plans, their measured cost and error, and the plan a scene needs.

``choose`` and ``measure`` are loaded when they are first used::

    from sd2core import accuracy

    choice = accuracy.choose(mesh, sensor, tolerance=0.02)
    print(choice.summary)
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from sd2core.accuracy.plans import AccuracyPlan, reference_plan
from sd2core.accuracy.results import (
    Choice,
    Cost,
    Errors,
    Machine,
    Measurement,
    PlanResult,
    Reason,
    Spread,
)

if TYPE_CHECKING:
    from sd2core.accuracy.choosing import choose
    from sd2core.accuracy.measuring import measure
    from sd2core.accuracy.trial import synthesizer_for

__all__ = [
    "AccuracyPlan",
    "Choice",
    "Cost",
    "Errors",
    "Machine",
    "Measurement",
    "PlanResult",
    "Reason",
    "Spread",
    "choose",
    "measure",
    "reference_plan",
    "synthesizer_for",
]

_HOME = {"choose": "choosing", "measure": "measuring", "synthesizer_for": "trial"}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = value
    return value
