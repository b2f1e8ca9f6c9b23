"""The trade between speed and accuracy: rungs, what they cost and miss, and what a scene needs.

``choose`` and ``measure`` are loaded when they are first used::

    from sd2core import ladder

    choice = ladder.choose(mesh, sensor, tolerance=0.02)
    print(choice.summary)
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from sd2core.ladder.results import (
    Choice,
    Cost,
    Errors,
    Machine,
    Measurement,
    PlanResult,
    Reason,
    Spread,
)
from sd2core.ladder.rungs import Plan, reference_plan

if TYPE_CHECKING:
    from sd2core.ladder.carry_out import synthesizer_for
    from sd2core.ladder.choosing import choose
    from sd2core.ladder.measuring import measure

__all__ = [
    "Choice",
    "Cost",
    "Errors",
    "Machine",
    "Measurement",
    "Plan",
    "PlanResult",
    "Reason",
    "Spread",
    "choose",
    "measure",
    "reference_plan",
    "synthesizer_for",
]

_HOME = {"choose": "choosing", "measure": "measuring", "synthesizer_for": "carry_out"}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = value
    return value
