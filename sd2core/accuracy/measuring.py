"""Cost and error of every sensible plan on one scene and machine."""

from __future__ import annotations

import time
from pathlib import Path

from sd2core.accuracy.choosing import checked_options
from sd2core.accuracy.cost import in_turns, peak_bytes
from sd2core.accuracy.plans import AccuracyPlan, Family, compared_plans, reference_plan
from sd2core.accuracy.results import Cost, Measurement, PlanResult
from sd2core.accuracy.sample import all_frames, take_sample
from sd2core.accuracy.scene import scene_fingerprint, this_machine
from sd2core.accuracy.trial import Trial
from sd2core.doppler.options import SynthesisOptions
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import Progress, silent
from sd2core.sensor import VirtualSensor

REPEATS = 5


def measure(
    mesh: MeshSequence,
    sensor: VirtualSensor,
    *,
    options: SynthesisOptions | None = None,
    family: Family = "histogram",
    repeats: int = REPEATS,
    progress: Progress = silent,
) -> Measurement:
    """Try every sensible plan of a family on sampled frames of a clip.

    Parameters
    ----------
    options : SynthesisOptions
        For what a plan does not choose; the paper's by default.
    family : {"histogram", "fmcw"}
        Counting, against the same in double precision with every rung at its top;
        or the FMCW signal, against the direct sum over subdivided facets.
    repeats : int
        How often every plan is timed; all plans take turns, so that a busy machine
        slows all of them alike.
    progress : Progress
        May raise Cancelled.

    Raises
    ------
    Sd2Error
        When the mesh or the options do not allow it.
    """
    options = checked_options(mesh, options)
    if family == "fmcw":
        from sd2core.accuracy.measuring_waves import measure_waves

        return measure_waves(mesh, sensor, options, repeats, progress)
    surface = mesh.faces is not None
    trial = Trial(mesh, sensor, options, take_sample(mesh, options))
    plans = list(
        compared_plans(
            options.weight,
            surface=surface,
            range_law=options.range_exponent > 0,
            vertices_kept=trial.vertices_kept,
        )
    )
    total = len(plans) * (repeats + 2)
    runs = trial.sample.runs
    trial.reference(runs)
    trial.load_kernels()
    errors, memory = [], []
    for number, plan in enumerate(plans):
        progress(2 * number, total)
        errors.append(trial.errors(plan, runs))
        memory.append(_watched(trial, plan))
    costs = in_turns(
        plans,
        repeats,
        lambda plan: (trial.milliseconds(plan, 1), trial.milliseconds(plan)),
        lambda done, of: progress(total - of + done, total),
    )
    results = [
        PlanResult(plan, error, Cost(one, every, most, setup_s))
        for plan, error, (one, every), (most, setup_s) in zip(
            plans, errors, costs, memory, strict=True
        )
    ]
    return Measurement(
        family=family,
        reference=reference_plan(family, options.weight, surface=surface),
        results=tuple(sorted(results, key=lambda result: result.cost.all_cores_ms.median)),
        scene=scene_fingerprint(mesh, sensor, options, family),
        machine=this_machine(),
        frames=all_frames(runs),
        source=Path(mesh.source).name,
    )


def _watched(trial: Trial, plan: AccuracyPlan) -> tuple[int, float]:
    """Most bytes allocated at once from scratch, and seconds before the first frame."""
    trial.forget()
    setup_s = 0.0

    def work() -> None:
        nonlocal setup_s
        start = time.perf_counter()
        trial.synthesizer(plan)
        setup_s = time.perf_counter() - start
        trial.milliseconds(plan)

    most = peak_bytes(work)
    return most, setup_s + trial.decimating_s(plan)
