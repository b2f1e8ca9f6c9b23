"""Lines and rows of a store of pairs, checked as they are read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field, ValidationError

from sd2core.errors import Sd2Error
from sd2core.files.limits import open_regular
from sd2core.files.stores import Damage, StoredArray
from sd2core.files.texts import first_fault, parse_json, whole_lines
from sd2core.mesh.vertex_parts import QUANTITIES

INDEX_NAME = "takes.jsonl"
REMAKE = "Make the pairs again with `sd2 simulate campaign` or `sd2 pairs`"


class TakeKey(NamedTuple):
    """Key of a take, unique in a set."""

    subject: str
    name: str
    placement: int


_Finite = Annotated[float, Field(allow_inf_nan=False)]


class _Header(BaseModel):
    bins: Annotated[int, Field(ge=2, le=1 << 16)]
    v_max_mps: Annotated[_Finite, Field(gt=0)]
    null_bins: tuple[int, ...]
    frame_rate_hz: Annotated[_Finite, Field(gt=0)]
    labels: Annotated[tuple[str, ...], Field(min_length=1)]
    provenance: dict[str, Any]
    parts: tuple[str, ...] = ()
    joints: tuple[str, ...] = ()


class _Entry(BaseModel):
    subject: str
    name: str
    placement: Annotated[int, Field(ge=0)]
    start: Annotated[int, Field(ge=0)]
    stop: Annotated[int, Field(le=1 << 40)]
    sensor_position_m: tuple[_Finite, _Finite, _Finite]


def check_header(path: Path, header: Mapping[str, Any]) -> None:
    """Raise Sd2Error for a header that is damaged."""
    try:
        known = _Header.model_validate(header, strict=False)
        if any(not 0 <= number < known.bins for number in known.null_bins):
            raise ValueError(f"null_bins are {list(known.null_bins)}")
    except ValueError as error:
        raise Sd2Error(
            f"{path}: its header is damaged ({_reason_of(error)})", "one as it was written", REMAKE
        ) from error


def _read_entry(line: str) -> dict[str, Any]:
    """Return the take that a line describes; ValueError if it is none."""
    try:
        entry: dict[str, Any] = parse_json(line, "it", "one take")
    except Sd2Error as error:
        raise ValueError(error.found) from None
    known = _Entry.model_validate(entry)
    if known.stop <= known.start:
        raise ValueError(f"its frames are {known.start} to {known.stop}")
    return entry


def _reason_of(error: ValueError) -> str:
    """Place and reason of what pydantic refused, or what else was said."""
    return first_fault(error) if isinstance(error, ValidationError) else str(error)


def check_array(array: StoredArray, frames: int, row: tuple[int, ...], kind: str) -> None:
    """Raise Sd2Error for an array that is not of this type, or has too few frames."""
    if array.shape[:1] < (frames,):
        raise Sd2Error(
            f"{array.path}: the array {array.name} is missing or shorter than {INDEX_NAME} says",
            f"{frames} frames",
            REMAKE,
        )
    if array.shape[1:] != row or array.dtype != np.dtype(kind):
        raise Sd2Error(
            f"{array.path}: rows of {array.name} are {array.dtype} of shape {array.shape[1:]}",
            f"{kind} of shape {row}",
            REMAKE,
        )


def row_kinds(header: Mapping[str, Any]) -> dict[str, tuple[tuple[int, ...], str]]:
    """Shape of a row and type of every array, by a store's header."""
    bins, parts, joints = header["bins"], len(header.get("parts", ())), header.get("joints", ())
    kinds: dict[str, tuple[tuple[int, ...], str]] = {
        "synthetic": ((bins,), "float32"),
        "radar": ((bins,), "float32"),
        "times_s": ((), "float64"),
        "label": ((), "int8"),
    }
    if parts:
        kinds["limbs"] = (parts, bins), "float32"
    if joints:  # stores of before there were kinematics have none
        kinds["kinematics"] = (len(joints), len(QUANTITIES)), "float32"
    return kinds


def read_rows(
    path: Path, arrays: Mapping[str, StoredArray], index: Sequence[Mapping[str, Any]]
) -> dict[str, NDArray[Any]]:
    """Read all frames that belong to a take.

    Raises Sd2Error if some of them are damaged, with the takes that are lost.
    """
    frames = max(entry["stop"] for entry in index)
    read: dict[str, NDArray[Any]] = {}
    found: list[Damage] = []
    for name, array in arrays.items():
        try:
            read[name] = array[:frames]
        except Sd2Error:
            damaged = array.damage("values", range(frames))
            if not damaged:
                raise
            found += damaged
            read[name] = _undamaged(array, frames, damaged)
    lost = [one for one in index if any(_overlap(one, damage) for damage in found)]
    if lost:
        takes = ", ".join(f"{one['subject']}/{one['name']}@{one['placement']}" for one in lost)
        raise Sd2Error(
            f"{path} is damaged: {'; '.join(map(str, found))}. These takes are lost: {takes}",
            "chunks as they were written",
            f"Copy it again from where it came, or delete the lines of these takes in {INDEX_NAME}"
            " to go on with the others",
        )
    return read


def _undamaged(array: StoredArray, frames: int, damaged: Sequence[Damage]) -> NDArray[Any]:
    """Rows with zeros where they are damaged."""
    rows = np.zeros((frames, *array.shape[1:]), array.dtype)
    start = 0
    for one in damaged:
        rows[start : one.start] = array[start : one.start]
        start = min(one.stop, frames)
    rows[start:] = array[start:frames]
    return rows


def _overlap(take: Mapping[str, Any], damage: Damage) -> bool:
    return bool(take["start"] < damage.stop and damage.start < take["stop"])


def read_takes(path: Path, provenance: Any) -> list[dict[str, Any]]:
    """Read the lines of takes; an incomplete last line is left out."""
    by_part = isinstance(provenance, Mapping) and provenance.get("made_by") == "sd2 pairs mars"
    index = path / INDEX_NAME
    if not index.exists():
        return []
    with open_regular(index) as stream:
        lines = [line.decode(errors="replace") for line in whole_lines(stream)]
    entries = []
    for number, line in enumerate(lines, start=1):
        try:
            entry = _read_entry(line)
        except ValueError as error:
            raise Sd2Error(
                f"{index}: line {number} cannot be read ({_reason_of(error)}): {line[:80]!r}",
                "one take, as JSON",
                "Delete the line to lose that take alone",
            ) from None
        if by_part and entry["name"].startswith("stretch-"):
            # Written when the parts of one person were subjects of their own: "1-test".
            entry["subject"], _, part = entry["subject"].rpartition("-")
            entry["name"] = f"{part}-{entry['name']}"
        entries.append(entry)
    return entries


def key_of(entry: dict[str, Any]) -> TakeKey:
    """Key of the take that a line describes."""
    return TakeKey(entry["subject"], entry["name"], entry["placement"])
