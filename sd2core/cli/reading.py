"""Reading of the files that the command line names; commands load this when they run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from sd2core.cli.output import picked, progress_bar
from sd2core.errors import Sd2Error
from sd2core.files.paths import is_pattern, plain_path
from sd2core.io.beam_files import find_beam
from sd2core.mesh.sequence import MeshSequence
from sd2core.options.bounds import AZIMUTH_DEG, ELEVATION_DEG
from sd2core.options.records import given_flags
from sd2core.options.shared import Axis, Looking, MeshAndSensor, MeshInput, MeshReading
from sd2core.placements.body_extent import BodyExtent
from sd2core.recording.recording import MeshReading as StoredReading
from sd2core.recording.recording import Recording, is_recording, open_recording
from sd2core.sensor import VelocityAxis, VirtualSensor, aimed_at

_AIM = "AZ,EL in degrees (up to ±360 and ±90), or body"
_OF_ESTIMATORS = ("person", "image_size", "focal_px", "body_model")
_OF_THE_MESH = ("faces", "fps", "scale", "distance_m", "turn", *_OF_ESTIMATORS)


def mesh_reading(options: MeshReading) -> StoredReading:
    """Options for reading a mesh from the command line."""
    alike = picked(options, "scale", "person", "distance_m", "turn", "image_size", "focal_px")
    model = None if options.body_model is None else str(plain_path(options.body_model))
    return StoredReading(frames_per_s=options.fps, body_model=model, **alike)


def load_mesh_from_options(path: Path, options: MeshReading) -> MeshSequence:
    """Load a mesh with the options on how to read it."""
    from sd2core.io.mesh import load_mesh

    refuse_unused_mesh_options(options, path, path)
    with progress_bar("Reading the mesh") as progress:
        return load_mesh(
            path, faces=options.faces, progress=progress, **mesh_reading(options).options()
        )


def mesh_and_sensor(options: MeshAndSensor) -> tuple[MeshSequence, VirtualSensor]:
    """Mesh, and sensor of the recording or the camera, with what is given in its place."""
    mesh, sensor = mesh_and_its_sensor(options)
    if options.sensor is not None:
        sensor = replace(sensor, position_m=options.sensor)
    return mesh, looking(sensor, options, lambda: mesh)


def looking(
    sensor: VirtualSensor, options: Looking, mesh: Callable[[], MeshSequence]
) -> VirtualSensor:
    """Sensor with the direction and the beam that are given; ``mesh`` is what ``body`` is about."""
    if options.beam is not None:
        sensor = replace(sensor, beam=find_beam(options.beam))
    if options.aim == "body":
        return aimed_at(sensor, BodyExtent.of(mesh()).target_m)
    if options.aim is not None:
        try:
            azimuth_deg, elevation_deg = map(float, options.aim.split(","))
        except ValueError:
            raise Sd2Error(f"--aim is {options.aim!r}", _AIM) from None
        if azimuth_deg not in AZIMUTH_DEG or elevation_deg not in ELEVATION_DEG:
            raise Sd2Error(f"--aim is {options.aim!r}", _AIM)
        sensor = replace(sensor, azimuth_deg=azimuth_deg, elevation_deg=elevation_deg)
    return sensor


def mesh_and_its_sensor(options: MeshInput) -> tuple[MeshSequence, VirtualSensor]:
    """Mesh, and sensor of the recording or the camera."""
    if not is_recording(options.mesh):
        return load_mesh_from_options(options.mesh, options), VirtualSensor()
    recording = open_recording_from_options(options.mesh, options)
    return mesh_of(recording, options), recording.sensor


def mesh_of(recording: Recording, options: MeshReading) -> MeshSequence:
    """Read a recording's mesh: everybody, or who is named of several."""
    with progress_bar("Reading the mesh") as progress:
        mesh = recording.load_mesh(progress)
    whom = options.person if recording.bodies else None
    return mesh if whom is None else mesh.body(whom)


def open_recording_from_options(path: Path, options: MeshReading) -> Recording:
    """Open a recording; options on how to read its mesh replace the stored ones."""
    recording = open_recording(path)
    if recording.bodies:  # of whom one may be named
        options = replace(options, person=None)
    refuse_unused_mesh_options(options, path, recording.mesh)
    recording.mesh_reading = recording.mesh_reading.model_copy(
        update=mesh_reading(options).options()
    )
    if options.faces is not None:
        if not options.faces.exists():
            raise Sd2Error(f"The faces file {options.faces} does not exist", "a file of triangles")
        recording.faces = options.faces
    return recording


def refuse_unused_mesh_options(
    options: MeshReading, path: Path, mesh: Path | None, *, but: tuple[str, ...] = ()
) -> None:
    """Refuse options on how to read a mesh that would change nothing.

    Parameters
    ----------
    options : MeshReading
        As they were typed.
    path : Path
        What was named, for the message.
    mesh : Path or None
        Mesh that is read; None if there is none.
    but : tuple of str
        Fields that are used for something else, too, and not refused.
    """
    if mesh is None:
        for name in given_flags(options, (n for n in _OF_THE_MESH if n not in but)):
            raise Sd2Error(f"{name} is given, and {path} holds no mesh", f"{name} for a mesh only")
        return
    if is_pattern(mesh) or mesh.is_dir():  # files whose names may tell persons
        but += ("person",)
    for name in given_flags(options, (n for n in _OF_ESTIMATORS if n not in but)):
        from sd2core.io.mesh_models import is_estimate

        if not is_estimate(mesh):
            raise Sd2Error(
                f"{name} is given, and {mesh} is not the output of an estimator of bodies",
                f"{name} for such files only (docs/formats.md)",
            )


def chosen_axis(options: Axis, usual: VelocityAxis | None = None) -> VelocityAxis:
    """Velocity axis of ``--bins`` and ``--v-max``; what is not given is as usual."""
    usual = usual or VelocityAxis()
    return VelocityAxis(options.bins or usual.bins, options.v_max_mps or usual.v_max_mps)
