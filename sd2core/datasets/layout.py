"""Names, shapes and types of the arrays of a data set, the same in every format."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import TypeAdapter

from sd2core.datasets.source import KINDS
from sd2core.errors import Sd2Error
from sd2core.files.texts import check_version, damage_in
from sd2core.io.kinds import DATASET_FORMAT
from sd2core.maps import MapKind
from sd2core.mesh.vertex_parts import QUANTITIES
from sd2core.options.bounds import FRAME_RATE_HZ, NUMBER_OF_ROWS, SEGMENT_FRAMES, UP_TO_ONE
from sd2core.options.declared import check_names
from sd2core.options.exporting import LabelRule, SpanOptions
from sd2core.sensor import VelocityAxis

FORMAT = DATASET_FORMAT
VERSION = 1

SPLITS = ("train", "validation", "test")
"""Numbers in the array ``split`` are places in this tuple."""

FileFormat = Literal["zarr", "hdf5", "npz"]
SUFFIXES: dict[str, FileFormat] = {".zarr": "zarr", ".h5": "hdf5", ".hdf5": "hdf5", ".npz": "npz"}

COLUMNS: dict[str, tuple[str, tuple[int, ...]]] = {
    "segment_label": ("int16", ()),
    "purity": ("float32", ()),
    "subject": ("int32", ()),
    "split": ("int8", ()),
    "source": ("int32", ()),
    "placement": ("int32", ()),
    "start_s": ("float64", ()),
    "start_frame": ("int64", ()),
    "resampled": ("bool", ()),
    "sensor_position_m": ("float64", (3,)),
    "sensor_direction_deg": ("float64", (2,)),
    "range_m": ("float32", ()),
    "azimuth_deg": ("float32", ()),
    "elevation_deg": ("float32", ()),
    "available": ("bool", (len(KINDS),)),
}
"""One row per segment: type, and shape of a row. ``label``, maps, limb maps and ``imu`` are
besides."""

IMU_CHANNELS = ("acc_x", "acc_y", "acc_z", "gyr_x", "gyr_y", "gyr_z")
"""Last axis of the array ``imu``, in m/s² and rad/s."""

CHUNK_SEGMENTS = 32
CHUNK_ROWS = 8192


@dataclass(frozen=True)
class Header:
    """Header of a data set: properties of all its segments.

    ``label_rule``, ``min_share``, ``min_purity`` and ``spans`` are those of
    :class:`~sd2core.options.exporting.Exporting`.
    """

    length: Annotated[int, SEGMENT_FRAMES]  # Frames of a segment.
    overlap: Annotated[int, NUMBER_OF_ROWS]  # Frames that neighbouring segments share.
    axis: VelocityAxis
    null_bins: tuple[int, ...]  # Bins set to zero in all kinds.
    frame_rate_hz: Annotated[float, FRAME_RATE_HZ]
    label_rule: LabelRule
    min_share: Annotated[float, UP_TO_ONE]
    min_purity: Annotated[float, UP_TO_ONE] = 0.0
    spans: SpanOptions | None = None
    kinds_wanted: tuple[MapKind, ...] = KINDS  # Those that were asked for.
    kinds: tuple[MapKind, ...] = ()  # Those that some segment has.
    # Numbers in ``label`` and ``segment_label`` are places in it; the first is background.
    labels: tuple[str, ...] = ("background",)
    # Class that a classifier learns for a label.
    classes: dict[str, str] = field(default_factory=dict)
    subjects: tuple[str, ...] = ()  # Numbers in ``subject`` are places in it.
    splits: dict[str, tuple[str, ...]] = field(default_factory=dict)  # Subjects of each split.
    parts: tuple[str, ...] = ()  # Parts of the body in ``limbs``; none: there are no limb maps.
    joints: tuple[str, ...] = ()  # Joints in ``kinematics``, which go with limb maps.
    imu: tuple[str, ...] = ()  # Places of the inertial sensors in ``imu``; none: no such array.
    # Meaning of the value 1 in each kind; several where sources differ.
    units: dict[str, tuple[str, ...]] = field(default_factory=dict)
    title: str = ""
    made_by: str = ""  # Program and version.
    provenance: dict[str, Any] = field(default_factory=dict)

    @property
    def simulated(self) -> bool:
        """True if any radar map was simulated."""
        return "simulated" in self.kinds

    def as_dict(self) -> dict[str, Any]:
        """Return the header as JSON can hold it."""
        content = _HEADER.dump_python(self, mode="json")
        axis = content.pop("axis")
        for name in _ADDED:  # Descriptions without it are as they were before there was any.
            if not content[name]:
                del content[name]
        return {"format": FORMAT, "version": VERSION, **axis, "all_kinds": list(KINDS), **content}

    @classmethod
    def from_dict(cls, entry: Any, path: Path) -> Header:
        """Parse :meth:`as_dict`; ``path`` is for messages, as where it is no data set."""
        if not isinstance(entry, dict) or entry.get("format") != FORMAT:
            raise Sd2Error(f"{path} holds no data set", "one that `sd2 export` made")
        check_version(entry, path, FORMAT, VERSION)
        with damage_in(path, f"{FORMAT} {VERSION}"):
            axis = VelocityAxis(int(entry["bins"]), float(entry["v_max_mps"]))
            names = (one.name for one in fields(cls) if one.name != "axis")
            # Before there were limb maps, headers did not have parts.
            content = {name: ({"parts": (), "joints": ()} | _ADDED | entry)[name] for name in names}
            spans = None if content["spans"] is None else SpanOptions(**content["spans"])
            header = _HEADER.validate_python({**content, "axis": axis, "spans": spans})
            axis.checked_bins(header.null_bins, "null_bins")
        for what in ("labels", "subjects", "kinds", "parts", "joints", "imu"):
            check_names(getattr(header, what), what, path)
        unknown = {one for people in header.splits.values() for one in people} - {*header.subjects}
        if unknown or not header.labels or {*header.splits} - {*SPLITS}:
            raise Sd2Error(
                f"{path}: its description is damaged (splits {header.splits!r:.150},"
                f" {len(header.labels)} labels)",
                "splits of its subjects, and a label",
            )
        return header


_ADDED: dict[str, Any] = {"imu": (), "spans": None, "min_purity": 0.0}
_HEADER = TypeAdapter(Header)


def format_of(path: Path) -> FileFormat:
    """Return the format of a data set by the ending of its name."""
    file_format = SUFFIXES.get(path.suffix.lower())
    if file_format is None:
        raise Sd2Error(f"The data set is to be {path}", f"a name ending in {', '.join(SUFFIXES)}")
    return file_format


def row_shapes(header: Header) -> dict[str, tuple[str, tuple[int, ...]]]:
    """Return type and shape of a row of every array that the header implies."""
    maps: dict[str, tuple[str, tuple[int, ...]]] = dict.fromkeys(
        header.kinds, ("float32", (header.length, header.axis.bins))
    )
    if header.parts:
        maps["limbs"] = ("float32", (header.length, len(header.parts), header.axis.bins))
    if header.joints:
        maps["kinematics"] = ("float32", (header.length, len(header.joints), len(QUANTITIES)))
    if header.imu:
        maps["imu"] = ("float32", (header.length, len(header.imu), len(IMU_CHANNELS)))
    if header.spans is not None:
        maps |= {"mask": ("bool", (header.length,)), "end_s": ("float64", ())}
    return maps | {"label": ("int16", (header.length,))} | COLUMNS


def whole_names(header: Header, existing: Iterable[str], path: Path) -> list[str]:
    """Return the names of all arrays that the header implies, and refuse where one is missing."""
    names = list(row_shapes(header))
    missing = sorted({*names} - {*existing})
    if missing:
        raise Sd2Error(f"{path} lacks {', '.join(missing)}", "a data set that is whole")
    return names


def check_arrays(header: Header, arrays: Mapping[str, Any], path: Path) -> None:
    """Refuse arrays that are not as the header says, or do not have the same rows."""
    rows = {array.shape[:1] for array in arrays.values()}
    wrong = [
        name
        for name, (kind, row) in row_shapes(header).items()
        if arrays[name].shape[1:] != row or arrays[name].dtype != kind
    ]
    if wrong or len(rows) != 1 or rows == {()}:
        raise Sd2Error(
            f"{path}: its arrays do not fit its description ({', '.join(wrong) or 'rows differ'})",
            "a data set that is whole",
            "Copy it again from where it came, or write it again",
        )


def chunk_of(row: tuple[int, ...]) -> tuple[int, ...]:
    """Return the shape of a chunk of rows of this shape."""
    return (CHUNK_SEGMENTS if len(row) >= 2 else CHUNK_ROWS, *row)


def bytes_per_segment(header: Header) -> int:
    """Size of a segment in bytes before compression."""
    import numpy as np

    rows = row_shapes(header).values()
    return sum(np.dtype(kind).itemsize * math.prod(row) for kind, row in rows)
