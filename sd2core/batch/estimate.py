"""What a batch would do, how long it would take and how much it would write."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
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
from sd2core.batch.probing import TaskRate, export_s, task_rates
from sd2core.batch.rates import known_fit_rate
from sd2core.batch.task_graph import Flow
from sd2core.batch.tasks import Task
from sd2core.errors import Sd2Error
from sd2core.maps import MapKind
from sd2core.progress import Progress, silent

if TYPE_CHECKING:
    pass

_LOOKED_AT = 100
_TIMED_MESHES = 2
_FIT_S_PER_FRAME = 0.08
"""Where nothing has been fitted on this machine yet: processor time in docs/fitting.md."""
_MESH_BYTES_PER_FRAME = {"low": 11_000, "medium": 42_000, "high": 112_000}
"""Of fitted meshes, compressed: some three quarters of 12 bytes per vertex."""
_TASK_S = 0.005
"""What giving a task out costs at most, besides: docs/scale.md."""


@dataclass
class StepEstimate:
    """What one step would take.

    Parameters
    ----------
    there, to_do : int
        Tasks that are done already, and that are not.
    frames : int
        Of those to do.
    seconds : float
        Of one process, for those to do.
    bytes : int
        That they would write.
    basis : str
        How the seconds are known.
    assumed : bool
        Whether they are of another machine, and neither measured now nor before.
    """

    there: int = 0
    to_do: int = 0
    frames: int = 0
    seconds: float = 0.0
    bytes: int = 0
    basis: str = ""
    assumed: bool = False

    def add(self, rate: TaskRate, frames: int, tasks: int) -> None:
        """Add so many tasks, which work on so many frames altogether."""
        self.seconds += tasks * (rate.seconds + _TASK_S) + frames * rate.frame_s
        self.bytes += round(tasks * rate.bytes + frames * rate.frame_bytes)


@dataclass
class BatchEstimate:
    """What a batch would take.

    Parameters
    ----------
    recordings : int
    looked_at : int
        Recordings that the figures rest on; the others are taken to be like them.
    workers : int
    steps : dict
    unusable : list of str
        Why some of those looked at cannot be used.
    """

    recordings: int
    looked_at: int
    workers: int
    steps: dict[str, StepEstimate]
    unusable: list[str] = field(default_factory=list)

    @property
    def hours(self) -> float:
        """Of work on all processes."""
        return sum(one.seconds for one in self.steps.values()) / self.workers / 3600

    @property
    def assumed_share(self) -> float:
        """Of the hours: what rests on figures of another machine."""
        assumed = sum(one.seconds for one in self.steps.values() if one.assumed)
        return assumed / self.workers / 3600 / self.hours if assumed else 0.0

    @property
    def bytes(self) -> int:
        """That would be written."""
        return sum(one.bytes for one in self.steps.values())

    def to_json(self) -> dict[str, Any]:
        """As JSON can hold it."""
        return asdict(self) | {"hours": self.hours, "bytes": self.bytes} | {
            "assumed_share": self.assumed_share, "estimate": True
        }  # fmt: skip


def estimate(plan: BatchPlan, workers: int, progress: Progress = silent) -> BatchEstimate:
    """Look at some recordings, time what would be done to them, and add up.

    Nothing is written but to temporary files. What is there already is not counted in
    seconds and bytes.

    Parameters
    ----------
    plan : BatchPlan
    workers : int
    progress : Progress

    Raises
    ------
    Sd2Error
        When the plan cannot be followed at all.
    """
    folder = BatchFolder(Path(plan.out))
    origins = find_origins(plan.recordings, folder.path)
    flow = Flow(plan, folder, origins)
    steps: dict[str, StepEstimate] = {step: StepEstimate() for step in flow.steps}
    made = BatchEstimate(len(origins), 0, workers, steps)
    known, new = _sorted(folder, origins, progress)
    for origin, found in known:
        steps["inspect"].there += 1
        _count(flow, steps, origin, found, 1.0)
    glanced, hashed_s = _glances(new, made)
    weight = len(new) / max(len(glanced) + len(made.unusable), 1)
    for origin, found in glanced:
        _count(flow, steps, origin, found, weight)
    steps["inspect"].to_do = len(new)
    steps["inspect"].seconds = hashed_s * weight + len(new) * _TASK_S
    steps["inspect"].basis = "measured on those looked at"
    made.looked_at = len(known) + len(glanced) + len(made.unusable)
    meshes = [
        found if found.mesh is not None else replace(found, mesh=_fitted(flow, origin, found))
        for origin, found in (*glanced, *known)
    ]
    _time(flow, steps, meshes, plan)
    if "export" in steps:
        sources = steps["synthesise"].to_do + steps["synthesise"].there
        frames = steps["synthesise"].frames
        kinds = _kinds(plan)
        assert plan.export is not None
        assert plan.synthesise is not None
        mean_frames = _mean_frames(meshes)
        steps["export"].to_do = 1
        steps["export"].seconds = sources * export_s(plan, mean_frames, kinds)
        steps["export"].basis = f"measured on maps of {mean_frames:,} frames"
        bins = plan.synthesise.options().axis.bins
        steps["export"].bytes = round(frames * bins * 4 * len(kinds))
    return made


def _kinds(plan: BatchPlan) -> tuple[MapKind, ...]:
    made: dict[MapKind, Any] = {
        "synthetic": plan.synthesise,
        "denoised": plan.denoise,
        "simulated": plan.simulate,
    }
    return tuple(kind for kind, told in made.items() if told is not None)


def _mean_frames(found: Sequence[Inspection]) -> int:
    """Of the clips, fitted or not."""
    clips = [one.mesh or one.video for one in found]
    return round(np.mean([one.frames for one in clips if one is not None])) if clips else 1


def _sorted(
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
    """What some of the recordings hold, and the seconds that hashing all of theirs takes."""
    if not new:
        return [], 0.0
    chosen = np.unique(np.linspace(0, len(new) - 1, min(_LOOKED_AT, len(new))).astype(int))
    found, begun_s, size = [], time.perf_counter(), 0
    for number in chosen:
        try:
            found.append((new[number], glance(new[number])))
            size += _size(found[-1][1])
        except (Sd2Error, OSError) as error:
            made.unusable.append(f"{new[number].name}: {error}")
    looking_s = time.perf_counter() - begun_s
    return found, looking_s + size / _hash_rate()


def _size(found: Inspection) -> int:
    path = Path(found.mesh.path if found.mesh is not None else found.video.path)  # type: ignore[union-attr]
    if path.is_dir():
        return sum(one.stat().st_size for one in path.rglob("*") if one.is_file())
    return path.stat().st_size if path.exists() else 0


def _hash_rate() -> float:
    """Bytes that are hashed in a second."""
    block = bytes(8 << 20)
    begun_s = time.perf_counter()
    hashlib.sha256(block).digest()
    return len(block) / (time.perf_counter() - begun_s)


def _count(
    flow: Flow, steps: dict[str, StepEstimate], origin: Origin, found: Inspection, weight: float
) -> None:
    """Add the tasks of one recording, which stands for ``weight`` of them."""
    mesh = found.mesh
    if mesh is None:
        assert found.video is not None
        if flow.plan.fit is None:
            return
        task, video = flow.fit_task(origin, found.video), found.video
        mesh = _fitted(flow, origin, found)
        _add(steps["fit"], task, mesh is not None, weight)
        if mesh is None:
            # What is made of it is all to be done.
            mesh = MeshInput("", "", video.frames, 0, video.frames_per_s, (0.0, 0.0, 0.0))
    if flow.plan.synthesise is None:
        return
    for planned in flow.maps_of(origin, mesh, found.sensor):
        for task in planned.tasks:
            _add(steps[task.step], task, bool(mesh.identity) and flow.is_done(task), weight)


def _fitted(flow: Flow, origin: Origin, found: Inspection) -> MeshInput | None:
    """The mesh of a video, where it is there."""
    if found.video is None or not found.video.identity or flow.plan.fit is None:
        return None
    return fitted(Path(flow.fit_task(origin, found.video).out))


def _add(step: StepEstimate, task: Task, done: bool, weight: float) -> None:
    if done:
        step.there += 1
    else:
        step.to_do += round(weight)
        step.frames += round(weight * task.frames)


def _time(
    flow: Flow, steps: dict[str, StepEstimate], found: Sequence[Inspection], plan: BatchPlan
) -> None:
    if "fit" in steps:
        assert plan.fit is not None
        rate = known_fit_rate(plan.fit.resolution)
        each = _MESH_BYTES_PER_FRAME[plan.fit.resolution]
        one = steps["fit"]
        one.add(TaskRate(1.0, rate or _FIT_S_PER_FRAME, 0.0, each), one.frames, one.to_do)
        one.assumed = rate is None and one.to_do > 0
        one.basis = "assumed: nothing was fitted here yet" if one.assumed else "as fitted here"
    if plan.synthesise is None:
        return
    timed = [task_rates(flow, one) for one in _sample(found)]
    for step in ("synthesise", "denoise", "simulate"):
        here = [one[step] for one in timed if step in one]
        if step in steps and here and steps[step].to_do:
            mean = TaskRate(*np.mean([list(asdict(one).values()) for one in here], axis=0).tolist())
            steps[step].add(mean, steps[step].frames, steps[step].to_do)
            if step == "synthesise":
                opened = steps[step].to_do / max(plan.placement_count, 1)
                steps[step].seconds += opened * float(
                    np.mean([one["open"].seconds for one in timed])
                )
            steps[step].basis = f"measured on {len(here)} of the meshes"
        elif step in steps and steps[step].to_do:
            steps[step].basis = "nothing to measure it on: no mesh is there yet"


def _sample(found: Sequence[Inspection]) -> list[Inspection]:
    """Of those with a mesh that can be opened at once: the middle ones by length."""
    usable = [one for one in found if one.mesh is not None and one.mesh.target_m != (0.0, 0.0, 0.0)]
    usable.sort(key=lambda one: one.mesh.frames if one.mesh is not None else 0)
    middle = max(0, (len(usable) - _TIMED_MESHES) // 2)
    return usable[middle : middle + _TIMED_MESHES]
