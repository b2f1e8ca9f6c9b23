"""Makes ``accuracy-and-speed.md`` and its pictures: ``make accuracy``, about five minutes.

Every figure is measured when this runs. The walk is left out where the real
recordings are not there (``SD2_SHARED_DATA``).
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

from sd2core import PRESETS, MeshSequence, VirtualSensor, load_mesh, open_recording
from sd2core.accuracy.choosing import choose
from sd2core.accuracy.measuring import measure
from sd2core.accuracy.plans import AccuracyPlan, reference_plan
from sd2core.accuracy.results import Measurement, plot_cost_and_error
from sd2core.accuracy.survey import survey_scene
from sd2core.files.figure_files import save_figure
from sd2core.numerics.compiled import warm_up
from tools.documentation.measured import (
    BENCHMARKS,
    IMAGES,
    SAMPLE,
    SHARED,
    filled,
    table,
    write_filled,
)

sys.path.insert(0, str(BENCHMARKS.parent))
sys.path.insert(0, str(BENCHMARKS))
from precisions import costs, errors, in_both_precisions
from scaling import BUDGET_BYTES, scalings

TOLERANCES = (0.2, 0.1, 0.05, 0.02, 0.01, 0.005)
PAPER = PRESETS["paper"]

NEARER = 0.6
"""A table shows the plans that have at most this share of the error of the one above."""


def main() -> None:
    """Measure everything and write the page."""
    warm_up()
    write_filled(
        "accuracy-and-speed.md",
        counting=reference_plan("histogram"),
        fmcw=reference_plan("fmcw"),
        nearer=_percent(NEARER),
        scenes="\n".join(_scene(*scene) for scene in _scenes()),
        budget=BUDGET_BYTES >> 20,
        scaling=_scaling(),
        **_precision(),
    )


def _scenes() -> Iterator[tuple[str, str, MeshSequence, VirtualSensor]]:
    sample = open_recording(SAMPLE)
    yield "sample", "The bundled sample (simulated gestures)", sample.load_mesh(), sample.sensor
    walk = SHARED / "mesh" / "walk.npz"
    if walk.exists():
        yield "walk", "A walk (mesh fitted to a real video)", load_mesh(walk), VirtualSensor()


def _scene(name: str, title: str, mesh: MeshSequence, sensor: VirtualSensor) -> str:
    """Costs of tolerances, and the best plans of either family, on one scene."""
    print(title, file=sys.stderr)
    tolerances, measured = _tolerances(mesh, sensor), []
    for family in ("histogram", "fmcw"):
        measurement = measure(mesh, sensor, family=family)
        measured.append(_measured(measurement, f"trade-{name}-{family}.png"))
    return filled(
        "accuracy-and-speed-scene.md",
        title=title,
        tolerances=tolerances,
        measured="\n".join(measured),
    )


def _tolerances(mesh: MeshSequence, sensor: VirtualSensor) -> str:
    """Cost of each tolerance on one scene."""
    survey = survey_scene(mesh, sensor, PAPER)
    rows = [["tolerance", "plan", "ms", "L1"]]
    for tolerance in TOLERANCES:
        choice = choose(mesh, sensor, tolerance=tolerance, survey=survey)
        plan = ("" if choice.holds else "not held: ") + _words(choice.plan)
        l1 = _percent(choice.errors.l1)
        rows.append([_percent(tolerance), plan, f"{choice.cost_ms:.2g}", l1])
    return table(rows, names=2)


def _measured(measurement: Measurement, picture: str) -> str:
    """Picture of all plans of a family, and table of the best."""
    save_figure(plot_cost_and_error(measurement), IMAGES / picture)
    converged = ""
    if measurement.convergence:
        pieces, change = measurement.convergence[-1]
        converged = f"{pieces} pieces per facet changed the reference by {_percent(change)}.\n\n"
    rows = [["plan", "ms", "L1", "peak, m/s"]]
    above = float("inf")
    for result in measurement.front:
        cost, errors = f"{result.cost.all_cores_ms.median:.3g}", result.errors
        if errors.l1 <= NEARER * above:
            above = errors.l1
            peak = f"{errors.peak_mps.p95:.2g}"
            rows.append([_words(result.plan), cost, _percent(errors.l1), peak])
    return filled(
        "accuracy-and-speed-family.md",
        what={"histogram": "Counting", "fmcw": "FMCW signal"}[measurement.family],
        plans=len(measurement.results),
        picture=picture,
        converged=converged,
        table=table(rows),
    )


def _scaling() -> str:
    measured = [scaling for sight in ("facing", "exact") for scaling in scalings(sight)]
    rows = [["what", "sizes", "growth", "longest, s", "most memory, MB"]]
    for scaling in measured:
        first, last = scaling.points[0], scaling.points[-1]
        most_mb = max(point.peak_bytes for point in scaling.points) / 1e6
        numbers = f"{max(scaling.growth):.1f}", f"{last.seconds:.3g}", f"{most_mb:.0f}"
        rows.append([scaling.what, f"{first.size:,} to {last.size:,}", *numbers])
    return table(rows, names=2)


def _precision() -> dict[str, str]:
    """Errors of single precision far from the origin, and the cost of double, on the sample."""
    mesh = open_recording(SAMPLE).load_mesh()
    rows = [["from the origin, m", "predicted", "single", "double", "is used"]]
    for at in errors(mesh):
        off = (f"{value:.0e}" for value in (at.predicted, at.single, at.double))
        rows.append([f"{at.away_m:g}", *off, at.used])
    measured = costs(in_both_precisions(mesh))
    ratios = ", ".join(f"{cost.ratio:.2f} ({cost.what})" for cost in measured)
    return {"precision": table(rows), "ratios": ratios}


def _words(plan: AccuracyPlan) -> str:
    """A plan without what the page says of all."""
    words = str(plan).removeprefix("counted by vertex · ").removeprefix("FMCW · ")
    return words.removesuffix(" · wrapped").removesuffix(" · beyond dropped")


def _percent(share: float) -> str:
    value = 100 * share
    return f"{value:.0f} %" if value >= 9.95 else f"{value:.2g} %"


if __name__ == "__main__":
    main()
