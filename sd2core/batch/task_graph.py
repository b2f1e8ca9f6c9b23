"""Graph of tasks: from a recording to its meshes, maps and denoised maps."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sd2core.batch.exporting import dataset_key, dataset_path, is_exported, rows_of
from sd2core.batch.fitting import fit_choices, fitted
from sd2core.batch.folder import BatchFolder
from sd2core.batch.inputs import Inspection, MeshInput, Origin, VideoInput, known_inspection
from sd2core.batch.plan import STEPS, BatchPlan, Step
from sd2core.batch.synthesis import Choosing, FrameRange, stretches_of
from sd2core.batch.tasks import Task
from sd2core.doppler.options import chosen_options
from sd2core.errors import Sd2Error
from sd2core.files.digests import file_digest
from sd2core.files.keys import key_of
from sd2core.options.shared import Simulating
from sd2core.sensor import VirtualSensor

if TYPE_CHECKING:
    from sd2core.datasets.simulating import Simulation

_View = tuple[Origin, MeshInput, int, VirtualSensor]
"""Recording, its mesh, number of the placement, and sensor."""

_MAPS: tuple[Step, ...] = ("synthesise", "denoise", "simulate")


@dataclass(frozen=True)
class PlannedMap:
    """Map of one recording from one place: one file per stretch."""

    placement: int  # 0 is the recording's own sensor; 1 and up are the places of the plan
    sensor: VirtualSensor
    stretches: tuple[FrameRange, ...]
    synthesis: tuple[Task, ...]  # one per stretch
    denoising: Task | None = None  # covers all stretches, because a model carries its state on
    simulation: tuple[Task, ...] = ()  # one per stretch, or none

    @property
    def tasks(self) -> tuple[Task, ...]:
        """All tasks of this map."""
        denoising = () if self.denoising is None else (self.denoising,)
        return (*self.synthesis, *denoising, *self.simulation)

    @property
    def denoised(self) -> list[Path]:
        """Files of the denoised stretches, or none."""
        return [] if self.denoising is None else list(self.denoising.arguments["outs"])


class TaskGraph:
    """Tasks of a batch, each known as soon as the tasks before it are done.

    The paths of the plan are absolute. ``total`` counts the tasks per step that are known
    of so far; a map counts once until it is known into how many stretches it is cut.
    """

    def __init__(self, plan: BatchPlan, folder: BatchFolder, origins: Sequence[Origin]) -> None:
        self.plan, self.folder, self.origins = plan, folder, origins
        section = plan.synthesise
        self._scene = (
            {}
            if section is None
            else {
                "options": asdict(chosen_options(section)),
                "tolerance": section.tolerance,
                "vertices_kept": section.vertices_kept,
                "left_out": section.left_out,
                "limbs": section.limbs,
            }
        )
        self._model = None if plan.denoise is None else _model_of(plan)
        self._simulation = None if plan.simulate is None else simulation_of(plan.simulate)
        # Of a map whose stretches are not all there yet: how many are missing.
        self._missing: dict[tuple[str, int], int] = {}
        self._denoising: dict[tuple[str, int], Task] = {}
        self.total: Counter[str] = Counter()
        self.total["inspect"] = len(origins)
        if plan.export is not None:
            self.total["export"] = 1
        self.total += Counter(self._maps_of_one(len(origins)))

    @property
    def model(self) -> tuple[str, str]:
        """File of the denoiser and the hash of its content."""
        assert self._model is not None
        return self._model

    @property
    def steps(self) -> tuple[Step, ...]:
        """Steps of the plan, in order."""
        return ("inspect", *(step for step in STEPS[1:] if getattr(self.plan, step) is not None))

    def first(self) -> Iterator[Task]:
        """Yield the tasks that can be done at once: the inspections."""
        for origin in self.origins:
            key = key_of("inspect", {"path": origin.path})
            yield Task("inspect", key, origin, {}, group=origin.name)

    def last(self) -> Iterator[Task]:
        """Yield the task after ``results.jsonl`` is written: the data set."""
        if self.plan.export is not None:
            origin = Origin(str(self.folder.path), "data set", "")
            out = str(dataset_path(self.folder, self.plan.export))
            arguments = {"export": self.plan.export}
            key = dataset_key(self.folder, self.plan.export)
            sources = sum(1 for _ in rows_of(self.folder))
            yield Task("export", key, origin, arguments, frames=sources, out=out)

    def is_done(self, task: Task) -> bool:
        """Tell if the result of a task exists."""
        if task.step == "inspect":
            return known_inspection(self.folder, task.origin) is not None
        if task.step == "fit":
            return fitted(Path(task.out)) is not None
        if task.step == "export":
            assert self.plan.export is not None
            return is_exported(self.folder, self.plan.export)
        return os.path.exists(task.out)

    def after(self, task: Task) -> Iterator[Task]:
        """Yield the tasks that can be done after this one."""
        if task.step == "inspect":
            found = known_inspection(self.folder, task.origin)
            if found is None:
                raise _changing(task.origin)
            return self._after_inspection(task.origin, found)
        if task.step == "fit":
            mesh, found = fitted(Path(task.out)), known_inspection(self.folder, task.origin)
            if mesh is None or found is None:
                raise _changing(task.origin)
            return self._synthesis(task.origin, mesh, found.sensor)
        if task.step == "synthesise":
            return self._after_map(task)
        return iter(())

    def lost_with(self, task: Task) -> dict[str, int]:
        """Count the tasks per step that cannot be done because this one failed."""
        if task.step in ("inspect", "fit"):
            return self._maps_of_one(1)
        where = (task.origin.name, task.placement or 0)
        if task.step == "synthesise" and where in self._missing:
            del self._missing[where]
            del self._denoising[where]
            return {"denoise": 1}
        return {}

    def _maps_of_one(self, recordings: int) -> dict[str, int]:
        maps = recordings * self.plan.placement_count
        return {step: maps for step in _MAPS if step in self.steps}

    def _after_inspection(self, origin: Origin, found: Inspection) -> Iterator[Task]:
        if found.mesh is not None:
            return self._synthesis(origin, found.mesh, found.sensor)
        assert found.video is not None
        if self.plan.fit is None:
            raise Sd2Error(
                f"{origin.path} is a video without a mesh",
                "a section [fit] in the plan, which makes one",
            )
        self.total["fit"] += 1
        return iter((self.fit_task(origin, found.video),))

    def fit_task(self, origin: Origin, video: VideoInput) -> Task:
        """Return the task that makes a mesh of a video."""
        assert self.plan.fit is not None
        choices = fit_choices(self.plan.fit, origin.subject, video.focal_px)
        key = key_of("fit", {"video": video.identity, "choices": choices})
        out = str(self.folder.result("meshes", key, ".zarr"))
        arguments = {
            "video": video.path,
            "choices": choices,
            "models": self.plan.fit.models,
            "out": out,
        }
        return Task("fit", key, origin, arguments, None, video.frames, origin.name, out)

    def _synthesis(self, origin: Origin, mesh: MeshInput, own: VirtualSensor) -> Iterator[Task]:
        if self.plan.synthesise is None:
            return
        for planned in self.maps_of(origin, mesh, own):
            self.total["synthesise"] += len(planned.stretches) - 1
            if planned.denoising is not None:
                where = (origin.name, planned.placement)
                self._missing[where] = len(planned.stretches)
                self._denoising[where] = planned.denoising
            yield from planned.synthesis
        if self._simulation is not None:
            # After all that is quick, so that this can be given out together.
            for planned in self.maps_of(origin, mesh, own):
                self.total["simulate"] += len(planned.stretches) - 1
                yield from planned.simulation

    def _after_map(self, task: Task) -> Iterator[Task]:
        where = (task.origin.name, task.placement or 0)
        if where not in self._missing:
            return iter(())
        self._missing[where] -= 1
        if self._missing[where]:
            return iter(())
        del self._missing[where]
        return iter((self._denoising.pop(where),))

    def maps_of(self, origin: Origin, mesh: MeshInput, own: VirtualSensor) -> Iterator[PlannedMap]:
        """Yield all maps of one recording."""
        stretches = tuple(stretches_of(mesh.frames))
        sensors = self.plan.sensors(own, mesh.target_m)
        choosing = self._choosing(mesh, list(sensors.values()))
        for placement, sensor in sensors.items():
            where = (origin, mesh, placement, sensor)
            synthesis = tuple(self._synthesis_task(where, one, choosing) for one in stretches)
            denoising = None if self._model is None else self._denoising_task(synthesis)
            simulated = () if self._simulation is None else stretches
            simulation = tuple(self._simulation_task(where, one) for one in simulated)
            yield PlannedMap(placement, sensor, stretches, synthesis, denoising, simulation)

    def _choosing(self, mesh: MeshInput, sensors: Sequence[VirtualSensor]) -> Choosing | None:
        """Describe the choice of an accuracy plan for a mesh; None without a tolerance."""
        if self._scene["tolerance"] is None:
            return None
        from sd2core.accuracy.places import spread

        places, frames = spread(sensors), mesh.frames * len(sensors)
        about = {"places": [asdict(one) for one in places], "frames": frames}
        key = key_of("synthesise", {"mesh": mesh.identity, **self._scene, **about})
        return Choosing(self.folder.result("plans", key, ".json"), places, frames)

    def _synthesis_task(self, where: _View, stretch: FrameRange, choosing: Choosing | None) -> Task:
        arguments = {"section": self.plan.synthesise, "choosing": choosing}
        return self._map_task("synthesise", "synthetic", where, stretch, self._scene, arguments)

    def _simulation_task(self, where: _View, stretch: FrameRange) -> Task:
        assert self._simulation is not None
        assert self.plan.synthesise is not None
        axis = chosen_options(self.plan.synthesise).axis
        content = {"axis": asdict(axis), "simulation": self._simulation.as_json()}
        arguments = {"axis": axis, "simulation": self._simulation}
        return self._map_task("simulate", "simulated", where, stretch, content, arguments)

    def _map_task(
        self,
        step: Step,
        kind: str,
        where: _View,
        stretch: FrameRange,
        content: dict[str, Any],
        arguments: dict[str, Any],
    ) -> Task:
        """Return the task for a stretch of a map; its key hashes ``content``, mesh and sensor."""
        origin, mesh, placement, sensor = where
        view = {"sensor": sensor.as_dict(), "stretch": list(stretch)}
        key = key_of(step, {"mesh": mesh.identity, **view, **content})
        out = self.folder.result(kind, key, ".npz")
        arguments |= {"mesh": mesh, "sensor": sensor, "stretch": stretch, "out": out}
        frames = stretch[1] - stretch[0]
        return Task(step, key, origin, arguments, placement, frames, origin.name, str(out))

    def _denoising_task(self, synthesis: Sequence[Task]) -> Task:
        assert self.plan.denoise is not None
        (model, digest), texture = self.model, self.plan.denoise.texture
        drawn = {} if texture is None else {"texture": texture}
        key = key_of("denoise", {"model": digest, "maps": [one.key for one in synthesis], **drawn})
        ends = [".npz"] if len(synthesis) == 1 else [f"-{n}.npz" for n in range(len(synthesis))]
        outs = [self.folder.result("denoised", key, end) for end in ends]
        maps = [Path(one.out) for one in synthesis]
        arguments = {"maps": maps, "model": model, "digest": digest, "outs": outs, **drawn}
        one, frames = synthesis[0], sum(each.frames for each in synthesis)
        return Task(
            "denoise", key, one.origin, arguments, one.placement, frames, one.group, str(outs[-1])
        )

    def all_maps(self) -> Iterator[tuple[Origin, str, MeshInput, PlannedMap]]:
        """Yield every map of every recording that is inspected and fitted, in order.

        With the hash of what else is in the recording.
        """
        for origin in self.origins:
            found = known_inspection(self.folder, origin)
            mesh = None if found is None else found.mesh
            if found is not None and mesh is None and self.plan.fit is not None:
                assert found.video is not None
                mesh = fitted(Path(self.fit_task(origin, found.video).out))
            if found is not None and mesh is not None:
                for planned in self.maps_of(origin, mesh, found.sensor):
                    yield origin, found.about, mesh, planned


def _changing(origin: Origin) -> Sd2Error:
    return Sd2Error(
        f"{origin.path} changes while it is worked on",
        "files that stay as they are",
        "Start the batch again when it is complete",
    )


def simulation_of(section: Simulating) -> Simulation:
    """Read the radar of a plan; errors come before the work begins."""
    from sd2core.datasets.simulating import Simulation
    from sd2core.io.radar import named_radar

    return Simulation(named_radar(section.radar), section.seed)


def _model_of(plan: BatchPlan) -> tuple[str, str]:
    """Find the denoiser; errors come before the work begins."""
    from sd2core.denoise.files import default_name, describe_model, find_model

    assert plan.denoise is not None
    limbs = plan.synthesise is not None and plan.synthesise.limbs
    path = find_model(plan.denoise.model or default_name(limbs=limbs))
    card = describe_model(path)
    if plan.denoise.texture is not None:
        card.needed_texture()
    return str(path), file_digest(path)
