"""The task that simulates what a radar shows of a stretch of a mesh."""

from __future__ import annotations

from pathlib import Path

from sd2core.batch.inputs import MeshInput
from sd2core.batch.stretches import Stretch
from sd2core.batch.synthesis import kept_mesh, refuse_inside
from sd2core.datasets.simulating import Simulation, simulated_map
from sd2core.sensor import VelocityAxis, VirtualSensor


def simulate(
    mesh: MeshInput,
    sensor: VirtualSensor,
    simulation: Simulation,
    axis: VelocityAxis,
    stretch: Stretch,
    out: Path,
) -> None:
    """Make the simulated map of some frames and write it.

    Parameters
    ----------
    mesh : MeshInput
    sensor : VirtualSensor
    simulation : Simulation
    axis : VelocityAxis
    stretch : (int, int)
        Equal to these columns of the map of the whole clip.
    out : Path

    Raises
    ------
    Sd2Error
        When the mesh cannot be read or has no faces, or the sensor stands in the body.
    """
    refuse_inside(mesh, sensor)
    doppler = simulated_map(kept_mesh(mesh), sensor, simulation, axis, stretch)
    out.parent.mkdir(parents=True, exist_ok=True)
    doppler.save(out)
