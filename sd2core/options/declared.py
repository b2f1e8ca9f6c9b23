"""What files declare, with its type and bounds: metadata of maps, sources of data sets, columns.

Whoever shows such a file, learns from it or draws it reads the same records, so that a number that
nobody wrote is refused in words before memory is taken for it or something is looked up by it.
Bounds of single numbers are in :mod:`sd2core.options.bounds`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from sd2core.errors import Sd2Error
from sd2core.files.texts import errors_in, faults_in
from sd2core.options.bounds import (
    COORDINATE_M,
    COUNT,
    FRAME_RATE_HZ,
    NUMBER_OF_ROWS,
    PLACEMENT,
    TIME_S,
    UP_TO_ONE,
    Bounds,
)
from sd2core.options.kinds import MapKind
from sd2core.sensor import Beam

_MANY = 65_536
_DAMAGED = "Copy it again from where it came, or write it again"

_Number = Annotated[float, Bounds()]
_Share = Annotated[float, UP_TO_ONE]
_Rows = Annotated[int, NUMBER_OF_ROWS]
_Error = Annotated[float, Field(ge=0.0)]  # Infinite where an empty map changes.


class _Record(BaseModel):
    """Known keys of a description are of their types; others are kept as they are."""

    model_config = ConfigDict(strict=True, extra="allow")


class SensorMeta(_Record):
    """A virtual sensor in metadata."""

    position_m: Annotated[list[Annotated[float, COORDINATE_M]], Field(min_length=3, max_length=3)]
    azimuth_deg: _Number = 0.0
    elevation_deg: _Number = 0.0
    beam: Beam | None = None


class _Plan(_Record):
    text: str


class MapMeta(_Record):
    """Provenance of a Doppler map, as far as anything is done with it."""

    sensor: SensorMeta | list[_Number] | None = None
    options: dict[str, Any] = {}
    plan: _Plan | None = None
    count: str = ""
    visibility: str = ""
    visible_share: Annotated[list[_Share], Field(min_length=1)] | None = None
    beyond_share: Annotated[list[_Share], Field(min_length=1)] | _Share | None = None
    mask_stride: Annotated[int, COUNT] = 1
    body_error_l1: _Error | None = None
    plan_error_l1: _Error | None = None
    radar: dict[str, Any] | str | None = None
    denoiser: dict[str, Any] = {}
    notes: Annotated[list[str], Field(max_length=_MANY)] = []


class _InertialMeta(_Record):
    cutoff_hz: Annotated[float, FRAME_RATE_HZ]


class _SourceProvenance(MapMeta):
    maps: dict[MapKind, MapMeta]
    damaged_frames: _Rows = 0
    imu: dict[str, _InertialMeta] = {}


class SourceEntry(_Record):
    """Line of a source in the index of a data set."""

    subject: str
    recording: str
    placement: Annotated[int, PLACEMENT]
    start: _Rows
    stop: _Rows
    frames: _Rows
    frames_with_person: _Rows
    frame_rate_hz: Annotated[float, FRAME_RATE_HZ]
    labels: list[str]
    classes: dict[str, str]
    units: dict[MapKind, str]
    provenance: _SourceProvenance
    spans: dict[str, _Rows] = {}

    @model_validator(mode="after")
    def _in_order(self) -> SourceEntry:
        if self.stop < self.start:
            raise ValueError(f"its segments are {self.start} to {self.stop}")
        return self


class _Protocol(_Record):
    name: str = ""
    order: str = ""


class PairProvenance(_Record):
    """Provenance of pairs, as far as anything is done with it."""

    made_by: str = ""
    simulated: bool = False
    protocol: _Protocol | None = None
    scenes: dict[str, list[str]] = {}
    frames_lost: dict[str, _Rows] = {}


def check_record(kind: type[BaseModel], content: Any, place: str | Path) -> None:
    """Refuse a description whose keys are not of their types, or beyond their bounds.

    Parameters
    ----------
    kind : type
        One of the records of this module.
    content : object
        As parsed from JSON.
    place : str or Path
        Where it stands, for the error.
    """
    what = "a description as it was written"
    with errors_in(place, _DAMAGED), faults_in(place, what, _DAMAGED):
        kind.model_validate(content)


def check_names(names: Collection[str], what: str, place: str | Path) -> None:
    """Refuse names that stand twice, or are too many to be numbered."""
    if len(set(names)) < len(names) or len(names) > _MANY:
        raise Sd2Error(
            f"{place} has {len(names):,} {what}, {len(set(names)):,} of them different",
            f"up to {_MANY:,}, each once",
            _DAMAGED,
        )


def column_bounds(labels: int, subjects: int, sources: int, splits: int) -> Mapping[str, Bounds]:
    """Bounds of the columns of a data set, by how many names its numbers stand for.

    Parameters
    ----------
    labels, subjects, sources, splits : int
        Number of each.
    """

    def places(count: int) -> Bounds:
        return Bounds(0, count - 1, whole=True)

    return {
        "label": places(labels),
        "segment_label": places(labels),
        "subject": places(subjects),
        "source": places(sources),
        "split": places(splits),
        "placement": PLACEMENT,
        "purity": UP_TO_ONE,
        "start_s": TIME_S,
        "end_s": TIME_S,
        "start_frame": Bounds(-NUMBER_OF_ROWS.high, NUMBER_OF_ROWS.high, whole=True),
        "sensor_position_m": COORDINATE_M,
    }


class DeclaredColumn:
    """Column of a file whose numbers are compared with their bounds whenever they are read."""

    def __init__(self, array: Any, place: str, bounds: Bounds) -> None:
        self._array, self._place, self._bounds = array, place, bounds

    def __len__(self) -> int:
        return len(self._array)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._array, name)

    def __getitem__(self, key: Any) -> NDArray[Any]:
        values = np.asarray(self._array[key])
        low, high = self._bounds.low, self._bounds.high
        wrong = ~((values >= low) & (values <= high))  # NaN is wrong, too
        if wrong.any():
            raise Sd2Error(
                f"{self._place} holds {values[wrong].flat[0]:g}", self._bounds.words, _DAMAGED
            )
        return values
