"""Graph of tasks: from a recording to its meshes, maps and denoised maps."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sd2core.batch.exporting import dataset_key, dataset_path, is_exported, rows_of
from sd2core.batch.fitting import fit_choices, fitted
from sd2core.batch.folder import BatchFolder
from sd2core.batch.inputs import (
    Inspection,
    MeshInput,
    Origin,
    Somebody,
    VideoInput,
    known_inspection,
)
from sd2core.batch.plan import STEPS, BatchPlan, Step
from sd2core.batch.synthesis import Choosing
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
class PlannedShare:
    """Share of a person in the map from one place, or everybody's."""

    who: Somebody
    synthetic: Path | None  # none of somebody who is not in the scene
    denoising: Task | None = None


@dataclass(frozen=True)
class PlannedMap:
    """Map of one recording from one place."""

    placement: int  # 0 is the recording's own sensor; 1 and up are the places of the plan
    sensor: VirtualSensor
    synthesis: Task
    shares: tuple[PlannedShare, ...]
    simulation: Task | None = None  # of everybody

    @property
    def denoising(self) -> tuple[Task, ...]:
        """Tasks that denoise the shares."""
        return tuple(one.denoising for one in self.shares if one.denoising is not None)

    @property
    def tasks(self) -> tuple[Task, ...]:
        """All tasks of this map."""
        simulation = () if self.simulation is None else (self.simulation,)
        return (self.synthesis, *self.denoising, *simulation)


class TaskGraph:
    """Tasks of a batch, each known as soon as the tasks before it are done.

    The paths of the plan are absolute. ``total`` counts the tasks per step that are known
    of so far; a map counts once until it is known how many persons it is of.
    """

    def __init__(self, plan: BatchPlan, folder: BatchFolder, origins: Sequence[Origin]) -> None:
        self.plan, self.folder, self.origins = plan, folder, origins
        section = plan.synthesise
        self._scene: dict[str, Any] = {}
        if section is not None:
            settings = ("tolerance", "vertices_kept", "left_out", "limbs")
            self._scene = {name: getattr(section, name) for name in settings}
            self._scene["options"] = asdict(chosen_options(section))
        # File of the denoiser and the hash of its content.
        self.model = None if plan.denoise is None else _model_of(plan)
        self._simulation = None if plan.simulate is None else simulation_of(plan.simulate)
        # Of a map that is not there yet.
        self._denoising: dict[tuple[str, int], tuple[Task, ...]] = {}
        self.total: Counter[str] = Counter()
        self.total["inspect"] = len(origins)
        if plan.export is not None:
            self.total["export"] = 1
        self.total += Counter(self._maps_of_one(len(origins)))

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
            inspection = known_inspection(self.folder, task.origin)
            if inspection is None:
                raise _changing(task.origin)
            return self._after_inspection(task.origin, inspection)
        if task.step == "fit":
            mesh, inspection = fitted(Path(task.out)), known_inspection(self.folder, task.origin)
            if mesh is None or inspection is None:
                raise _changing(task.origin)
            return self._synthesis(task.origin, inspection, mesh)
        if task.step == "synthesise":
            return iter(self._denoising.pop((task.origin.name, task.placement or 0), ()))
        return iter(())

    def lost_with(self, task: Task) -> dict[str, int]:
        """Count the tasks per step that cannot be done because this one failed."""
        if task.step in ("inspect", "fit"):
            return self._maps_of_one(1)
        where = (task.origin.name, task.placement or 0)
        if task.step == "synthesise" and where in self._denoising:
            return {"denoise": len(self._denoising.pop(where))}
        return {}

    def _maps_of_one(self, recordings: int) -> dict[str, int]:
        maps = recordings * self.plan.placement_count
        return {step: maps for step in _MAPS if step in self.steps}

    def _after_inspection(self, origin: Origin, inspection: Inspection) -> Iterator[Task]:
        if inspection.mesh is not None:
            return self._synthesis(origin, inspection, inspection.mesh)
        assert inspection.video is not None
        if self.plan.fit is None:
            raise Sd2Error(
                f"{origin.path} is a video without a mesh",
                "a section [fit] in the plan, which makes one",
            )
        self.total["fit"] += 1
        return iter((self.fit_task(origin, inspection.video),))

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

    def _synthesis(self, origin: Origin, inspection: Inspection, mesh: MeshInput) -> Iterator[Task]:
        for planned in self.maps_of(origin, inspection, mesh):
            if self.model is not None:
                self.total["denoise"] += len(planned.denoising) - 1
            if planned.denoising:
                self._denoising[origin.name, planned.placement] = planned.denoising
            yield planned.synthesis
        if self._simulation is not None:
            # After all that is quick, so that this can be given out together.
            for planned in self.maps_of(origin, inspection, mesh):
                assert planned.simulation is not None
                yield planned.simulation

    def maps_of(
        self, origin: Origin, inspection: Inspection, mesh: MeshInput
    ) -> Iterator[PlannedMap]:
        """Yield all maps of one recording, for a data set those of whom its labels name."""
        if self.plan.synthesise is None:
            return
        people = () if self.plan.export is None else inspection.people
        bodies = 1 + len(mesh.others_m) if people else 1
        sensors = self.plan.sensors(inspection.sensor, mesh.target_m)
        choosing = self._choosing(mesh, list(sensors.values()))
        for placement, sensor in sensors.items():
            where = (origin, mesh, placement, sensor)
            synthesis = self._synthesis_task(where, choosing, bodies)
            shares = tuple(self._share(synthesis, one) for one in people or (Somebody(),))
            simulation = None if self._simulation is None else self._simulation_task(where)
            yield PlannedMap(placement, sensor, synthesis, shares, simulation)

    def _share(self, synthesis: Task, who: Somebody) -> PlannedShare:
        if who.body is None:
            return PlannedShare(who, None)
        synthetic = synthesis.arguments["outs"][who.body]
        denoising = None if self.model is None else self._denoising_task(synthesis, synthetic)
        return PlannedShare(who, synthetic, denoising)

    def _choosing(self, mesh: MeshInput, sensors: Sequence[VirtualSensor]) -> Choosing | None:
        """Describe the choice of an accuracy plan for a mesh; None without a tolerance."""
        if self._scene["tolerance"] is None:
            return None
        from sd2core.accuracy.places import spread

        places, frames = spread(sensors), mesh.frames * len(sensors)
        about = {"places": [asdict(one) for one in places], "frames": frames}
        key = key_of("synthesise", {"mesh": mesh.identity, **self._scene, **about})
        return Choosing(self.folder.result("plans", key, ".json"), places, frames)

    def _synthesis_task(self, where: _View, choosing: Choosing | None, bodies: int) -> Task:
        arguments = {"section": self.plan.synthesise, "choosing": choosing}
        content = self._scene | ({"bodies": bodies} if bodies > 1 else {})
        return self._map_task("synthesise", where, content, arguments, bodies)

    def _simulation_task(self, where: _View) -> Task:
        assert self._simulation is not None
        assert self.plan.synthesise is not None
        axis = chosen_options(self.plan.synthesise).axis
        content = {"axis": asdict(axis), "simulation": self._simulation.as_json()}
        arguments = {"axis": axis, "simulation": self._simulation}
        return self._map_task("simulate", where, content, arguments)

    def _map_task(
        self,
        step: Step,
        where: _View,
        content: dict[str, Any],
        arguments: dict[str, Any],
        maps: int = 1,
    ) -> Task:
        """Return the task for maps; its key hashes ``content``, mesh and sensor."""
        origin, mesh, placement, sensor = where
        key = key_of(step, {"mesh": mesh.identity, "sensor": sensor.as_dict(), **content})
        outs = self._files("synthetic" if step == "synthesise" else "simulated", key, maps)
        arguments |= {"mesh": mesh, "sensor": sensor, "outs": outs}
        frames = mesh.frames * maps
        return Task(step, key, origin, arguments, placement, frames, origin.name, str(outs[-1]))

    def _files(self, kind: str, key: str, count: int) -> list[Path]:
        ends = [".npz"] if count == 1 else [f"-{number}.npz" for number in range(count)]
        return [self.folder.result(kind, key, end) for end in ends]

    def _denoising_task(self, synthesis: Task, synthetic: Path) -> Task:
        assert self.plan.denoise is not None
        assert self.model is not None
        (model, digest), texture = self.model, self.plan.denoise.texture
        drawn = {} if texture is None else {"texture": texture}
        key = key_of("denoise", {"model": digest, "map": synthetic.stem, **drawn})
        out = self.folder.result("denoised", key, ".npz")
        arguments = {"synthetic": synthetic, "model": model, "out": out, **drawn}
        frames = synthesis.frames // len(synthesis.arguments["outs"])
        return replace(
            synthesis, step="denoise", key=key, arguments=arguments, frames=frames, out=str(out)
        )

    def all_maps(self) -> Iterator[tuple[Origin, str, MeshInput, PlannedMap]]:
        """Yield every map of every recording that is inspected and fitted, in order.

        With the hash of what else is in the recording.
        """
        for origin in self.origins:
            inspection = known_inspection(self.folder, origin)
            mesh = None if inspection is None else inspection.mesh
            if inspection is not None and mesh is None and self.plan.fit is not None:
                assert inspection.video is not None
                mesh = fitted(Path(self.fit_task(origin, inspection.video).out))
            if inspection is not None and mesh is not None:
                for planned in self.maps_of(origin, inspection, mesh):
                    yield origin, inspection.about, mesh, planned


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
