"""Measured cost and error of every sensible plan on one scene and machine."""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sd2core.accuracy.cache import scene_fingerprint, this_machine
from sd2core.accuracy.choosing import check_options
from sd2core.accuracy.plans import AccuracyPlan, Family, compared_plans, reference_plan, wave_plans
from sd2core.accuracy.results import (
    Cost,
    Errors,
    Measurement,
    PlanResult,
    Spread,
    compute_errors,
    shares,
)
from sd2core.accuracy.sample import take_sample
from sd2core.accuracy.trial import Trial
from sd2core.doppler.options import SynthesisOptions
from sd2core.doppler.smoothing import velocity_kernel
from sd2core.errors import Sd2Error
from sd2core.fmcw.options import WaveOptions
from sd2core.fmcw.reference import Converged, converged_frame
from sd2core.fmcw.spectra import frame_spectra, signal_spectra
from sd2core.fmcw.wave import WaveScene
from sd2core.mesh.decimation import decimate
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import workers
from sd2core.progress import Progress, silent
from sd2core.radar_config import PAPER_RADAR, RadarConfig
from sd2core.scattering.facets import visible_facets
from sd2core.sensor import VirtualSensor


def timed_in_turns(
    watched: Sequence[tuple[AccuracyPlan, Errors, int | None, float]],
    repeats: int,
    milliseconds: Callable[[AccuracyPlan], tuple[float, float]],
    progress: Progress,
) -> list[PlanResult]:
    """Time plans in turns, so that a busy machine slows all of them alike.

    Each comes with its errors, the most bytes that it took and the seconds of its setup.
    ``milliseconds`` gives the time per frame on one thread and on all cores.
    """
    spent = np.empty((2, len(watched), repeats))
    for turn in range(repeats):
        for number, (plan, *_) in enumerate(watched):
            progress(turn * len(watched) + number, repeats * len(watched))
            spent[:, number, turn] = milliseconds(plan)
    return [
        PlanResult(plan, error, Cost(Spread.of(one), Spread.of(every), most, setup_s))
        for (plan, error, most, setup_s), one, every in zip(watched, *spent, strict=True)
    ]


def peak_bytes(work: Callable[[], object], memory: bool) -> int | None:
    """Most bytes allocated at once during some work; None without ``memory``."""
    if not memory:
        work()
        return None
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


REPEATS = 5


def measure(
    mesh: MeshSequence,
    sensor: VirtualSensor,
    *,
    options: SynthesisOptions | None = None,
    family: Family = "histogram",
    repeats: int = REPEATS,
    memory: bool = True,
    progress: Progress = silent,
) -> Measurement:
    """Measure every sensible plan of a family on sampled frames of a clip.

    Parameters
    ----------
    options : SynthesisOptions
        For what a plan does not choose; the paper's by default.
    family : {"histogram", "fmcw"}
        Counting, against counting in double precision with every setting at its most accurate;
        or the FMCW signal, against the direct sum over subdivided facets.
    repeats : int
        Number of timings of every plan; all plans take turns, so that a busy machine
        slows all of them alike.
    memory : bool
        Whether memory is measured too. Only for a process whose other threads rest: tracing of
        allocations that ends while a compiled kernel of another thread allocates ends the
        process (CPython before 3.12.9 and 3.13.2, python/cpython#128679).
    progress : Progress
        May raise Cancelled.

    Raises
    ------
    Sd2Error
        When the mesh or the options do not allow it.
    """
    options = check_options(mesh, options)
    if family == "fmcw":
        return measure_waves(mesh, sensor, options, repeats, memory, progress)
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
    watched = []
    for number, plan in enumerate(plans):
        progress(2 * number, total)
        watched.append((plan, trial.errors(plan, runs), *_watched(trial, plan, memory)))
    results = timed_in_turns(
        watched,
        repeats,
        lambda plan: (trial.milliseconds(plan, 1), trial.milliseconds(plan)),
        lambda done, of: progress(total - of + done, total),
    )
    reference = reference_plan(family, options.weight, surface=surface)
    frames = tuple(sorted(frame for run in runs for frame in run.frames))
    return _measurement(reference, results, frames, mesh, sensor, options)


def _measurement(
    reference: AccuracyPlan,
    results: Sequence[PlanResult],
    frames: tuple[int, ...],
    mesh: MeshSequence,
    sensor: VirtualSensor,
    options: SynthesisOptions,
) -> Measurement:
    return Measurement(
        family=reference.family,
        reference=reference,
        results=tuple(sorted(results, key=lambda result: result.cost.all_cores_ms.median)),
        scene=scene_fingerprint(mesh, sensor, options, reference.family),
        machine=this_machine(),
        frames=frames,
        source=Path(mesh.source).name,
    )


def _watched(trial: Trial, plan: AccuracyPlan, memory: bool) -> tuple[int | None, float]:
    """Most bytes allocated at once from scratch, and seconds before the first frame."""
    trial.forget()
    setup_s = 0.0

    def work() -> None:
        nonlocal setup_s
        start = time.perf_counter()
        trial.synthesizer(plan)
        setup_s = time.perf_counter() - start
        trial.milliseconds(plan)

    most = peak_bytes(work, memory)
    return most, setup_s + trial.decimating_s(plan)


_FRAMES = 6
_MOST_CUTS = 3
"""64 pieces per facet: beyond it a frame takes minutes."""


@dataclass(eq=False)
class WaveTrial:
    """FMCW plans on the sampled frames of one scene."""

    mesh: MeshSequence  # with faces
    sensor: VirtualSensor
    options: SynthesisOptions  # only the axis and the smoothing along velocity are used
    frames: tuple[int, ...]
    config: RadarConfig = PAPER_RADAR
    wave: WaveOptions = field(default_factory=WaveOptions)  # for what a plan does not choose

    def __post_init__(self) -> None:
        self._meshes: dict[float, MeshSequence] = {}
        self._setup_s: dict[float, float] = {}
        bins, sigma_bins = self.options.axis.bins, self.options.velocity_sigma_bins
        self._smoothing = velocity_kernel(bins, sigma_bins)

    def reference(
        self, progress: Callable[[], None]
    ) -> tuple[NDArray[np.float64], list[Converged]]:
        """Columns (bins, n) of the direct sum over subdivided facets, and their convergence."""
        plan = reference_plan("fmcw")
        scene = WaveScene(
            self.mesh, self.config, self.sensor, self._visible(plan, None), plan.wave(self.wave)
        )
        found = []
        for frame in self.frames:
            time_s = float(self.mesh.times_s[frame])
            found.append(converged_frame(scene, time_s, most_cuts=_MOST_CUTS, go_on=progress))
        signals = np.stack([converged.signal for converged in found])
        power = signal_spectra(signals, self.config, axis=self.options.axis)
        return shares(power.astype(np.float64)), found

    def columns(self, plan: AccuracyPlan, threads: int | None = None) -> NDArray[np.float64]:
        """Columns of a plan, each adding up to 1, (bins, n)."""
        mesh = self.counted(plan)
        power = frame_spectra(
            mesh,
            self.config,
            mesh.times_s[list(self.frames)],
            sensor=self.sensor,
            visibility=self._visible(plan, threads),
            wave=plan.wave(self.wave),
            axis=self.options.axis,
            threads=1 if threads == 1 else "all",
        )
        return shares(power.astype(np.float64))

    def errors(self, plan: AccuracyPlan, reference: NDArray[np.float64]) -> Errors:
        """Errors of a plan's columns against the reference."""
        found = self.columns(plan)
        smooth, truth = self._smoothing @ found, self._smoothing @ reference
        return compute_errors(found, reference, smooth, truth, self.options.axis)

    def counted(self, plan: AccuracyPlan) -> MeshSequence:
        """Mesh of a plan, decimated if it says so."""
        if plan.vertices_kept not in self._meshes:
            start = time.perf_counter()
            self._meshes[plan.vertices_kept] = decimate(self.mesh, plan.vertices_kept)
            self._setup_s[plan.vertices_kept] = time.perf_counter() - start
        return self._meshes[plan.vertices_kept]

    def setup_s(self, plan: AccuracyPlan) -> float:
        """Seconds that decimating the mesh of a plan took."""
        self.counted(plan)
        return self._setup_s[plan.vertices_kept]

    def _visible(
        self, plan: AccuracyPlan, threads: int | None
    ) -> NDArray[np.bool_] | Literal["facing"]:
        """Visible facets of a plan of exact visibility, else "facing"."""
        if plan.visibility == "facing":
            return "facing"
        mesh = self.counted(plan)
        faces = mesh.faces
        assert faces is not None  # refused before
        seen = np.zeros((mesh.frame_count, len(faces)), np.bool_)

        def fill(frame: int) -> None:
            seen[frame] = visible_facets(mesh.frame(frame), faces, self.sensor.position_m)

        if threads == 1:
            for frame in self.frames:
                fill(frame)
        else:
            list(workers().map(fill, self.frames))
        return seen


def measure_waves(
    mesh: MeshSequence,
    sensor: VirtualSensor,
    options: SynthesisOptions,
    repeats: int,
    memory: bool,
    progress: Progress,
) -> Measurement:
    """Measure the FMCW plans by the errors of their normalised power over velocity."""
    if mesh.faces is None:
        raise Sd2Error(
            f"{mesh.source or 'The mesh'} has no faces, it is a point cloud",
            "a surface, whose facets echo",
        )
    runs = take_sample(mesh, options).runs
    per_run = -(-_FRAMES // len(runs))
    middles = {
        run.frames[(2 * number + 1) * len(run.frames) // (2 * per_run)]
        for run in runs
        for number in range(per_run)
    }
    # Of frames without a person there is nothing to compare.
    seen = {frame for frame in middles if mesh.presence.measured[frame]} or middles
    trial = WaveTrial(mesh, sensor, options, tuple(sorted(seen)))
    plans = [
        plan
        for plan in wave_plans()
        if plan.vertices_kept == 1 or trial.counted(plan).vertex_count < mesh.vertex_count
    ]
    total = len(plans) * (repeats + 1) + 1
    progress(0, total)
    reference, converged = trial.reference(lambda: progress(0, total))
    watched = []
    for number, plan in enumerate(plans):
        progress(1 + number, total)
        errors = trial.errors(plan, reference)
        most = peak_bytes(partial(trial.columns, plan), memory)
        watched.append((plan, errors, most, trial.setup_s(plan)))
    results = timed_in_turns(
        watched,
        repeats,
        lambda plan: _milliseconds(trial, plan),
        lambda done, of: progress(total - of + done, total),
    )
    made = _measurement(reference_plan("fmcw"), results, trial.frames, mesh, sensor, options)
    return replace(made, convergence=_convergence(converged))


def _milliseconds(trial: WaveTrial, plan: AccuracyPlan) -> tuple[float, float]:
    """Milliseconds per frame: processor time of one thread, wall-clock time on all cores."""
    start = time.thread_time()
    trial.columns(plan, threads=1)
    one_s = time.thread_time() - start
    start = time.perf_counter()
    trial.columns(plan)
    passed_s = time.perf_counter() - start
    return 1e3 * one_s / len(trial.frames), 1e3 * passed_s / len(trial.frames)


def _convergence(found: Sequence[Converged]) -> tuple[tuple[int, float], ...]:
    """Largest change of any frame's marginal with each finer cut."""
    largest: dict[int, float] = {}
    for converged in found:
        for pieces, change in zip(converged.pieces[1:], converged.changes, strict=True):
            largest[pieces] = max(largest.get(pieces, 0.0), change)
    return tuple(sorted(largest.items()))
