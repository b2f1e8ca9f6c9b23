"""Makes ``accuracy-and-speed.md`` and its pictures: ``make accuracy``, about five minutes.

Every figure is measured when this runs. The walk is left out where the real
recordings are not there (``SD2_SHARED_DATA``).
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

from matplotlib.figure import Figure

from sd2core.accuracy.cache import this_machine
from sd2core.accuracy.choosing import choose
from sd2core.accuracy.measuring import measure
from sd2core.accuracy.plans import AccuracyPlan, reference_plan
from sd2core.accuracy.results import Measurement, plot_cost_and_error
from sd2core.accuracy.survey import survey_scene
from sd2core.doppler import PRESETS
from sd2core.files.figure_files import save_figure
from sd2core.files.resources import resource_path
from sd2core.io.mesh import load_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import warm_up
from sd2core.recording.recording import open_recording
from sd2core.sensor import VirtualSensor
from tools.documentation.measured import write_page
from tools.documentation.places import BENCHMARKS, IMAGES, SHARED

sys.path.insert(0, str(BENCHMARKS))
from precisions import costs, errors, in_both_precisions
from scaling import BUDGET_BYTES, Scaling, scalings

TOLERANCES = (0.2, 0.1, 0.05, 0.02, 0.01, 0.005)
PAPER = PRESETS["paper"]

NEARER = 0.6
"""A table shows the plans that have at most this share of the error of the one above."""

INTRODUCTION = """\
# Accuracy and speed

What does a Doppler map cost that is off by at most so much, and which plan computes it? Measured by

```
make accuracy
```

on {machine}, for two meshes: the bundled sample (simulated) and a walk (fitted to a real video). No
radar takes part. `sd2 ladder MESH` and the Accuracy panel measure the same on a
scene of one's own ([choose accuracy](how-to/choose-accuracy.md)).

**L1** is what [a tolerance](concepts/tolerance.md) is about. **Peak** is the error of a frame's
strongest bin that 95 % of the frames stay within. Times are per frame, on all cores. References are
*{counting}* in double precision, and
*{fmcw}*. Plans are named without
counting by vertex, which is common to them, and without what becomes of velocities beyond the axis.
A *mask kept* serves while the sensor is dragged.

Pictures show all plans. Tables begin with the cheapest, and go on with those that no other beats in
both cost and error and whose error is at most {nearer} of that above.
"""

LIMITS = """\
## What this cannot say

Maps of one mesh are compared. How well a mesh follows the person is in [fitting](fitting.md), how
near a map comes to a real radar's in [nulling](nulling.md) and [real pairs](real-pairs.md). Other
scenes may need other plans.
"""


def main() -> None:
    """Measure everything and write the page."""
    warm_up()
    introduction = INTRODUCTION.format(
        machine=this_machine(),
        counting=reference_plan("histogram"),
        fmcw=reference_plan("fmcw"),
        nearer=_percent(NEARER),
    )
    parts = [introduction]
    for name, title, mesh, sensor in _scenes():
        print(title, file=sys.stderr)
        parts += [f"## {title}\n", *_tolerances(mesh, sensor)]
        for family in ("histogram", "fmcw"):
            measurement = measure(mesh, sensor, family=family)  # type: ignore[arg-type]
            parts += _measured(measurement, f"trade-{name}-{family}.png")
    parts += _scaling()
    parts += [*_precision(), LIMITS]
    write_page("accuracy-and-speed.md", "\n".join(parts))


def _scenes() -> Iterator[tuple[str, str, MeshSequence, VirtualSensor]]:
    sample = open_recording(resource_path("swipes.sd2"))
    yield "sample", "The bundled sample (simulated gestures)", sample.load_mesh(), sample.sensor
    walk = SHARED / "mesh" / "walk.npz"
    if walk.exists():
        yield "walk", "A walk (mesh fitted to a real video)", load_mesh(walk), VirtualSensor()


def _tolerances(mesh: MeshSequence, sensor: VirtualSensor) -> Iterator[str]:
    """Cost of each tolerance on one scene."""
    survey = survey_scene(mesh, sensor, PAPER)
    yield "What a tolerance costs (times are forecast; errors are of frames not used to choose):\n"
    yield "| tolerance | plan | ms | L1 |"
    yield "|---|---|---|---|"
    for tolerance in TOLERANCES:
        choice = choose(mesh, sensor, tolerance=tolerance, survey=survey)
        held = "" if choice.holds else "not held: "
        yield (
            f"| {_percent(tolerance)} | {held}{_words(choice.plan)} | {choice.cost_ms:.2g}"
            f" | {_percent(choice.errors.l1)} |"
        )
    yield ""


def _measured(measurement: Measurement, picture: str) -> Iterator[str]:
    """Picture of all plans of a family, and table of the best."""
    save_figure(plot_cost_and_error(measurement), IMAGES / picture)
    what = {"histogram": "Counting", "fmcw": "FMCW signal"}[measurement.family]
    yield f"### {what}: the best of {len(measurement.results)} plans\n"
    yield f"![error against cost]({IMAGES.name}/{picture})\n"
    if measurement.convergence:
        pieces, change = measurement.convergence[-1]
        yield f"{pieces} pieces per facet changed the reference by {_percent(change)}.\n"
    yield "| plan | ms | L1 | peak, m/s |"
    yield "|---|---|---|---|"
    above = float("inf")
    for result in measurement.front:
        cost, errors = result.cost, result.errors
        if errors.l1 <= NEARER * above:
            above = errors.l1
            yield (
                f"| {_words(result.plan)} | {cost.all_cores_ms.median:.3g}"
                f" | {_percent(errors.l1)} | {errors.peak_mps.p95:.2g} |"
            )
    yield ""


def _scaling() -> Iterator[str]:
    found = [scaling for sight in ("facing", "exact") for scaling in scalings(sight)]
    save_figure(_scaling_plot(found), IMAGES / "scaling.png")
    yield "## Ten times as much\n"
    yield f"![cost and memory against size]({IMAGES.name}/scaling.png)\n"
    yield (
        "A simulated ellipsoid sways. *Growth* is the most that ten times the size cost; the budget"
        f" for prepared frames was {BUDGET_BYTES >> 20} MiB.\n"
    )
    yield "| what | sizes | growth | longest, s | most memory, MB |"
    yield "|---|---|---|---|---|"
    for scaling in found:
        first, last = scaling.points[0], scaling.points[-1]
        yield (
            f"| {scaling.what} | {first.size:,} to {last.size:,} | {max(scaling.growth):.1f}"
            f" | {last.seconds:.3g} | {max(p.peak_bytes for p in scaling.points) / 1e6:.0f} |"
        )
    yield ""


def _precision() -> Iterator[str]:
    """Errors of single precision far from the origin, and the cost of double, on the sample."""
    mesh = open_recording(resource_path("swipes.sd2")).load_mesh()
    yield "## Single and double precision\n"
    yield (
        "The sample's body so far from the clip's origin; error of the worst vertex's velocity, in"
        " bins of 0.125 m/s. Where more than 0.01 is predicted, frames are counted in double"
        " precision ([decision 13](decisions/0013-single-and-double-precision.md)).\n"
    )
    yield "| from the origin, m | predicted | single | double | is used |"
    yield "|---|---|---|---|---|"
    for at in errors(mesh):
        yield (
            f"| {at.away_m:g} | {at.predicted:.0e} | {at.single:.0e} | {at.double:.0e}"
            f" | {at.used} |"
        )
    ratios = ", ".join(
        f"{cost.ratio:.2f} ({cost.what})" for cost in costs(in_both_precisions(mesh))
    )
    yield f"\nDouble takes so many times as long: {ratios}.\n"


def _scaling_plot(found: list[Scaling]) -> Figure:
    figure = Figure(figsize=(9.0, 4.0), dpi=120, layout="constrained")
    cost, memory = figure.subplots(1, 2)
    for scaling in found:
        sizes = [point.size / scaling.points[0].size for point in scaling.points]
        seconds = [point.seconds / scaling.points[0].seconds for point in scaling.points]
        cost.plot(sizes, seconds, marker="o", label=scaling.what)
        memory.plot(
            sizes, [p.peak_bytes / 1e6 for p in scaling.points], marker="o", label=scaling.what
        )
    longest = max(len(scaling.points) for scaling in found)
    tenfold = [10.0**k for k in range(longest)]
    cost.plot(tenfold, tenfold, color="black", linewidth=0.8, linestyle=":", label="in proportion")
    memory.axhline(BUDGET_BYTES / 1e6, color="black", linewidth=0.8, linestyle=":", label="budget")
    cost.set(xscale="log", yscale="log", xlabel="times the size", ylabel="times the seconds")
    memory.set(xscale="log", yscale="log", xlabel="times the size", ylabel="most memory (MB)")
    for axes in (cost, memory):
        axes.grid(which="both", alpha=0.2)
        axes.legend(fontsize=7)
    return figure


def _words(plan: AccuracyPlan) -> str:
    """A plan without what the page says of all."""
    words = str(plan).removeprefix("counted by vertex · ").removeprefix("FMCW · ")
    return words.removesuffix(" · wrapped").removesuffix(" · beyond dropped")


def _percent(share: float) -> str:
    value = 100 * share
    return f"{value:.0f} %" if value >= 9.95 else f"{value:.2g} %"


if __name__ == "__main__":
    main()
