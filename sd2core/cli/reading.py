"""Reading what the command line names."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from sd2core.cli.output import progress_bar
from sd2core.errors import Sd2Error

if TYPE_CHECKING:
    from sd2core.mesh import MeshSequence
    from sd2core.recording import MeshReading
    from sd2core.sensor import VirtualSensor


def mesh_reading(options: argparse.Namespace) -> MeshReading:
    """How to read a mesh, as far as the command line says it."""
    from sd2core.recording import MeshReading

    return MeshReading(
        frames_per_s=options.fps,
        scale=options.scale,
        person=options.person,
        distance_m=options.distance_m,
        image_size=options.image_size,
        focal_px=options.focal_px,
    )


def load_mesh_as_told(path: Path, options: argparse.Namespace) -> MeshSequence:
    """Load a mesh with ``--faces`` and what else is given on the command line."""
    from sd2core.io.mesh import load_mesh

    with progress_bar("Reading the mesh") as progress:
        return load_mesh(
            path, faces=options.faces, progress=progress, **mesh_reading(options).options()
        )


def mesh_and_sensor(options: argparse.Namespace) -> tuple[MeshSequence, VirtualSensor]:
    """The mesh, and the sensor of the recording or the camera with ``--sensor`` in its place."""
    from sd2core.recording import is_recording, open_recording
    from sd2core.sensor import VirtualSensor

    sensor = VirtualSensor()
    if is_recording(options.mesh):
        recording = open_recording(options.mesh)
        sensor = recording.sensor
        with progress_bar("Reading the mesh") as progress:
            mesh = recording.load_mesh(progress)
    else:
        mesh = load_mesh_as_told(options.mesh, options)
    if options.sensor is not None:
        sensor = replace(sensor, position_m=options.sensor)
    return mesh, sensor


def check_output(path: Path, suffix: str) -> None:
    """Refuse an output file that cannot be written, before the work is done."""
    if path.suffix.lower() != suffix:
        raise Sd2Error(f"The output file is {path}", f"a name that ends in {suffix}")
    if not path.absolute().parent.is_dir():
        raise Sd2Error(
            f"The folder {path.absolute().parent} does not exist",
            "an existing folder for the output file",
        )
