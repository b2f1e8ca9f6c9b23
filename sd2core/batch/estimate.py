"""Estimate of a batch before it runs: tasks, hours and bytes, from tasks timed on few frames."""

from __future__ import annotations

import hashlib
import json
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sd2core.batch.fitting import fitted
from sd2core.batch.folder import BatchFolder
from sd2core.batch.inputs import (
    Inspection,
    MeshInput,
    Origin,
    find_origins,
    glance,
    known_inspection,
)
from sd2core.batch.plan import BatchPlan
from sd2core.batch.task_graph import TaskGraph, simulation_of
from sd2core.batch.tasks import Task
from sd2core.body.model import Resolution
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.maps import DopplerMap, MapKind
from sd2core.progress import Progress, silent
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

if TYPE_CHECKING:
    from sd2core.batch.synthesis import Choosing

_INSPECTED = 100
_TIMED_MESHES = 2
_FIT_S_PER_FRAME = 0.08
"""Where nothing has been fitted on this machine yet: processor time in docs/fitting.md."""
_MESH_BYTES_PER_FRAME = {"low": 11_000, "medium": 42_000, "high": 112_000}
"""Size of fitted meshes, compressed: some three quarters of 12 bytes per vertex."""
_TASK_S = 0.005
"""Overhead of submitting a task, at most: docs/scale.md."""

_SHORT_FRAMES, _LONG_FRAMES = 120, 480
_SIMULATED_FRAMES = 60
_FEW_SOURCES, _MANY_SOURCES = 4, 24
_MOST_SOURCE_FRAMES = 3_600
_FEWEST_FIT_FRAMES = 100
"""Shortest fit whose rate is kept."""


@dataclass(frozen=True)
class TaskRate:
    """Seconds and bytes of a task: fixed, and per frame."""

    seconds: float
    frame_s: float
    bytes: float
    frame_bytes: float


@dataclass
class StepEstimate:
    """Estimate of one step."""

    there: int = 0  # tasks that are done already
    to_do: int = 0
    frames: int = 0  # of the tasks to do
    seconds: float = 0.0  # of one process for the tasks to do
    bytes: int = 0  # of their results
    basis: str = ""  # origin of the seconds, in words
    assumed: bool = False  # True if the rate is of another machine

    def add(self, rate: TaskRate, frames: int, tasks: int) -> None:
        """Add so many tasks with so many frames altogether."""
        self.seconds += tasks * (rate.seconds + _TASK_S) + frames * rate.frame_s
        self.bytes += round(tasks * rate.bytes + frames * rate.frame_bytes)

    def count(self, task: Task, done: bool, weight: float) -> None:
        """Count a task that stands for ``weight`` tasks."""
        if done:
            self.there += 1
        else:
            self.to_do += round(weight)
            self.frames += round(weight * task.frames)


@dataclass
class BatchEstimate:
    """Estimate of a whole batch."""

    recordings: int
    looked_at: int  # inspected; the others are assumed to be alike
    workers: int
    steps: dict[str, StepEstimate]
    unusable: list[str] = field(default_factory=list)  # inspected recordings, each with its reason

    @property
    def hours(self) -> float:
        """Duration on all processes."""
        return sum(one.seconds for one in self.steps.values()) / self.workers / 3600

    @property
    def assumed_share(self) -> float:
        """Share of the hours that rests on another machine's rates."""
        assumed = sum(one.seconds for one in self.steps.values() if one.assumed)
        return assumed / self.workers / 3600 / self.hours if assumed else 0.0

    @property
    def bytes(self) -> int:
        """Size of all results."""
        return sum(one.bytes for one in self.steps.values())

    def to_json(self) -> dict[str, Any]:
        """Return all figures as JSON can hold them."""
        return asdict(self) | {"hours": self.hours, "bytes": self.bytes} | {
            "assumed_share": self.assumed_share, "estimate": True
        }  # fmt: skip


def estimate(plan: BatchPlan, workers: int, progress: Progress = silent) -> BatchEstimate:
    """Inspect some recordings, time their tasks on few frames, and add up.

    Writes temporary files only. Results that are there add no seconds and bytes. Raises
    Sd2Error if the plan cannot be followed at all.
    """
    folder = BatchFolder(Path(plan.out))
    origins = find_origins(plan.recordings, folder.path)
    graph = TaskGraph(plan, folder, origins)
    steps: dict[str, StepEstimate] = {step: StepEstimate() for step in graph.steps}
    made = BatchEstimate(len(origins), 0, workers, steps)
    known, new = _known_and_new(folder, origins, progress)
    for origin, found in known:
        steps["inspect"].there += 1
        _count(graph, steps, origin, found, 1.0)
    glanced, hashed_s = _glances(new, made)
    weight = len(new) / max(len(glanced) + len(made.unusable), 1)
    for origin, found in glanced:
        _count(graph, steps, origin, found, weight)
    steps["inspect"].to_do = len(new)
    steps["inspect"].seconds = hashed_s * weight + len(new) * _TASK_S
    steps["inspect"].basis = "measured on the inspected ones"
    made.looked_at = len(known) + len(glanced) + len(made.unusable)
    inspections = [
        found if found.mesh is not None else replace(found, mesh=_fitted(graph, origin, found))
        for origin, found in (*glanced, *known)
    ]
    if plan.fit is not None:
        _estimate_fit(steps["fit"], plan.fit.resolution)
    if plan.synthesise is not None:
        _estimate_maps(graph, steps, inspections)
    if plan.export is not None:
        _estimate_export(plan, steps, inspections)
    return made


def _known_and_new(
    folder: BatchFolder, origins: Sequence[Origin], progress: Progress
) -> tuple[list[tuple[Origin, Inspection]], list[Origin]]:
    known, new = [], []
    for number, origin in enumerate(origins):
        progress(number, len(origins))
        found = known_inspection(folder, origin)
        if found is None:
            new.append(origin)
        else:
            known.append((origin, found))
    progress(len(origins), len(origins))
    return known, new


def _glances(
    new: Sequence[Origin], made: BatchEstimate
) -> tuple[list[tuple[Origin, Inspection]], float]:
    """Inspect some recordings without hashing; also the seconds that hashing them would take."""
    if not new:
        return [], 0.0
    chosen = np.unique(np.linspace(0, len(new) - 1, min(_INSPECTED, len(new))).astype(int))
    found, begun_s, size = [], time.perf_counter(), 0
    for number in chosen:
        try:
            found.append((new[number], glance(new[number])))
            size += _size(found[-1][1])
        except (Sd2Error, OSError) as error:
            made.unusable.append(f"{new[number].name}: {error}")
    looking_s = time.perf_counter() - begun_s
    block = bytes(8 << 20)
    hash_s = _seconds(lambda: hashlib.sha256(block).digest())
    return found, looking_s + size * hash_s / len(block)


def _size(found: Inspection) -> int:
    path = Path(found.mesh.path if found.mesh is not None else found.video.path)  # type: ignore[union-attr]
    if path.is_dir():
        return sum(one.stat().st_size for one in path.rglob("*") if one.is_file())
    return path.stat().st_size if path.exists() else 0


def _count(
    graph: TaskGraph,
    steps: dict[str, StepEstimate],
    origin: Origin,
    found: Inspection,
    weight: float,
) -> None:
    """Count the tasks of a recording that stands for ``weight`` recordings."""
    mesh = found.mesh
    if mesh is None:
        assert found.video is not None
        if graph.plan.fit is None:
            return
        video, mesh = found.video, _fitted(graph, origin, found)
        steps["fit"].count(graph.fit_task(origin, video), mesh is not None, weight)
        if mesh is None:
            mesh = MeshInput("", "", video.frames, 0, video.frames_per_s, (0.0, 0.0, 0.0))
    if graph.plan.synthesise is None:
        return
    for planned in graph.maps_of(origin, mesh, found.sensor):
        for task in planned.tasks:
            steps[task.step].count(task, bool(mesh.identity) and graph.is_done(task), weight)


def _fitted(graph: TaskGraph, origin: Origin, found: Inspection) -> MeshInput | None:
    """Return the mesh of a video, where it is there."""
    if found.video is None or not found.video.identity or graph.plan.fit is None:
        return None
    return fitted(Path(graph.fit_task(origin, found.video).out))


def _estimate_fit(step: StepEstimate, resolution: Resolution) -> None:
    rate, frame_bytes = known_fit_rate(resolution), _MESH_BYTES_PER_FRAME[resolution]
    step.add(TaskRate(1.0, rate or _FIT_S_PER_FRAME, 0.0, frame_bytes), step.frames, step.to_do)
    step.assumed = rate is None and step.to_do > 0
    step.basis = "assumed: nothing was fitted here yet" if step.assumed else "as fitted here"


def _estimate_maps(
    graph: TaskGraph, steps: dict[str, StepEstimate], found: Sequence[Inspection]
) -> None:
    timed = [task_rates(graph, one) for one in _sample(found)]
    for name in ("synthesise", "denoise", "simulate"):
        if name not in steps or not steps[name].to_do:
            continue
        step, here = steps[name], [one[name] for one in timed if name in one]
        if not here:
            step.basis = "nothing to measure it on: no mesh is there yet"
            continue
        mean = TaskRate(*np.mean([list(asdict(one).values()) for one in here], axis=0).tolist())
        step.add(mean, step.frames, step.to_do)
        if name == "synthesise":
            meshes = step.to_do / max(graph.plan.placement_count, 1)
            step.seconds += meshes * float(np.mean([one["open"].seconds for one in timed]))
        step.basis = f"measured on {len(here)} of the meshes"


def _estimate_export(
    plan: BatchPlan, steps: dict[str, StepEstimate], found: Sequence[Inspection]
) -> None:
    assert plan.synthesise is not None
    made: dict[MapKind, Any] = {
        "synthetic": plan.synthesise,
        "denoised": plan.denoise,
        "simulated": plan.simulate,
    }
    kinds = tuple(kind for kind, section in made.items() if section is not None)
    clips = [clip for one in found if (clip := one.mesh or one.video) is not None]
    frames = round(np.mean([clip.frames for clip in clips])) if clips else 1
    step, maps = steps["export"], steps["synthesise"]
    step.to_do = 1
    step.seconds = (maps.to_do + maps.there) * export_s(plan, frames, kinds)
    step.basis = f"measured on maps of {frames:,} frames"
    step.bytes = round(maps.frames * plan.synthesise.options().axis.bins * 4 * len(kinds))


def _sample(found: Sequence[Inspection]) -> list[Inspection]:
    """Return the meshes of middle length among those that can be opened at once."""
    usable = [one for one in found if one.mesh is not None and one.mesh.target_m != (0.0, 0.0, 0.0)]
    usable.sort(key=lambda one: one.mesh.frames if one.mesh is not None else 0)
    middle = max(0, (len(usable) - _TIMED_MESHES) // 2)
    return usable[middle : middle + _TIMED_MESHES]


# -- Rates of tasks, by doing some on few frames in a temporary folder ---------------------------


def task_rates(graph: TaskGraph, found: Inspection) -> dict[str, TaskRate]:
    """Time maps of a few frames of a mesh, for a plan that synthesises.

    Keys are ``synthesise``, ``denoise`` and ``simulate`` per task, and ``open``, once per
    recording.
    """
    from sd2core.batch.denoising import denoise

    maps = _TimedMaps(graph.plan, found)
    rates = {}
    with tempfile.TemporaryDirectory(prefix="sd2-batch-") as name:
        folder = Path(name)
        choosing_s = _seconds(lambda: maps.choose(folder / "plan.json"))
        first_s = _seconds(lambda: maps.make(maps.long, folder / "first.npz"))
        again_s = _seconds(lambda: maps.make(maps.long, folder / "again.npz"))
        rates["open"] = TaskRate(choosing_s + max(first_s - again_s, 0.0), 0.0, 0.0, 0.0)
        outs = {count: folder / f"{count}.npz" for count in (maps.long, maps.short)}
        rates["synthesise"] = _rate(lambda count: maps.make(count, outs[count]), outs)
        if graph.plan.denoise is not None:
            model, digest = graph.model
            cleaned = {count: folder / f"denoised-{count}.npz" for count in outs}

            def clean(count: int) -> None:
                denoise([outs[count]], model, digest, [cleaned[count]])

            for count in outs:
                clean(count)
            rates["denoise"] = _rate(clean, cleaned)
        if graph.plan.simulate is not None:
            seen = {count: folder / f"simulated-{count}.npz" for count in maps.simulated}
            rates["simulate"] = _rate(lambda count: maps.simulate(count, seen[count]), seen)
    return rates


class _TimedMaps:
    """Maps of frames in the middle of a mesh, each from another place."""

    def __init__(self, plan: BatchPlan, found: Inspection) -> None:
        assert found.mesh is not None
        assert plan.synthesise is not None
        self._mesh, self._section = found.mesh, plan.synthesise
        self._sensors = list(plan.sensors(found.sensor, found.mesh.target_m).values())
        self._sensor = self._sensors[len(self._sensors) // 2]
        self._choosing: Choosing | None = None
        self.long = min(_LONG_FRAMES, found.mesh.frames)
        self.short = max(1, min(_SHORT_FRAMES, self.long // 2))
        few = min(_SIMULATED_FRAMES, self.long)
        self.simulated = few, max(1, few // 4)
        self._simulation = None if plan.simulate is None else simulation_of(plan.simulate)
        self._made = 0

    def choose(self, path: Path) -> None:
        """Choose the accuracy plan for all maps, where a tolerance is given."""
        from sd2core.accuracy.places import spread
        from sd2core.batch.synthesis import Choosing, chosen_plan

        if self._section.tolerance is not None:
            frames = self._mesh.frames * len(self._sensors)
            self._choosing = Choosing(path, spread(self._sensors), frames)
            chosen_plan(self._mesh, self._section, self._choosing)

    def make(self, count: int, out: Path) -> None:
        from sd2core.batch.synthesis import synthesise

        # Moved a little: masks of a place are kept, and would cost nothing.
        self._made += 1
        x, y, z = self._sensor.position_m
        sensor = replace(self._sensor, position_m=(x + 1e-3 * self._made, y, z))
        first = (self._mesh.frames - self.long) // 2
        frames = (first, first + count)
        synthesise(self._mesh, sensor, self._section, frames, self._choosing, out)

    def simulate(self, count: int, out: Path) -> None:
        from sd2core.batch.synthesis import simulate

        assert self._simulation is not None
        first = (self._mesh.frames - count) // 2
        axis = self._section.options().axis
        simulate(self._mesh, self._sensor, self._simulation, axis, (first, first + count), out)


def _rate(work: Callable[[int], None], outs: Mapping[int, Path]) -> TaskRate:
    """Rate of a task from the same work on many frames and on few."""
    long, short = outs
    seconds = {count: min(_seconds(partial(work, count)) for _ in range(2)) for count in outs}
    sizes = {count: out.stat().st_size for count, out in outs.items()}
    per_frame_s, fixed_s = _line(seconds, long, short)
    per_frame, fixed = _line(sizes, long, short)
    return TaskRate(fixed_s, per_frame_s, fixed, per_frame)


def _line(values: dict[int, Any], long: int, short: int) -> tuple[float, float]:
    """Slope and start of a line, neither below 0."""
    if long == short:
        return values[long] / long, 0.0
    slope = max((values[long] - values[short]) / (long - short), 0.0)
    return slope, max(values[short] - slope * short, 0.0)


def _seconds(work: Callable[[], Any]) -> float:
    begun_s = time.perf_counter()
    work()
    return time.perf_counter() - begun_s


def export_s(plan: BatchPlan, frames: int, kinds: tuple[MapKind, ...]) -> float:
    """Measure the seconds that a source of a data set takes to write; radar files not included.

    ``frames`` is the length of a source, ``kinds`` those of the maps that the batch makes.
    """
    from sd2core.batch.exporting import export_dataset

    assert plan.export is not None
    assert plan.synthesise is not None
    export, axis = plan.export, plan.synthesise.options().axis
    # A clip of any length is cut in segments; a very long one is taken to cost in proportion.
    shorter = min(max(frames, export.segment_frames), _MOST_SOURCE_FRAMES)
    values = np.random.default_rng(0).random((axis.bins, shorter), np.float32)
    with tempfile.TemporaryDirectory(prefix="sd2-batch-") as name:
        row: dict[str, Any] = {
            "source": "none.npz", "subject": "none", "sensor": asdict(VirtualSensor()),
            "target_m": (0.0, 0.0, 2.0), "about": "", "start": 0, "stop": shorter,
            "synthetic": None, "denoised": None, "simulated": None,
        }  # fmt: skip
        for kind in kinds:
            row[kind] = f"{kind}.npz"
            clock = Timebase.regular(shorter, 30.0)
            DopplerMap(values, axis, clock, kind).save(Path(name) / row[kind])

        def work(sources: int) -> None:
            folder = BatchFolder(Path(name) / str(sources))
            folder.path.mkdir()
            lines = [
                row | {"recording": f"{k}.npz", "placement": 1}
                | {kind: f"../{row[kind]}" for kind in kinds}
                for k in range(sources)
            ]  # fmt: skip
            folder.results.write_text("".join(json.dumps(line) + "\n" for line in lines))
            section = export.model_copy(
                update={"validation_subjects": (), "test_subjects": (), "kinds": kinds}
            )
            export_dataset(folder, section, silent)

        seconds = {count: _seconds(partial(work, count)) for count in (_FEW_SOURCES, _MANY_SOURCES)}
    slope_s, _ = _line(seconds, _MANY_SOURCES, _FEW_SOURCES)
    return slope_s * max(frames / shorter, 1.0)


# -- Rate of fits on this machine, kept from one to the next -------------------------------------


def known_fit_rate(resolution: Resolution) -> float | None:
    """Return processor seconds per frame of the last fit on this machine, if there was one."""
    return _known_rates().get(resolution)


def remember_fit_rate(resolution: Resolution, seconds: float, frames: int) -> None:
    """Keep the processor time of a fit, where the cache can be written."""
    if frames < _FEWEST_FIT_FRAMES:
        return
    path, rates = _rates_path(), _known_rates() | {resolution: seconds / frames}
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        atomic_write_text(path, json.dumps(rates) + "\n")
    except OSError:
        return


def _known_rates() -> dict[str, float]:
    try:
        content = json.loads(_rates_path().read_text(encoding="utf-8"))
        return {str(name): float(rate) for name, rate in content.items()}
    except (OSError, ValueError, TypeError, AttributeError):
        return {}


def _rates_path() -> Path:
    import platformdirs

    return Path(platformdirs.user_cache_dir("sd2-studio", appauthor=False)) / "fit-rates.json"
