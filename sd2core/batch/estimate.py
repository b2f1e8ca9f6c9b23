"""Estimate of a batch before it runs: tasks, time and bytes."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from sd2core.batch.exporting import is_exported, rows_of
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
from sd2core.batch.plan import BatchPlan, Step
from sd2core.batch.task_graph import TaskGraph
from sd2core.batch.tasks import Task
from sd2core.doppler.options import chosen_options
from sd2core.errors import Sd2Error
from sd2core.mesh.vertex_parts import PARTS
from sd2core.progress import Progress, silent
from sd2core.runs.pace import Kind, fit_kind, known_pace_s

_INSPECTED = 100
_FITTED_VERTICES = {"low": 1_229, "medium": 5_000, "high": 13_348}
_VERTEX_BYTES = 9
"""Three quarters of three floats: fitted meshes are compressed."""


@dataclass
class StepEstimate:
    """Estimate of one step."""

    there: int = 0  # tasks that are done already
    to_do: int = 0
    frames: int = 0  # of the tasks to do
    work: int = 0  # of the tasks to do, see Task.work
    seconds: float | None = 0.0  # of one process; None until this machine has done such tasks
    bytes: int = 0  # of their results, at most

    def count(self, task: Task, done: bool, weight: float) -> None:
        """Count a task that stands for ``weight`` tasks."""
        if done:
            self.there += 1
        else:
            self.to_do += round(weight)
            self.frames += round(weight * task.frames)
            self.work += round(weight * task.work)


@dataclass
class BatchEstimate:
    """Estimate of a whole batch."""

    recordings: int
    looked_at: int  # inspected; the others are assumed to be alike
    workers: int
    steps: dict[str, StepEstimate]
    unusable: list[str] = field(default_factory=list)  # inspected recordings, each with its reason

    @property
    def seconds(self) -> float | None:
        """Duration on all processes; None where a step has not been done on this machine yet."""
        known = [one.seconds for one in self.steps.values() if one.seconds is not None]
        return sum(known) / self.workers if len(known) == len(self.steps) else None

    @property
    def bytes(self) -> int:
        """Size of all results, at most."""
        return sum(one.bytes for one in self.steps.values())

    def to_json(self) -> dict[str, Any]:
        """Return all figures as JSON can hold them."""
        hours = None if self.seconds is None else self.seconds / 3600
        return asdict(self) | {"hours": hours, "bytes": self.bytes, "estimate": True}


def estimate(plan: BatchPlan, workers: int, progress: Progress = silent) -> BatchEstimate:
    """Inspect some recordings and count what is to do; the others are assumed to be alike.

    Writes nothing. Raises Sd2Error if the plan cannot be followed at all.
    """
    folder = BatchFolder(Path(plan.out))
    origins = find_origins(plan.recordings, folder.path)
    graph = TaskGraph(plan, folder, origins)
    steps: dict[str, StepEstimate] = {step: StepEstimate() for step in graph.steps}
    made = BatchEstimate(len(origins), 0, workers, steps)
    new = []
    for number, origin in enumerate(origins):
        progress(number, len(origins))
        inspection = known_inspection(folder, origin)
        if inspection is None:
            new.append(origin)
        else:
            steps["inspect"].there += 1
            _count(graph, steps, origin, inspection, 1.0)
    glanced = _glances(new, made, progress)
    weight = len(new) / max(len(glanced) + len(made.unusable), 1)
    for origin, inspection in glanced:
        _count(graph, steps, origin, inspection, weight)
    steps["inspect"].to_do = steps["inspect"].work = len(new)
    made.looked_at = steps["inspect"].there + len(glanced) + len(made.unusable)
    if plan.export is not None:
        maps, export = steps["synthesise"], steps["export"]
        here = {origin.path for origin in origins}
        if (
            any(one.to_do for one in steps.values())
            or not is_exported(folder, plan.export)
            or any(row["source"] not in here for row in rows_of(folder))
        ):
            export.to_do, export.work = 1, maps.there + maps.to_do
        else:
            export.there = 1
    for step in graph.steps:
        _add_costs(plan, step, steps)
    return made


def pace_kind(plan: BatchPlan, step: Step) -> Kind:
    """Kind of a step, whose items are those of :attr:`Task.work`; see :mod:`sd2core.runs.pace`."""
    if step == "fit":
        assert plan.fit is not None
        return fit_kind(plan.fit.resolution)
    if getattr(plan, step, None) is None:
        return ("batch", step)
    content = plan.model_dump(mode="json", exclude_defaults=True)[step]
    for name in ("seed", "title", "validation_subjects", "test_subjects"):
        content.pop(name, None)
    return ("batch", step, json.dumps(content, sort_keys=True))


def _glances(
    new: Sequence[Origin], made: BatchEstimate, progress: Progress
) -> list[tuple[Origin, Inspection]]:
    """Inspect some recordings without hashing them."""
    glanced = []
    chosen = np.unique(np.linspace(0, len(new) - 1, min(_INSPECTED, len(new))).astype(int))
    for number, index in enumerate(chosen):
        progress(number, len(chosen))
        try:
            glanced.append((new[index], glance(new[index])))
        except (Sd2Error, OSError) as error:
            made.unusable.append(f"{new[index].name}: {error}")
    return glanced


def _count(
    graph: TaskGraph,
    steps: dict[str, StepEstimate],
    origin: Origin,
    inspection: Inspection,
    weight: float,
) -> None:
    """Count the tasks of a recording that stands for ``weight`` recordings."""
    mesh, fit = inspection.mesh, graph.plan.fit
    if mesh is None:
        assert inspection.video is not None
        if fit is None:
            return
        video, task = inspection.video, graph.fit_task(origin, inspection.video)
        mesh = fitted(Path(task.out)) if video.identity else None
        steps["fit"].count(task, mesh is not None, weight)
        if mesh is None:
            vertices, nowhere = _FITTED_VERTICES[fit.resolution], (0.0, 0.0, 0.0)
            mesh = MeshInput("", "", video.frames, vertices, nowhere)
    for planned in graph.maps_of(origin, inspection, mesh):
        for task in planned.tasks:
            steps[task.step].count(task, bool(mesh.identity) and graph.is_done(task), weight)


def _add_costs(plan: BatchPlan, step: Step, steps: dict[str, StepEstimate]) -> None:
    one = steps[step]
    if one.to_do:
        each_s = known_pace_s(pace_kind(plan, step))
        one.seconds = None if each_s is None else one.work * each_s
    if step == "fit" and plan.fit is not None:
        one.bytes = one.frames * _FITTED_VERTICES[plan.fit.resolution] * _VERTEX_BYTES
    elif plan.synthesise is not None and step != "inspect":
        kinds = [name for name in ("synthesise", "denoise", "simulate") if name in steps]
        frames = sum(steps[name].frames for name in kinds) if step == "export" else one.frames
        if getattr(getattr(plan, step), "limbs", False):  # a map of each part besides
            frames += len(PARTS) * steps["synthesise"].frames
        one.bytes = 4 * chosen_options(plan.synthesise).axis.bins * frames
