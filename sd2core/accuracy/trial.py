"""Trial of counting plans on sampled frames: their maps, errors and time."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sd2core.accuracy.plans import VERTICES_KEPT, AccuracyPlan, reference_plan
from sd2core.accuracy.results import Errors, compute_errors
from sd2core.accuracy.sample import KEPT, Run, Sample, take_sample
from sd2core.doppler.masks import Visibility
from sd2core.doppler.options import SynthesisOptions
from sd2core.doppler.reference import reference_stretch
from sd2core.doppler.smoothing import smooth
from sd2core.doppler.synthesizer import Synthesizer
from sd2core.errors import Sd2Error
from sd2core.mesh.decimation import decimate
from sd2core.mesh.made_vertices import shifted_like, unshifted
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.map_accuracy import relative_l1
from sd2core.numerics.parallel import spread
from sd2core.options.synthesis import ScenePart
from sd2core.progress import Progress, silent
from sd2core.sensor import VirtualSensor


def synthesizer_for(
    plan: AccuracyPlan,
    mesh: MeshSequence,
    options: SynthesisOptions,
    *,
    like: Synthesizer | None = None,
) -> Synthesizer:
    """Create the synthesizer of a counting plan for a full mesh.

    Parameters
    ----------
    plan : AccuracyPlan
        Of the histogram family.
    mesh : MeshSequence
        Full mesh, which is decimated as the plan says.
    options : SynthesisOptions
        For what a plan does not choose: axis, nulled bins, range law, smoothing.
    like : Synthesizer, optional
        That of a plan that keeps as many vertices, of the same people; its decimated mesh, and its
        prepared frames where possible, are shared.

    Raises
    ------
    Sd2Error
        For an FMCW plan, or a plan that this mesh cannot have.
    """
    if plan.family != "histogram":
        raise Sd2Error(f"The plan is {plan}", "a plan that counts vertices")
    if like is None:
        counted = decimate(mesh, plan.vertices_kept)
    else:  # whose plan may leave out other things, and whose people may stand elsewhere
        others = tuple(
            shifted_like(unshifted(kept)[0], body)
            for kept, body in zip(like.mesh.others, mesh.others, strict=True)
        )
        counted = replace(like.mesh, surroundings=mesh.surroundings, others=others)
    return Synthesizer(counted, plan.options(options), blocks_of=like, left_out=plan.left_out)


_BLOCK_FRAMES = 5
"""Half a run, so that of a run's margins nothing is prepared."""

_REFERENCE_VERTICES = 50_000
"""In frames at once: some 50 ms, so that a cancelled choice soon ends; more do not fit a cache."""

_ASIDE_M = 1e-12
"""Offset that changes no map, but makes another place, whose masks are computed again; far out it
is as little as its coordinates can tell."""


@dataclass(frozen=True, eq=False)
class Columns:
    """Columns of a Doppler map, (bins, n) each, before and after smoothing.

    ``milliseconds`` per frame is the processor time they took, all threads together.
    """

    raw: NDArray[np.float64]
    smooth: NDArray[np.float64]
    weight: NDArray[np.float64]  # of each in the map of the clip, see Run
    milliseconds: float = 0.0

    def off(self, reference: Columns) -> float:
        """Relative L1 of the clip's smoothed map, estimated from these columns."""
        return relative_l1(self.smooth * self.weight, reference.smooth * self.weight)

    def twice(self) -> Columns:
        """Columns, followed by the same columns again."""
        return _joined([self, self])


class Trial:
    """Counting plans on the sampled frames of one scene.

    Smoothing stays within each run, in a plan's map as in the reference. The options say what a
    plan does not choose.
    """

    def __init__(
        self, mesh: MeshSequence, sensor: VirtualSensor, options: SynthesisOptions, sample: Sample
    ) -> None:
        self.mesh = mesh
        self.sensor = sensor
        self.sample = sample
        self.options = options
        # Smoothed here, within the runs: smoothing over time looks at other frames.
        self._unsmoothed = replace(options, velocity_sigma_bins=0.0, time_sigma_s=0.0)
        self._decimated: dict[float, MeshSequence] = {}
        self._meshes: dict[float, MeshSequence] = {}  # sampled
        self._decimating_s: dict[float, float] = {}
        self._prepared: dict[tuple[float, int, int | None], Synthesizer] = {}
        self._references: dict[Run, Columns] = {}
        self._tried = 0

    @property
    def vertices_kept(self) -> tuple[float, ...]:
        """Shares of the vertices that the mesh can be decimated to, and 1."""
        if self.mesh.faces is None:
            return (1.0,)
        # The whole mesh first, so that what is wrong in a frame is said of it.
        every = self._sampled(1.0).vertex_count
        return tuple(
            kept for kept in VERTICES_KEPT if kept == 1 or self._sampled(kept).vertex_count < every
        )

    @property
    def scene_parts(self) -> tuple[ScenePart, ...]:
        """Parts of the scene that a plan may leave out."""
        around = self.mesh.surroundings
        in_scene: dict[ScenePart, bool] = {
            "beam": self.sensor.beam is not None,
            "things": around is not None and bool(around.things) and self.mesh.faces is not None,
            "walls": around is not None and bool(around.walls),
        }
        return tuple(part for part, is_there in in_scene.items() if is_there)

    @property
    def tells(self) -> bool:
        """False if the runs to choose on are empty, which tells nothing of the rest of the clip."""
        sample = self.sample
        whole = len(sample.frames) == self.mesh.frame_count
        return whole or bool(self.reference(sample.chosen_on).raw.any())

    def at(self, sensor: VirtualSensor) -> Trial:
        """Trial from another place, where other frames count, sharing decimated meshes."""
        other = Trial(self.mesh, sensor, self.options, take_sample(self.mesh, sensor, self.options))
        other._decimated, other._decimating_s = self._decimated, self._decimating_s
        return other

    def reference(self, runs: Sequence[Run], *, progress: Progress = silent) -> Columns:
        """Columns of the reference plan, in double precision."""
        options = reference_plan("histogram", self.options.weight).options(self._unsmoothed)
        mesh = self._sampled(1.0)
        at_once = min(max(_REFERENCE_VERTICES // mesh.vertex_count, 1), KEPT)

        def work(start: int, stop: int) -> NDArray[np.float64]:
            return reference_stretch(mesh, self.sensor, options, start, stop)

        for run in runs:
            if run in self._references:
                continue
            starts = range(run.start, run.stop, at_once)
            stops = (min(start + at_once, run.stop) for start in starts)
            columns = []
            for number, column in enumerate(spread(work, starts, stops)):
                columns.append(column)
                progress(number + 1, len(starts))
            raw = np.concatenate(columns, axis=1)
            self._references[run] = self._columns(raw, run)
        return _joined([self._references[run] for run in runs])

    def columns(
        self, plan: AccuracyPlan, runs: Sequence[Run], *, progress: Progress = silent
    ) -> Columns:
        """Columns of a plan, with masks made for them alone.

        A plan that reuses masks is tried with masks made to the left and to the
        right of the sensor; both count.
        """
        synthesizer = self.synthesizer(plan, runs=runs, progress=progress)
        if not plan.mask_reuse_m:
            return self._counted(synthesizer, runs, self._aside(), progress=progress)
        parts = []
        for side in (-1.0, 1.0):
            synthesizer.forget_masks()  # one of another plan may be of this very place
            made_at = self._beside(side * plan.mask_reuse_m)
            self._counted(synthesizer, runs, made_at, progress=progress)
            parts.append(
                self._counted(synthesizer, runs, self._aside(), reused=True, progress=progress)
            )
        return _joined(parts)

    def errors(self, plan: AccuracyPlan, *, progress: Progress = silent) -> Errors:
        """Errors of a plan's map of the whole clip, as the sampled runs tell of it.

        With its standard error, by which they may tell too little, added to the L1.
        """
        reference = self.reference(self.sample.runs, progress=progress)
        columns = self.columns(plan, self.sample.runs, progress=progress)
        if plan.mask_reuse_m:
            reference = reference.twice()
        maps = columns.raw, reference.raw, columns.smooth, reference.smooth
        found = compute_errors(*maps, self.options.axis, columns.weight)
        return replace(found, l1=found.l1 + self._standard_error(columns, reference))

    def milliseconds(
        self,
        plan: AccuracyPlan,
        threads: int | None = None,
        *,
        runs: Sequence[Run] | None = None,
        progress: Progress = silent,
    ) -> float:
        """Milliseconds that a plan takes per frame, after the sensor has moved.

        Parameters
        ----------
        plan : AccuracyPlan
            To be timed, without preparing frames.
        threads : int, optional
            With 1 the processor time of that thread, otherwise wall-clock time; by default one
            per core.
        runs : sequence of Run, optional
            Frames that are timed; all that is read by default.
        progress : Progress
            May raise Cancelled.
        """
        synthesizer = self.synthesizer(plan, threads, runs=runs, progress=progress)
        spans = [(0, synthesizer.mesh.frame_count)] if runs is None else _spans(runs)
        if plan.mask_reuse_m:
            for span in spans:
                synthesizer.stretch(self.sensor, *span, progress=progress, shares=False)
        visibility: Visibility | None = "frozen" if plan.mask_reuse_m else None
        place = self._aside()
        start = time.perf_counter()
        stretches = [
            synthesizer.stretch(place, *span, visibility, progress, shares=False) for span in spans
        ]
        spent_s = time.perf_counter() - start
        if threads == 1:
            spent_s = sum(stretch.processor_s for stretch in stretches)
        return 1e3 * spent_s / sum(stop - start for start, stop in spans)

    def synthesizer(
        self,
        plan: AccuracyPlan,
        threads: int | None = None,
        *,
        runs: Sequence[Run] | None = None,
        progress: Progress = silent,
    ) -> Synthesizer:
        """Synthesizer of a plan, without smoothing, with frames prepared.

        Parameters
        ----------
        plan : AccuracyPlan
            Of the histogram family.
        threads : int, optional
            Of the synthesizer; by default one per core.
        runs : sequence of Run, optional
            Sampled frames that are prepared; all of them by default.
        progress : Progress
            Of the preparation; may raise Cancelled.
        """
        # As small blocks take their own time, all frames are in those of any synthesizer.
        block_frames = None if runs is None else _BLOCK_FRAMES
        key = plan.vertices_kept, plan.frame_rate_factor, block_frames
        like = self._prepared.get(key)
        made = Synthesizer(
            self._sampled(plan.vertices_kept),
            plan.options(self._unsmoothed),
            left_out=plan.left_out,
            blocks_of=like,
            threads=threads,
            block_frames=block_frames,
        )
        made.prepare(progress, None if runs is None else _spans(runs))
        self._prepared.setdefault(key, made)
        return made

    def decimating_s(self, plan: AccuracyPlan) -> float:
        """Seconds that decimating the clip's mesh for a plan took."""
        self._sampled(plan.vertices_kept)
        return self._decimating_s[plan.vertices_kept]

    def forget(self) -> None:
        """Drop prepared frames, so that their preparation can be measured."""
        self._prepared.clear()

    def _standard_error(self, columns: Columns, reference: Columns) -> float:
        """Standard error of the relative L1 of the clip: of a ratio of sums over runs."""
        lengths = [run.stop - run.start for run in self.sample.runs]
        energy = reference.smooth.sum(axis=0) * columns.weight
        if len(lengths) < 2 or not energy.any():
            return 0.0
        difference = np.abs(columns.smooth - reference.smooth).sum(axis=0) * columns.weight
        rest = (difference - energy * (difference.sum() / energy.sum())) / energy.sum()
        # Both sides of a kept mask are of the same frames.
        of_frames = rest.reshape(-1, sum(lengths)).sum(axis=0)
        of_runs = np.add.reduceat(of_frames, np.cumsum([0, *lengths[:-1]]))
        unread = 1 - sum(lengths) / self.mesh.frame_count
        return math.sqrt(unread * len(lengths) / (len(lengths) - 1) * float((of_runs**2).sum()))

    def _sampled(self, kept: float) -> MeshSequence:
        if kept not in self._decimated:
            start = time.perf_counter()
            self._decimated[kept] = decimate(self.mesh, kept)
            self._decimating_s[kept] = time.perf_counter() - start
        if kept not in self._meshes:
            self._meshes[kept] = self.sample.of(self._decimated[kept])
        return self._meshes[kept]

    def _counted(
        self,
        synthesizer: Synthesizer,
        runs: Sequence[Run],
        place: VirtualSensor,
        *,
        reused: bool = False,
        progress: Progress = silent,
    ) -> Columns:
        """Columns with masks made for this place, or with the last masks."""
        visibility: Visibility | None = "frozen" if reused else None
        stretches = [
            synthesizer.stretch(place, run.start, run.stop, visibility, progress, shares=False)
            for run in runs
        ]
        made = zip((stretch.raw for stretch in stretches), runs, strict=True)
        joined = _joined([self._columns(raw, run) for raw, run in made])
        spent_ms = 1e3 * sum(stretch.processor_s for stretch in stretches)
        return replace(joined, milliseconds=spent_ms / joined.raw.shape[1])

    def _columns(self, raw: NDArray[np.float64], run: Run) -> Columns:
        mesh = self._sampled(1.0)
        times_s = mesh.times_s[run.start : run.stop]
        presence = mesh.presence.between(run.start, run.stop)
        smoothed = smooth(raw, times_s, 0, 0, len(times_s), self.options, presence)
        return Columns(raw, smoothed, np.full(len(times_s), run.weight))

    def _aside(self) -> VirtualSensor:
        self._tried += 1
        told_m = 4 * math.ulp(max(map(abs, self.sensor.position_m)))
        return self._beside(self._tried * max(_ASIDE_M, told_m))

    def _beside(self, distance_m: float) -> VirtualSensor:
        """The sensor moved across its line of sight to the body, level."""
        place = np.asarray(self.sensor.position_m)
        body = self._sampled(1.0).frame(self.sample.runs[0].start).astype(np.float64)
        ray = body.mean(axis=0) - place
        right = np.cross((0.0, 1.0, 0.0), ray)
        length = float(np.linalg.norm(right))
        right = right / length if length > 0 else np.array([1.0, 0.0, 0.0])
        x, y, z = (place + distance_m * right).tolist()
        return replace(self.sensor, position_m=(x, y, z))


def _spans(runs: Sequence[Run]) -> list[tuple[int, int]]:
    return [(run.start, run.stop) for run in runs]


def _joined(parts: Sequence[Columns]) -> Columns:
    return Columns(
        np.concatenate([part.raw for part in parts], axis=1),
        np.concatenate([part.smooth for part in parts], axis=1),
        np.concatenate([part.weight for part in parts]),
        float(np.mean([part.milliseconds for part in parts])),
    )
