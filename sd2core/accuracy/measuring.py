"""Measured cost and error of every sensible plan on one scene and machine."""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable
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
from sd2core.fmcw.reference import converged_frame
from sd2core.fmcw.spectra import frame_spectra, signal_spectra
from sd2core.fmcw.wave import WaveScene
from sd2core.mesh.decimation import decimate
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import Progress, silent
from sd2core.radar_config import PAPER_RADAR
from sd2core.sensor import VirtualSensor

REPEATS = 5

_FRAMES = 6
"""Of FMCW plans."""
_MAX_CUTS = 3
"""64 pieces per facet: beyond it a frame takes minutes."""


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
    trial = _Waves(mesh, sensor, options) if family == "fmcw" else _Counts(mesh, sensor, options)
    plans = trial.plans()
    total = len(plans) * (repeats + 2)
    trial.prepare(lambda: progress(0, total))
    watched = []
    for number, plan in enumerate(plans):
        progress(2 * number, total)
        watched.append((trial.errors(plan), *trial.begun(plan, memory)))
    spent_ms = np.empty((2, len(plans), repeats))
    for turn in range(repeats):
        for number, plan in enumerate(plans):
            progress((2 + turn) * len(plans) + number, total)
            spent_ms[:, number, turn] = trial.milliseconds(plan)
    results = [
        PlanResult(plan, errors, Cost(Spread.of(one), Spread.of(every), most, setup_s))
        for plan, (errors, most, setup_s), one, every in zip(plans, watched, *spent_ms, strict=True)
    ]
    return Measurement(
        family=family,
        reference=trial.reference_plan,
        results=tuple(sorted(results, key=lambda result: result.cost.all_cores_ms.median)),
        scene=scene_fingerprint(mesh, sensor, options, family),
        machine=this_machine(),
        frames=trial.frames,
        source=Path(mesh.source).name,
        convergence=tuple(sorted(trial.convergence.items())),
    )


class _Counts:
    """Counting plans on the sampled frames of one scene."""

    def __init__(
        self, mesh: MeshSequence, sensor: VirtualSensor, options: SynthesisOptions
    ) -> None:
        self._trial = Trial(mesh, sensor, options, take_sample(mesh, sensor, options))
        self._runs = self._trial.sample.runs
        self._surface = mesh.faces is not None
        self.frames = tuple(sorted(frame for run in self._runs for frame in run.frames))
        self.reference_plan = reference_plan("histogram", options.weight, surface=self._surface)
        self.convergence: dict[int, float] = {}

    def plans(self) -> list[AccuracyPlan]:
        """Plans of the table."""
        options = self._trial.options
        return list(
            compared_plans(
                options.weight,
                surface=self._surface,
                range_law=options.range_exponent > 0,
                vertices_kept=self._trial.vertices_kept,
                scene=self._trial.scene_parts,
            )
        )

    def prepare(self, go_on: Callable[[], None]) -> None:
        """Compute what all plans are held against."""
        self._trial.reference(self._runs)

    def errors(self, plan: AccuracyPlan) -> Errors:
        """Errors against the reference."""
        return self._trial.errors(plan)

    def begun(self, plan: AccuracyPlan, memory: bool) -> tuple[int | None, float]:
        """Most bytes allocated at once from scratch, and seconds before the first frame."""
        trial = self._trial
        trial.forget()
        setup_s = 0.0

        def work() -> None:
            nonlocal setup_s
            start = time.perf_counter()
            trial.synthesizer(plan)
            setup_s = time.perf_counter() - start
            trial.milliseconds(plan)

        most = _peak_bytes(work, memory)
        return most, setup_s + trial.decimating_s(plan)

    def milliseconds(self, plan: AccuracyPlan) -> tuple[float, float]:
        """Milliseconds per frame: processor time of one thread, wall-clock time on all cores."""
        return self._trial.milliseconds(plan, 1), self._trial.milliseconds(plan)


class _Waves:
    """FMCW plans on some frames of one scene, by their normalised power over velocity.

    Of the options only the axis and the smoothing along velocity are used.
    """

    def __init__(
        self, mesh: MeshSequence, sensor: VirtualSensor, options: SynthesisOptions
    ) -> None:
        if mesh.faces is None:
            raise Sd2Error(
                f"{mesh.source or 'The mesh'} has no faces, it is a point cloud",
                "a surface, whose facets echo",
            )
        self._mesh, self._sensor, self._axis = mesh, sensor, options.axis
        self._smoothing = velocity_kernel(options.axis.bins, options.velocity_sigma_bins)
        runs = take_sample(mesh, sensor, options, _FRAMES).runs
        per_run = -(-_FRAMES // len(runs))
        middles = {
            run.frames[(2 * number + 1) * len(run.frames) // (2 * per_run)]
            for run in runs
            for number in range(per_run)
        }
        # Of frames without a person there is nothing to compare.
        seen = {frame for frame in middles if mesh.presence.measured[frame]} or middles
        self.frames = tuple(sorted(seen))
        self.reference_plan = reference_plan("fmcw")
        self.convergence: dict[int, float] = {}
        self._meshes: dict[float, MeshSequence] = {}
        self._setup_s: dict[float, float] = {}

    def plans(self) -> list[AccuracyPlan]:
        """Plans of the table, without those that the mesh cannot be decimated for."""
        every = self._mesh.vertex_count
        return [
            plan
            for plan in wave_plans()
            if plan.vertices_kept == 1 or self._counted(plan).vertex_count < every
        ]

    def prepare(self, go_on: Callable[[], None]) -> None:
        """Sum directly over subdivided facets what all plans are held against.

        ``convergence`` gets the largest change of any frame with each finer cut.
        """
        wave = self.reference_plan.wave(WaveOptions())
        scene = WaveScene(self._mesh, PAPER_RADAR, self._sensor, "exact", wave)
        signals = []
        for time_s in self._mesh.times_s[list(self.frames)].tolist():
            frame = converged_frame(scene, time_s, most_cuts=_MAX_CUTS, go_on=go_on)
            signals.append(frame.signal)
            for pieces, change in zip(frame.pieces[1:], frame.changes, strict=True):
                self.convergence[pieces] = max(self.convergence.get(pieces, 0.0), change)
        power = signal_spectra(np.stack(signals), PAPER_RADAR, axis=self._axis)
        self._reference = shares(power.astype(np.float64))  # (bins, n)

    def errors(self, plan: AccuracyPlan) -> Errors:
        """Errors against the reference."""
        columns, reference = self._columns(plan), self._reference
        smooth, truth = self._smoothing @ columns, self._smoothing @ reference
        return compute_errors(columns, reference, smooth, truth, self._axis)

    def begun(self, plan: AccuracyPlan, memory: bool) -> tuple[int | None, float]:
        """Most bytes allocated at once, and seconds that decimating the mesh took."""
        most = _peak_bytes(lambda: self._columns(plan), memory)
        return most, self._setup_s[plan.vertices_kept]

    def milliseconds(self, plan: AccuracyPlan) -> tuple[float, float]:
        """Milliseconds per frame: processor time of one thread, wall-clock time on all cores."""
        start = time.thread_time()
        self._columns(plan, threads=1)
        one_s = time.thread_time() - start
        start = time.perf_counter()
        self._columns(plan)
        passed_s = time.perf_counter() - start
        return 1e3 * one_s / len(self.frames), 1e3 * passed_s / len(self.frames)

    def _columns(
        self, plan: AccuracyPlan, threads: Literal[1, "all"] = "all"
    ) -> NDArray[np.float64]:
        """Columns of a plan, each adding up to 1, (bins, n)."""
        mesh = self._counted(plan)
        power = frame_spectra(
            mesh,
            PAPER_RADAR,
            mesh.times_s[list(self.frames)],
            sensor=self._sensor,
            visibility="exact" if plan.visibility == "exact" else "facing",
            wave=plan.wave(WaveOptions()),
            axis=self._axis,
            threads=threads,
        )
        return shares(power.astype(np.float64))

    def _counted(self, plan: AccuracyPlan) -> MeshSequence:
        """Mesh of a plan, decimated if it says so."""
        if plan.vertices_kept not in self._meshes:
            start = time.perf_counter()
            self._meshes[plan.vertices_kept] = decimate(self._mesh, plan.vertices_kept)
            self._setup_s[plan.vertices_kept] = time.perf_counter() - start
        return self._meshes[plan.vertices_kept]


def _peak_bytes(work: Callable[[], object], memory: bool) -> int | None:
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
