"""Tasks that make synthetic and simulated Doppler maps of a mesh."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sd2core.batch.inputs import MeshInput, open_mesh
from sd2core.doppler.options import chosen_options
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_json
from sd2core.files.texts import read_json
from sd2core.options.synthesis import Synthesis
from sd2core.sensor import VelocityAxis, VirtualSensor

if TYPE_CHECKING:
    from sd2core.datasets.simulating import Simulation
    from sd2core.doppler import Synthesizer
    from sd2core.mesh.sequence import MeshSequence
    from sd2core.placements.body_extent import BodyExtent

PREPARED_BYTES = 128 << 20
"""Memory for the prepared part of a mesh; with less a block would be prepared twice."""


@dataclass(frozen=True)
class Choosing:
    """Maps for which an accuracy plan is chosen: once for all maps of a mesh."""

    path: Path  # file that keeps the plan
    places: Sequence[VirtualSensor]  # some of all, see sd2core.accuracy.places.spread
    frames: int  # of all maps together


@dataclass
class _Kept:
    """Objects that a process keeps from one task to the next of the same mesh."""

    mesh_of: MeshInput | None = None
    mesh: MeshSequence | None = None
    body: BodyExtent | None = None
    made_for: tuple[Any, ...] = ()
    synthesizer: Synthesizer | None = None


_kept = _Kept()


def synthesise(
    mesh: MeshInput,
    sensor: VirtualSensor,
    section: Synthesis,
    choosing: Choosing | None,
    outs: Sequence[Path],
) -> None:
    """Make a map and write it.

    Parameters
    ----------
    mesh : MeshInput
        Kept open for further tasks of the same mesh.
    sensor : VirtualSensor
        Sd2Error if it stands in the body.
    section : Synthesis
        Section ``[synthesise]`` of the plan.
    choosing : Choosing or None
        For a section with a tolerance: maps that share an accuracy plan.
    outs : sequence of Path
        Map to write (.npz), or one of each body of the scene alone, in order.
    """
    from sd2core.body.parts import synthetic_map
    from sd2core.datasets.kept_maps import found_map, synthetic_key
    from sd2core.datasets.people import map_of

    refuse_inside(mesh, sensor)
    plan = None if choosing is None else chosen_plan(mesh, section, choosing)
    maker, limbs = _synthesizer(mesh, section, plan), section.limbs or len(outs) > 1
    # Looked for only: the batch's own folder keeps what it makes.
    key = synthetic_key(mesh.identity, maker, sensor, limbs=limbs)
    doppler = found_map(key) or synthetic_map(maker, sensor, limbs=limbs)
    if plan is not None:
        doppler = replace(doppler, meta=doppler.meta | plan["provenance"])
    outs[0].parent.mkdir(parents=True, exist_ok=True)
    if len(outs) == 1:
        doppler.save(outs[0])
        return
    scene = kept_mesh(mesh)
    for person, body, out in zip(scene.persons, scene.bodies, outs, strict=True):
        one = map_of(person, body, doppler)
        (one if section.limbs else replace(one, limbs=None)).save(out)


def simulate(
    mesh: MeshInput,
    sensor: VirtualSensor,
    simulation: Simulation,
    axis: VelocityAxis,
    outs: Sequence[Path],
) -> None:
    """Make the map that a radar would show and write it.

    Parameters
    ----------
    mesh : MeshInput
        With faces; kept open for further tasks of the same mesh.
    sensor : VirtualSensor
        Sd2Error if it stands in the body.
    simulation : Simulation
        Radar and seed.
    axis : VelocityAxis
        Of the map.
    outs : sequence of Path
        Map to write (.npz), one.
    """
    from sd2core.datasets.simulating import simulated_map

    refuse_inside(mesh, sensor)
    doppler = simulated_map(kept_mesh(mesh), sensor, simulation, axis)
    outs[0].parent.mkdir(parents=True, exist_ok=True)
    doppler.save(outs[0])


def refuse_inside(mesh: MeshInput, sensor: VirtualSensor) -> None:
    """Refuse a sensor that stands in the body."""
    from sd2core.placements.body_extent import BodyExtent

    opened = kept_mesh(mesh)
    if _kept.body is None:
        _kept.body = BodyExtent.of(opened)
    if _kept.body.coverage((sensor,)).inside[0]:
        x, y, z = sensor.position_m
        raise Sd2Error(
            f"A sensor at {x:g}, {y:g}, {z:g} m stands in the body",
            "a place outside the box around it, at any time of the clip",
            "Place it farther away",
        )


def kept_mesh(wanted: MeshInput) -> MeshSequence:
    """Open a mesh, which this process keeps until it needs another one."""
    if _kept.mesh is None or _kept.mesh_of != wanted:
        # Before another one is opened, so that there are never two.
        _kept.mesh, _kept.body, _kept.synthesizer, _kept.made_for = None, None, None, ()
        _kept.mesh = open_mesh(Path(wanted.path), wanted.faces, wanted.reading or {})
        _kept.mesh_of = wanted
    return _kept.mesh


def _synthesizer(mesh: MeshInput, section: Synthesis, plan: dict[str, Any] | None) -> Synthesizer:
    from sd2core.accuracy.plans import AccuracyPlan
    from sd2core.doppler import Synthesizer
    from sd2core.mesh.decimation import decimate

    opened = kept_mesh(mesh)
    wanted = (section, None if plan is None else json.dumps(plan["plan"], sort_keys=True))
    if _kept.synthesizer is None or _kept.made_for != wanted:
        _kept.synthesizer = None
        options, share = chosen_options(section), section.vertices_kept or 1.0
        left_out = section.left_out or ()
        if plan is not None:
            settings = AccuracyPlan.from_json(plan["plan"])
            options, share = settings.options(options), settings.vertices_kept
            left_out = settings.left_out
        _kept.synthesizer = Synthesizer(
            decimate(opened, share),
            options,
            memory_budget_bytes=PREPARED_BYTES,
            threads=1,
            left_out=left_out,
        )
        _kept.made_for = wanted
    return _kept.synthesizer


def chosen_plan(mesh: MeshInput, section: Synthesis, choosing: Choosing) -> dict[str, Any]:
    """Return the accuracy plan of a mesh, chosen once and kept."""
    if (known := read_plan_of(choosing.path)) is not None:
        return known
    from sd2core.accuracy.places import choose_for_places

    assert section.tolerance is not None
    placed = choose_for_places(
        kept_mesh(mesh),
        choosing.places,
        choosing.frames,
        section.tolerance,
        chosen_options(section),
    )
    known = {"plan": placed.plan.to_json(), "provenance": placed.provenance()}
    choosing.path.parent.mkdir(parents=True, exist_ok=True)
    atomic_write_json(choosing.path, known)
    return known


def read_plan_of(path: Path) -> dict[str, Any] | None:
    """Read an accuracy plan that was chosen, if there is one."""
    try:
        content: dict[str, Any] = read_json(path)
    except Sd2Error:
        return None
    return content
