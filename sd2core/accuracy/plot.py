"""The trade as a picture: error against cost of every plan."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sd2core.accuracy.results import Choice, Measurement, PlanResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FLOOR = 1e-5
"""Errors below this, among them 0, are drawn here: the axis is logarithmic."""

_MARKS = {"none": "x", "facing": "^", "depth": "s", "exact": "o"}
_COLOURS = {"none": "#888888", "facing": "#b35806", "depth": "#2166ac", "exact": "#1b7837"}


def plot_trade(measurement: Measurement, choice: Choice | None = None) -> Figure:
    """Log-log scatter of error after smoothing against milliseconds per frame.

    Parameters
    ----------
    choice : Choice, optional
        Marked, with its tolerance as a line.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 4.5), dpi=120, layout="constrained")
    axes = figure.add_subplot()
    for visibility, mark in _MARKS.items():
        shown = [r for r in measurement.results if r.plan.visibility == visibility]
        if shown:
            style: dict[str, Any] = {"marker": mark, "color": _COLOURS[visibility]}
            axes.scatter(*_places(shown), s=22, alpha=0.8, label=visibility, **style)
    cost_ms, error = _places(measurement.front)
    axes.step(cost_ms, error, where="post", color="black", linewidth=1, label="Pareto front")
    if choice is not None:
        _mark(axes, measurement, choice)
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="cost on all cores (ms per frame)",
        ylabel="relative L1 after smoothing",
        title=f"{measurement.source}, {measurement.machine}",
    )
    axes.grid(which="both", alpha=0.2)
    axes.legend(title="visibility", fontsize=8)
    return figure


def _places(results: tuple[PlanResult, ...] | list[PlanResult]) -> tuple[list[float], list[float]]:
    return (
        [result.cost.all_cores_ms.median for result in results],
        [max(result.errors.l1, FLOOR) for result in results],
    )


def _mark(axes: Axes, measurement: Measurement, choice: Choice) -> None:
    if choice.tolerance is not None:
        axes.axhline(choice.tolerance, color="#c51b7d", linewidth=1, linestyle="--")
    chosen = measurement.of(choice.plan)
    cost_ms = chosen.cost.all_cores_ms.median if chosen is not None else choice.cost_ms
    place = cost_ms, max(choice.errors.l1, FLOOR)
    axes.scatter(*place, s=130, facecolors="none", edgecolors="#c51b7d", label="chosen")
