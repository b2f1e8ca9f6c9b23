"""The trade between speed and accuracy: rungs, what they cost and miss, and what a scene needs."""

from __future__ import annotations

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
    "reference_plan",
]
