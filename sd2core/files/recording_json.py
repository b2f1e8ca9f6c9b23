"""``recording.json``: what it holds, checked when it is read. See ``docs/formats.md``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    FiniteFloat,
    PositiveInt,
    StringConstraints,
    model_validator,
)

from sd2core.errors import Cure, Sd2Error
from sd2core.files.texts import check_version, faults_in, read_json
from sd2core.files.turns import Turn, turned_further

FILE_NAME = "recording.json"
FORMAT: Literal["sd2-recording"] = "sd2-recording"
VERSION = 1

FARTHEST_S = 1e12
"""Times reach no farther from 0, where milliseconds still differ."""
Time = Annotated[FiniteFloat, Field(ge=-FARTHEST_S, le=FARTHEST_S)]
Pixels = Annotated[PositiveInt, Field(le=100_000)]
Focal = Annotated[FiniteFloat, Field(gt=0, le=1e6)]
"""A focal length in pixels; the window shows nothing through a longer one."""
PositiveFinite = Annotated[FiniteFloat, Field(gt=0)]
StoredPath = Annotated[str, StringConstraints(pattern=r"\S")]
"""A path that names something: nothing at all would be the recording's own folder."""

ImuPlace = Annotated[str, StringConstraints(pattern=r"^([a-z][a-z-]{0,39}|[0-9]{1,9})$")]
"""Name of a place on the body, or the number of a vertex."""


class Span(BaseModel):
    """A labelled stretch of time, half-open ``[start_s, end_s)``.

    Examples
    --------
    >>> import sd2core as sd2
    >>> span = sd2.Span(start_s=1.6, end_s=2.8, label="left-to-right")
    >>> round(span.end_s - span.start_s, 1)
    1.2
    """

    model_config = ConfigDict(extra="allow", frozen=True)

    start_s: Time
    end_s: Time
    label: str

    @model_validator(mode="after")
    def _ordered(self) -> Span:
        if not self.start_s < self.end_s:
            raise ValueError(f"the span ends at {self.end_s} s and starts at {self.start_s} s")
        return self


class BeamEntry(BaseModel):
    """Fields of :class:`sd2core.sensor.Beam`."""

    model_config = ConfigDict(extra="forbid")

    azimuth_width_deg: FiniteFloat
    elevation_width_deg: FiniteFloat
    cuts: Annotated[
        tuple[tuple[FiniteFloat, FiniteFloat, FiniteFloat], ...], Field(max_length=100_000)
    ] = ()


class SensorEntry(BaseModel):
    """Fields of :class:`sd2core.sensor.VirtualSensor`."""

    model_config = ConfigDict(extra="allow")

    position_m: tuple[FiniteFloat, FiniteFloat, FiniteFloat] = (0.0, 0.0, 0.0)
    azimuth_deg: FiniteFloat = 0.0
    elevation_deg: FiniteFloat = 0.0
    beam: BeamEntry | None = None


class ThingEntry(BaseModel):
    """Fields of :class:`sd2core.mesh.things.Thing`; a mesh file's path is relative."""

    model_config = ConfigDict(extra="forbid")

    shape: StoredPath
    position_m: tuple[FiniteFloat, FiniteFloat, FiniteFloat]
    turn_deg: FiniteFloat = 0.0
    size_m: tuple[FiniteFloat, FiniteFloat, FiniteFloat] | None = None


class WallEntry(BaseModel):
    """Fields of :class:`sd2core.mesh.walls.Wall`."""

    model_config = ConfigDict(extra="forbid")

    distance_m: FiniteFloat
    azimuth_deg: FiniteFloat = 0.0
    elevation_deg: FiniteFloat = 0.0
    loss_db: FiniteFloat


class MeshReading(BaseModel):
    """Options for reading a mesh file; see :func:`sd2core.io.mesh.load_mesh`."""

    model_config = ConfigDict(extra="allow", frozen=True)

    frames_per_s: PositiveFinite | None = None
    scale: PositiveFinite | None = None
    person: int | str | None = None
    image_size: tuple[Pixels, Pixels] | None = None
    focal_px: Focal | None = None
    distance_m: FiniteFloat | None = None
    turn: Turn | None = None
    body_model: StoredPath | None = None  # in full: what a recording keeps are the vertices

    def options(self) -> dict[str, Any]:
        """Arguments for ``load_mesh``: those that are given."""
        values = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: value for name, value in values.items() if value is not None}

    def cured(self, cure: Cure) -> MeshReading:
        """Options with a setting that puts right what was read with these."""
        value: float | str | None = cure.value
        if cure.setting == "turn":
            value = turned_further(self.turn, str(cure.value))
        return self.model_copy(update={cure.setting: value})


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


class CameraEntry(BaseModel):
    """The camera that took the video."""

    model_config = ConfigDict(extra="allow", frozen=True)

    focal_px: Focal  # in pixels of a picture of width × height
    width: Pixels | None = None  # None: that of the recording's video
    height: Pixels | None = None
    source: str = ""  # of the focal length: user, metadata, default or simulated

    def focal_for(self, width: int, height: int) -> float:
        """Focal length in pixels of a picture of another size."""
        if self.width is None or self.height is None:
            return self.focal_px
        return self.focal_px * max(width, height) / max(self.width, self.height)


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
    things: tuple[ThingEntry, ...] = ()
    bodies: tuple[BodyEntry, ...] = ()
    walls: tuple[WallEntry, ...] = ()
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
    with faults_in(file, expected, "Correct that entry with a text editor"):
        return Document.model_validate(content)
