"""Accuracy against speed: plans, their measured cost and error, and the plan a scene needs.

Functions are loaded when they are first used::

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
    from sd2core.accuracy.cache import cached_measurement, store_measurement
    from sd2core.accuracy.choosing import choose
    from sd2core.accuracy.measuring import measure
    from sd2core.accuracy.survey import survey_scene
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
    "cached_measurement",
    "choose",
    "measure",
    "reference_plan",
    "store_measurement",
    "survey_scene",
    "synthesizer_for",
]

_HOME = {
    "cached_measurement": "cache",
    "choose": "choosing",
    "measure": "measuring",
    "store_measurement": "cache",
    "survey_scene": "survey",
    "synthesizer_for": "trial",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = value
    return value
