"""Makes ``accuracy-and-speed.md`` and its pictures: ``make accuracy``, about five minutes.

Every figure is measured when this runs. The walk is left out where the real
recordings are not there (``SD2_SHARED_DATA``).
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

from matplotlib.figure import Figure

from sd2core.accuracy.cache import this_machine
from sd2core.accuracy.choosing import choose, survey_scene
from sd2core.accuracy.measuring import measure
from sd2core.accuracy.results import Measurement, plot_cost_and_error
from sd2core.doppler import PRESETS
from sd2core.files.figure_files import save_figure
from sd2core.files.resources import resource_path
from sd2core.io.mesh import load_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import warm_up
from sd2core.recording.recording import open_recording
from sd2core.sensor import VirtualSensor
from tools.documentation.places import BENCHMARKS, DOCS, IMAGES, SHARED

sys.path.insert(0, str(BENCHMARKS))
from precisions import costs, errors, in_both_precisions
from scaling import BUDGET_BYTES, Scaling, scalings

TOLERANCES = (0.2, 0.1, 0.05, 0.02, 0.01, 0.005)
PAPER = PRESETS["paper"]

INTRODUCTION = """\
# Accuracy and speed

What accuracy costs, measured. Made by

```
make accuracy
```

on {machine}. Running it again gives other times, and nearly the same errors. What the settings are
is [decision 14](decisions/0014-the-ladder.md); `sd2 ladder MESH` and the Accuracy panel measure the
same on a scene of one's own.

**L1** is the sum of the absolute differences between a map and the reference, over the sum of the
reference, all sampled frames together; *raw* is before smoothing. **Peak** and **mean** are the
errors of a frame's strongest bin and of its mean velocity: median of frames, and what 95 % stay
within. **Wrong bins** is the share of a frame's energy that lies in other bins than it should.
The reference for counting is {reference}, in double precision.
"""


def main() -> None:
    """Measure everything and write the page."""
    warm_up()
    parts = [INTRODUCTION.format(machine=this_machine(), reference=_reference())]
    for name, title, mesh, sensor in _scenes():
        print(title, file=sys.stderr)
        parts += [f"## {title}\n", *_tolerances(mesh, sensor)]
        for family in ("histogram", "fmcw"):
            measurement = measure(mesh, sensor, family=family)  # type: ignore[arg-type]
            parts += _measured(measurement, f"trade-{name}-{family}.png")
    parts += _scaling()
    parts += _precision()
    (DOCS / "accuracy-and-speed.md").write_text("\n".join(parts), encoding="utf-8")


def _reference() -> str:
    from sd2core.accuracy.plans import reference_plan

    return f"*{reference_plan('histogram')}*"


def _scenes() -> Iterator[tuple[str, str, MeshSequence, VirtualSensor]]:
    sample = open_recording(resource_path("swipes.sd2"))
    yield "sample", "The bundled sample (simulated gestures)", sample.load_mesh(), sample.sensor
    walk = SHARED / "mesh" / "walk.npz"
    if walk.exists():
        yield "walk", "A walk (mesh fitted to a real video)", load_mesh(walk), VirtualSensor()


def _tolerances(mesh: MeshSequence, sensor: VirtualSensor) -> Iterator[str]:
    """Cost of each tolerance on one scene, with reasons."""
    survey = survey_scene(mesh, sensor, PAPER)
    yield "What a tolerance costs (error on frames that were not used to choose):\n"
    yield "| tolerance | plan | L1 | raw L1 | ms per frame |"
    yield "|---|---|---|---|---|"
    for tolerance in TOLERANCES:
        choice = choose(mesh, sensor, tolerance=tolerance, survey=survey)
        held = "" if choice.holds else "not held: "
        yield (
            f"| {_percent(tolerance)} | {held}{choice.plan} | {_percent(choice.errors.l1)}"
            f" | {_percent(choice.errors.l1_raw)} | {choice.cost_ms:.2g} |"
        )
    choice = choose(mesh, sensor, tolerance=0.02)
    yield f"\nWhy, at 2 % (chosen in {choice.spent_s:.1f} s):\n"
    for reason in choice.reasons:
        yield f"- {reason.text}"
    yield ""


def _measured(measurement: Measurement, picture: str) -> Iterator[str]:
    """Table and picture of all plans of a family."""
    save_figure(plot_cost_and_error(measurement), IMAGES / picture)
    what = {"histogram": "Counting", "fmcw": "FMCW signal"}[measurement.family]
    yield f"### {what}: {len(measurement.results)} plans\n"
    yield f"![error against cost]({IMAGES.name}/{picture})\n"
    if measurement.convergence:
        steps = ", ".join(
            f"{pieces} pieces per facet {_percent(change)}"
            for pieces, change in measurement.convergence
        )
        yield f"Reference: *{measurement.reference}*; it changed with {steps}.\n"
    yield "| plan | one thread, ms | all cores, ms | MB | L1 | raw L1 | peak, m/s | mean, m/s |"
    yield "|---|---|---|---|---|---|---|---|"
    front = set(measurement.front)
    for result in measurement.results:
        cost, errors = result.cost, result.errors
        mark = "**" if result in front else ""
        assert cost.peak_bytes is not None  # measured in this process, where nothing else works
        yield (
            f"| {mark}{result.plan}{mark} | {cost.one_thread_ms.median:.3g}"
            f" ({cost.one_thread_ms.p95:.3g}) | {cost.all_cores_ms.median:.3g}"
            f" ({cost.all_cores_ms.p95:.3g}) | {cost.peak_bytes / 1e6:.0f}"
            f" | {_percent(errors.l1)} | {_percent(errors.l1_raw)}"
            f" | {errors.peak_mps.median:.2g} ({errors.peak_mps.p95:.2g})"
            f" | {errors.mean_mps.median:.2g} ({errors.mean_mps.p95:.2g}) |"
        )
    yield "\nBold: no other plan is both cheaper and nearer. In brackets: 95 % stay below.\n"


def _scaling() -> Iterator[str]:
    found = [scaling for sight in ("facing", "exact") for scaling in scalings(sight)]
    save_figure(_scaling_plot(found), IMAGES / "scaling.png")
    yield "## Ten times as much\n"
    yield f"![cost and memory against size]({IMAGES.name}/scaling.png)\n"
    yield (
        "A swaying ellipsoid that is computed as it is read, so that any size fits. Memory is the"
        " most that was allocated at once, the result included; the budget for prepared frames was"
        f" {BUDGET_BYTES >> 20} MiB.\n"
    )
    yield "| what | sizes | seconds | cost per factor of ten | most memory, MB |"
    yield "|---|---|---|---|---|"
    for scaling in found:
        yield (
            f"| {scaling.what} | {_list(f'{p.size:,}' for p in scaling.points)}"
            f" | {_list(f'{p.seconds:.3g}' for p in scaling.points)}"
            f" | {_list(f'{g:.1f}' for g in scaling.growth)}"
            f" | {_list(f'{p.peak_bytes / 1e6:.0f}' for p in scaling.points)} |"
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
    yield "\nWhat double costs, ms per frame of the whole clip on all cores:\n"
    yield "| what | single | double | ratio |"
    yield "|---|---|---|---|"
    for cost in costs(in_both_precisions(mesh)):
        yield (f"| {cost.what} | {cost.single_ms:.3f} | {cost.double_ms:.3f} | {cost.ratio:.2f} |")
    yield ""


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


def _list(values: Iterator[str]) -> str:
    return ", ".join(values)


def _percent(share: float) -> str:
    value = 100 * share
    return f"{value:.0f} %" if value >= 9.95 else f"{value:.2g} %"


if __name__ == "__main__":
    main()
