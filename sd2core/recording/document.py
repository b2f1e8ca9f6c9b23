"""``recording.json``: what it holds, checked when it is read. See ``docs/formats.md``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, FiniteFloat, PositiveInt, StringConstraints

from sd2core.errors import Sd2Error
from sd2core.files.recording_json import CameraEntry, MeshReading, Span, StoredPath, Time
from sd2core.files.texts import check_version, errors_in, faults_in, read_json
from sd2core.mesh.things import Thing
from sd2core.mesh.walls import Wall
from sd2core.sensor import Beam

FORMAT: Literal["sd2-recording"] = "sd2-recording"
VERSION = 1

ImuPlace = Annotated[str, StringConstraints(pattern=r"^([a-z][a-z-]{0,39}|[0-9]{1,9})$")]
"""Name of a place on the body, or the number of a vertex."""


class SensorEntry(BaseModel):
    """Fields of :class:`sd2core.sensor.VirtualSensor`."""

    model_config = ConfigDict(extra="allow")

    position_m: tuple[FiniteFloat, FiniteFloat, FiniteFloat] = (0.0, 0.0, 0.0)
    azimuth_deg: FiniteFloat = 0.0
    elevation_deg: FiniteFloat = 0.0
    beam: Beam | None = None


class BodyEntry(BaseModel):
    """Fields of :class:`sd2core.mesh.bodies.Body`; its paths are relative."""

    model_config = ConfigDict(extra="forbid")

    path: StoredPath
    moved_m: tuple[FiniteFloat, FiniteFloat, FiniteFloat] = (0.0, 0.0, 0.0)
    turn_deg: FiniteFloat = 0.0
    start_s: Time = 0.0
    person: str = ""
    reading: MeshReading = MeshReading()
    faces: StoredPath | None = None


class Document(BaseModel):
    """Content of ``recording.json``; fields that this version does not know are kept."""

    model_config = ConfigDict(extra="allow", validate_assignment=True)

    format: Literal["sd2-recording"] = FORMAT
    version: int = VERSION
    title: str = ""
    subject: str = ""
    simulated: bool = False
    video: StoredPath | None = None
    camera: CameraEntry | None = None
    mesh: StoredPath | None = None
    mesh_reading: MeshReading = MeshReading()
    faces: StoredPath | None = None
    radar: StoredPath | None = None
    radar_offset_s: Time = 0.0
    radar_receiver: PositiveInt | None = None
    radar_transmitter: PositiveInt | None = None
    imu: StoredPath | None = None
    imu_offset_s: Time = 0.0
    imu_places: tuple[ImuPlace, ...] = ()
    denoiser: StoredPath | None = None
    bundled_denoiser: str | None = None
    sensor: SensorEntry = SensorEntry()
    placements: dict[str, Any] | None = None
    things: tuple[Thing, ...] = ()  # paths of their files are relative
    bodies: tuple[BodyEntry, ...] = ()
    walls: tuple[Wall, ...] = ()
    spans: tuple[Span, ...] = ()


def read_document(file: Path) -> Document:
    """Read and check a ``recording.json``.

    Raises Sd2Error if it is not there, is damaged, or was written by a newer version.
    """
    if not os.path.exists(file):
        raise Sd2Error(f"{file.parent} has no {file.name}", "a recording made by `sd2 import`")
    content = read_json(file)
    check_version(content, file, FORMAT, VERSION)
    expected = "what docs/formats.md says of a recording"
    with errors_in(file), faults_in(file, expected, "Correct that entry with a text editor"):
        return Document.model_validate(content)
