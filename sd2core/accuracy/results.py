"""What the ladder measured, and what it chose: records for tables, plots and files."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import Any

from sd2core.accuracy.plans import AccuracyPlan, Family

_LEAST_PERCENT = 1e-3


def percent(share: float) -> str:
    """A share with two figures; whole above 10 %, and not more than a map can tell below.

    Infinite is what changes an empty map.
    """
    value = 100 * share
    if value == 0:
        return "0 %"
    if value == float("inf"):
        return "∞ %"
    if value < _LEAST_PERCENT:
        return f"<{_LEAST_PERCENT:g} %"
    return f"{value:.0f} %" if value >= 9.95 else f"{value:.2g} %"


@dataclass(frozen=True)
class Spread:
    """Of a quantity over frames, or over repeated runs."""

    median: float
    p95: float


@dataclass(frozen=True)
class Errors:
    """How far a plan's map is from the reference map of the same frames.

    Parameters
    ----------
    l1 : float
        Relative L1 of all frames together, after smoothing: sum of absolute
        differences over the sum of the reference. What a tolerance is about.
    l1_raw : float
        The same before smoothing, which hides errors.
    l1_frames, l1_raw_frames : Spread
        Relative L1 of single frames.
    peak_mps, mean_mps : Spread
        Absolute error of the strongest bin's velocity, and of the mean velocity
        weighted by the map.
    wrong_bins : Spread
        Share of a frame's energy that lies in wrong bins (total variation of the
        frame's distribution over velocity).
    frames : int
        How many frames, counted for each side from which a kept mask was tried. Those
        in which hardly anything moves are left out of the figures of single frames.
    """

    l1: float
    l1_raw: float
    l1_frames: Spread
    l1_raw_frames: Spread
    peak_mps: Spread
    mean_mps: Spread
    wrong_bins: Spread
    frames: int


@dataclass(frozen=True)
class Cost:
    """What a plan takes per frame once the clip is prepared, for a new sensor place.

    Parameters
    ----------
    one_thread_ms, all_cores_ms : Spread
        Median and 95th percentile of repeated runs, taken in turns with those
        of the other plans. Milliseconds per frame; the first is the thread's
        own processor time, which other programs do not disturb.
    peak_bytes : int
        Most memory allocated at once while the sampled frames were worked out.
    setup_s : float
        Once per clip: decimating and preparing the sampled frames.
    """

    one_thread_ms: Spread
    all_cores_ms: Spread
    peak_bytes: int
    setup_s: float


@dataclass(frozen=True)
class PlanResult:
    """A plan, what it costs here, and how far it is off here."""

    plan: AccuracyPlan
    errors: Errors
    cost: Cost

    def to_json(self) -> dict[str, Any]:
        """Plain content, with the plan also in words."""
        return asdict(self) | {"text": str(self.plan)}


@dataclass(frozen=True)
class Machine:
    """What costs depend on."""

    processor: str
    cores: int
    version: str

    def __str__(self) -> str:
        return f"{self.processor}, {self.cores} cores"


@dataclass(frozen=True)
class Measurement:
    """Cost and error of many plans on one scene and machine.

    Parameters
    ----------
    family : {"histogram", "fmcw"}
    reference : AccuracyPlan
        In words: what the errors are relative to.
    results : tuple of PlanResult
        Cheapest first.
    scene : str
        Fingerprint of mesh, sensor and options.
    frames : tuple of int
        Frames of the clip that were sampled.
    source : str
        Name of the mesh.
    convergence : tuple of (int, float)
        FMCW: pieces per facet of the reference sum, and by how much the map
        changed from the level before.
    stale : bool
        Scene or machine are no longer those.
    """

    family: Family
    reference: AccuracyPlan
    results: tuple[PlanResult, ...]
    scene: str
    machine: Machine
    frames: tuple[int, ...]
    source: str = ""
    convergence: tuple[tuple[int, float], ...] = ()
    stale: bool = field(default=False, compare=False)

    @property
    def front(self) -> tuple[PlanResult, ...]:
        """The Pareto front: no other plan is both cheaper and nearer; cheapest first."""
        best: list[PlanResult] = []
        for result in sorted(self.results, key=lambda r: (r.cost.all_cores_ms.median, r.errors.l1)):
            if not best or result.errors.l1 < best[-1].errors.l1:
                best.append(result)
        return tuple(best)

    def to_json(self) -> dict[str, Any]:
        """Plain content, with plans also in words."""
        return asdict(self) | {"results": [result.to_json() for result in self.results]}

    def of(self, plan: AccuracyPlan) -> PlanResult | None:
        """What was measured of a plan, if it was; else of the same with velocities wrapped."""
        wrapped = replace(plan, beyond="wrap")
        found = {result.plan: result for result in self.results}
        return found.get(plan) or found.get(wrapped)


@dataclass(frozen=True)
class Reason:
    """Why a rung was chosen, in words with numbers.

    Parameters
    ----------
    rung : str
        "occlusion", "static", "range_law", "aliasing", "motion", "mask_age",
        "mask_reuse", "geometry" or "weight".
    modelled : bool
        Whether the scene requires it, so that the plan contains it.
    value : float
        The number that decided: a relative change of the map, or a share.
    text : str
        One sentence without a full stop.
    """

    rung: str
    modelled: bool
    value: float
    text: str


@dataclass(frozen=True)
class Choice:
    """The cheapest plan that holds a tolerance, or the most accurate within a budget.

    Parameters
    ----------
    holds : bool
        Whether tolerance or budget is held; otherwise the plan is the best that
        can be had.
    errors : Errors
        On the frames to check on.
    cost_ms : float
        Milliseconds per frame when all cores share the work: a forecast from the
        processor time of its parts, measured while choosing.
    tolerance : float or None
        Relative L1 after smoothing that was asked for.
    budget_ms : float or None
        Milliseconds per frame that were allowed.
    spent_s : float
        How long the choosing took.
    unseen : bool
        Whether the errors are of frames that were not used to choose: a clip of fewer
        than ten frames has none to spare.
    """

    plan: AccuracyPlan
    holds: bool
    errors: Errors
    cost_ms: float
    reasons: tuple[Reason, ...]
    tolerance: float | None
    budget_ms: float | None
    spent_s: float
    unseen: bool = True

    @property
    def summary(self) -> str:
        """One line: the plan, its measured error and cost."""
        cost = f"{self.cost_ms:.2g} ms per frame"
        if self.holds:
            return f"{self.plan}: off by {percent(self.errors.l1)}, {cost}"
        # However little that is: the tolerance may be less.
        found = f"{self.plan}: off by {100 * self.errors.l1:.2g} %, {cost}"
        if self.tolerance is not None:
            return f"No plan holds {100 * self.tolerance:g} %; the best is {found}"
        return f"No plan keeps within {self.budget_ms:g} ms per frame; the fastest is {found}"

    def to_json(self) -> dict[str, Any]:
        """Plain content, for provenance and programs."""
        return asdict(self) | {"text": str(self.plan), "summary": self.summary}
