"""Plans, errors and costs in words, the same wherever they are shown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sd2app.accuracy.measurements import cheapest_within, serves_at_rest
from sd2app.widgets.text import milliseconds, seconds
from sd2core.numerics.map_accuracy import MapAccuracy, percent

if TYPE_CHECKING:
    from sd2core.accuracy.plans import AccuracyPlan
    from sd2core.accuracy.results import Measurement, PlanResult


@dataclass(frozen=True)
class InUse:
    """Plan in use with its error and cost."""

    plan: AccuracyPlan
    error: float  # relative L1 after smoothing, as measured on this scene
    cost_ms: float  # per frame, on all cores
    clicked: bool = False  # a point of the plot, not chosen by tolerance or budget
    elsewhere: bool = False  # measured with the sensor at another place
    body: float | None = None  # likewise, of a fitted body; None: its mesh states none
    pending: bool = False  # the body's is of another place, until it is found for this one

    @property
    def accuracy(self) -> str:
        """How far the map may be from the truth."""
        return f"{MapAccuracy(self.body, self.error)}{'…' if self.pending else ''}"

    def __str__(self) -> str:
        text = f"{self.plan} · {self.accuracy} · {milliseconds(self.cost_ms)}/frame"
        return f"{text} (measured elsewhere)" if self.elsewhere else text


def chosen_sentence(in_use: InUse, frames: int) -> str:
    """One sentence of the plan in use: its error, and its cost per frame and for the clip."""
    way = "Clicked" if in_use.clicked else "Chosen"
    body = "" if in_use.body is None else f" – {in_use.accuracy} with the body –"
    return (
        f"{way}: {short(in_use.plan)}, whose map is {percent(in_use.error)} off the reference{body}"
        f" and costs {milliseconds(in_use.cost_ms)} per frame,"
        f" {seconds(1e-3 * in_use.cost_ms * frames)} for the clip."
    )


def legend(measurement: Measurement, tolerance: float, *, in_use: bool) -> str:
    """Signs of the plot and what they stand for, as far as they are there."""
    counting = measurement.family == "histogram"
    signs = []
    if in_use:
        signs.append("◉ chosen" if counting else "◉ in use")
    if counting:
        if cheapest_within(measurement, tolerance) is not None:
            signs.append("◇ cheapest measured within the tolerance")
        if not all(map(serves_at_rest, measurement.results)):
            signs.append("○ only while dragging")
    return "   ".join(sign.replace(" ", "\N{NO-BREAK SPACE}") for sign in signs)


def short(plan: AccuracyPlan) -> str:
    """Short description of a plan: visibility, masks, geometry, time."""
    sight = plan.visibility
    words = [f"visibility {sight}"]
    if sight in ("depth", "none"):
        words = [f"depth {plan.depth_resolution}" if sight == "depth" else "all vertices"]
    if plan.mask_stride > 1:
        words.append(f"mask every {plan.mask_stride} frames")
    if plan.vertices_kept < 1:
        words.append(f"{percent(plan.vertices_kept)} of the vertices")
    if plan.frame_rate_factor > 1:
        words.append(f"frame rate × {plan.frame_rate_factor}")
    if plan.left_out:
        words.append(f"without {', '.join(plan.left_out)}")
    return " · ".join(words)


def point_text(result: PlanResult) -> str:
    """Plan, errors and cost of a point of the plot, one fact a line."""
    errors, cost = result.errors, result.cost
    memory = "" if cost.peak_bytes is None else f"{cost.peak_bytes / 2**20:.0f} MiB at most, "
    return "\n".join(
        (
            str(result.plan),
            f"Error {percent(errors.l1)} after smoothing, {percent(errors.l1_raw)} before",
            f"Peak velocity off by {errors.peak_mps.median:.2g} m/s"
            f" (95 % of frames within {errors.peak_mps.p95:.2g} m/s)",
            f"{percent(errors.wrong_bins.median)} of the energy in wrong bins",
            f"{milliseconds(cost.all_cores_ms.median)} per frame on all cores,"
            f" {milliseconds(cost.one_thread_ms.median)} on one thread",
            f"{memory}{seconds(cost.setup_s)} once per clip",
        )
    )
