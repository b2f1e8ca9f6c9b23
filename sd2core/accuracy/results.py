"""Records of what was measured and chosen, errors between maps, and their plot."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sd2core.accuracy.plans import AccuracyPlan, Family
from sd2core.numerics.map_accuracy import percent, relative_l1
from sd2core.sensor import VelocityAxis

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Spread:
    """Median and 95th percentile of a quantity over frames, or over repeated runs."""

    median: float
    p95: float

    @classmethod
    def of(cls, values: NDArray[np.float64]) -> Spread:
        """Spread of some values; zeros if there are none."""
        if not values.size:
            return cls(0.0, 0.0)
        return cls(float(np.median(values)), float(np.percentile(values, 95)))


@dataclass(frozen=True)
class Errors:
    """Errors of a plan's map against the reference map of the same frames."""

    l1: float
    """Relative L1 of the whole map, after smoothing: sum of absolute differences over the sum of
    the reference. Where some frames tell of a clip, with the standard error of that. A tolerance
    limits this error."""
    l1_raw: float  # the same before smoothing, which hides errors, without a standard error
    l1_frames: Spread  # of single frames
    l1_raw_frames: Spread
    peak_mps: Spread  # absolute error of the strongest bin's velocity
    mean_mps: Spread  # absolute error of the mean velocity weighted by the map
    wrong_bins: Spread
    """Share of a frame's energy that lies in wrong bins (total variation of the frame's
    distribution over velocity)."""
    frames: int
    """Number of frames, counted for each side from which a kept mask was tried. Those in which
    hardly anything moves are left out of the figures of single frames."""


@dataclass(frozen=True)
class Cost:
    """Time and memory of a plan per frame, once the clip is prepared, for a new sensor place.

    Times are the median and the 95th percentile of repeated runs, taken in turns with those
    of the other plans, in milliseconds per frame.
    """

    one_thread_ms: Spread  # the thread's own processor time, which other programs do not disturb
    all_cores_ms: Spread
    peak_bytes: int | None
    """Most memory allocated at once while the sampled frames were computed; None: not measured."""
    setup_s: float  # once per clip: decimating and preparing the sampled frames


@dataclass(frozen=True)
class PlanResult:
    """Plan with its measured cost and errors."""

    plan: AccuracyPlan
    errors: Errors
    cost: Cost

    def to_json(self) -> dict[str, Any]:
        """Content for JSON, with the plan also in words."""
        return asdict(self) | {"text": str(self.plan)}


@dataclass(frozen=True)
class Machine:
    """Machine and program version that measured costs depend on."""

    processor: str
    cores: int
    version: str

    def __str__(self) -> str:
        return f"{self.processor}, {self.cores} cores"


@dataclass(frozen=True)
class Measurement:
    """Cost and error of many plans on one scene and machine."""

    family: Family
    reference: AccuracyPlan  # errors are relative to its map
    results: tuple[PlanResult, ...]  # cheapest first
    scene: str  # fingerprint of mesh, sensor and options
    machine: Machine
    frames: tuple[int, ...]  # of the clip that were sampled
    source: str = ""  # name of the mesh
    convergence: tuple[tuple[int, float], ...] = ()
    """FMCW: pieces per facet of the reference sum, and by how much the map changed from the level
    before."""
    stale: bool = field(default=False, compare=False)
    """True if scene or machine have changed since."""

    @property
    def front(self) -> tuple[PlanResult, ...]:
        """Pareto front, cheapest first: no other plan is both cheaper and more accurate."""
        best: list[PlanResult] = []
        for result in sorted(self.results, key=lambda r: (r.cost.all_cores_ms.median, r.errors.l1)):
            if not best or result.errors.l1 < best[-1].errors.l1:
                best.append(result)
        return tuple(best)

    def to_json(self) -> dict[str, Any]:
        """Content for JSON, with plans also in words."""
        return asdict(self) | {"results": [result.to_json() for result in self.results]}

    def of(self, plan: AccuracyPlan) -> PlanResult | None:
        """Result of a plan, or None."""
        return next((result for result in self.results if result.plan == plan), None)


@dataclass(frozen=True)
class Reason:
    """Reason for one setting of a plan, in words with numbers."""

    setting: str
    """One of occlusion, static, range_law, aliasing, motion, mask_age, mask_reuse, geometry,
    weight, beam, things, walls and people."""
    modelled: bool  # True if the scene requires it, so that the plan contains it
    value: float  # the number that decided: a relative change of the map, or a share
    text: str  # one sentence without a full stop


@dataclass(frozen=True)
class Choice:
    """Cheapest plan that holds a tolerance, or most accurate plan within a budget."""

    plan: AccuracyPlan
    holds: bool  # True if tolerance or budget is held; otherwise the plan is the best available
    errors: Errors
    cost_ms: float
    """Milliseconds per frame when all cores share the work: a forecast from the processor time of
    its parts, measured while choosing."""
    reasons: tuple[Reason, ...]
    tolerance: float | None  # requested relative L1 after smoothing
    budget_ms: float | None  # requested milliseconds per frame
    spent_s: float  # duration of the choice

    @property
    def summary(self) -> str:
        """Plan, measured error and cost in one line."""
        cost = f"{self.cost_ms:.2g} ms per frame"
        if self.holds:
            return f"{self.plan}: off by {percent(self.errors.l1)}, {cost}"
        # However little that is: the tolerance may be less.
        best = f"{self.plan}: off by {100 * self.errors.l1:.2g} %, {cost}"
        if self.tolerance is not None:
            return f"No plan holds {100 * self.tolerance:g} %; the best is {best}"
        return f"No plan keeps within {self.budget_ms:g} ms per frame; the fastest is {best}"

    def to_json(self) -> dict[str, Any]:
        """Content for JSON, with the plan also in words."""
        content = asdict(self) | {"text": str(self.plan), "summary": self.summary}
        for reason in content["reasons"]:
            # Programs that read the output of `sd2 ladder --json` know a setting by this name.
            reason["rung"] = reason.pop("setting")
        return content


_MOVING = 0.1
"""Frames with less than this share of the mean frame's energy have no figures of their own."""


def compute_errors(
    raw: NDArray[np.float64],
    reference_raw: NDArray[np.float64],
    smooth: NDArray[np.float64],
    reference_smooth: NDArray[np.float64],
    axis: VelocityAxis,
    weight: NDArray[np.float64] | float = 1.0,
) -> Errors:
    """Compare a map with its reference, before and after smoothing.

    A frame that is empty in the map but not in the reference has peak and mean velocity 0,
    and all its energy in wrong bins.

    Parameters
    ----------
    raw, reference_raw : ndarray, (bins, n)
        Map and reference before smoothing; no value is negative.
    smooth, reference_smooth : ndarray, (bins, n)
        The same frames after smoothing.
    axis : VelocityAxis
        Of both.
    weight : ndarray, (n,), or float
        Of each frame in the L1 of all together.
    """
    energy = reference_smooth.sum(axis=0)
    moving = (energy > 0) & (energy >= _MOVING * energy.mean())
    a, b = smooth[:, moving], reference_smooth[:, moving]  # (bins, k)
    share_a, share_b = shares(a), shares(b)
    centres_mps = axis.centres_mps
    mean_mps = np.abs(centres_mps @ share_a - centres_mps @ share_b)
    peak_mps = np.abs(_peaks(a, centres_mps) - _peaks(b, centres_mps))
    wrong = np.where(a.sum(axis=0) > 0, 0.5 * np.abs(share_a - share_b).sum(axis=0), 1.0)
    return Errors(
        l1=relative_l1(smooth * weight, reference_smooth * weight),
        l1_raw=relative_l1(raw * weight, reference_raw * weight),
        l1_frames=_per_frame(smooth, reference_smooth, moving),
        l1_raw_frames=_per_frame(raw, reference_raw, moving),
        peak_mps=Spread.of(peak_mps),
        mean_mps=Spread.of(mean_mps),
        wrong_bins=Spread.of(wrong),
        frames=raw.shape[1],
    )


def _per_frame(
    values: NDArray[np.float64], reference: NDArray[np.float64], moving: NDArray[np.bool_]
) -> Spread:
    total = reference[:, moving].sum(axis=0)
    difference = np.abs(values - reference)[:, moving].sum(axis=0)
    # Smoothing may bring energy into a frame that has none of its own.
    return Spread.of(difference[total > 0] / total[total > 0])


def shares(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Columns that add up to 1 each; those without energy stay zero."""
    total = values.sum(axis=0)
    return np.divide(values, total, out=np.zeros_like(values), where=total > 0)


def _peaks(values: NDArray[np.float64], centres_mps: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(values.sum(axis=0) > 0, centres_mps[values.argmax(axis=0)], 0.0)


FLOOR = 1e-5
"""Errors below this, among them 0, are drawn here: the axis is logarithmic."""

_MARKS = {"none": "x", "facing": "^", "depth": "s", "exact": "o"}
_COLOURS = {"none": "#888888", "facing": "#b35806", "depth": "#2166ac", "exact": "#1b7837"}


def plot_cost_and_error(measurement: Measurement, choice: Choice | None = None) -> Figure:
    """Plot error after smoothing against milliseconds per frame, both axes logarithmic.

    A choice is marked, with its tolerance as a line.
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
    # Within a decade or two the library names more ticks than there is room for.
    axes.xaxis.set_major_formatter(lambda ms, _: f"{ms:g}")
    axes.xaxis.set_minor_formatter(lambda ms, _: f"{ms:g}" if f"{ms:.0e}"[0] in "25" else "")
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
