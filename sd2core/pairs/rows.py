"""Rows of a store of pairs, checked as they are read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.stores import StoredArray
from sd2core.mesh.presence import runs
from sd2core.mesh.vertex_parts import QUANTITIES
from sd2core.pairs.summary import TakeEntry

UNKNOWN = -1
"""Label of a frame that is neither learnt from nor judged, in place of a number of one."""


def agreed(each: Sequence[NDArray[np.integer]]) -> NDArray[np.int8]:
    """Return the label of every frame in which several persons are seen together.

    Each has labels of their own. Where nothing is labelled of one, another's label holds; where two
    are labelled differently, it is :data:`UNKNOWN`.
    """
    label = np.maximum.reduce(each)
    differ = np.logical_or.reduce([(one > 0) & (one != label) for one in each])
    return np.where(differ, UNKNOWN, label).astype(np.int8)


def check_labels(label: NDArray[np.integer], count: int, title: str, remedy: str = "") -> None:
    """Raise Sd2Error for labels of a take that are none of so many, nor :data:`UNKNOWN`."""
    if not UNKNOWN <= label.min() <= label.max() < count:
        raise Sd2Error(
            f"{title} has labels from {label.min()} to {label.max()}",
            f"0 to {count - 1}, or {UNKNOWN} where it is not known",
            remedy,
        )


def row_kinds(
    bins: int, parts: Sequence[str], joints: Sequence[str]
) -> dict[str, tuple[tuple[int, ...], str]]:
    """Shape of a row and type of every array, by what a store's header says."""
    kinds: dict[str, tuple[tuple[int, ...], str]] = {
        "synthetic": ((bins,), "float32"),
        "radar": ((bins,), "float32"),
        "times_s": ((), "float64"),
        "label": ((), "int8"),
    }
    if parts:
        kinds["limbs"] = (len(parts), bins), "float32"
    if joints:  # stores of before there were kinematics have none
        kinds["kinematics"] = (len(joints), len(QUANTITIES)), "float32"
    return kinds


def read_rows(
    arrays: Mapping[str, StoredArray], frames: int
) -> tuple[dict[str, NDArray[Any]], NDArray[np.bool_]]:
    """Read the first frames of all arrays, and tell which are lost to damaged chunks.

    Raises Sd2Error if all are, or the damage is none of chunks.
    """
    try:
        return {name: array[:frames] for name, array in arrays.items()}, np.zeros(frames, bool)
    except Sd2Error:
        lost = lost_frames(arrays, frames)
        if not lost.any() or lost.all():
            raise
        read = {name: read_around(array, slice(0, frames), lost) for name, array in arrays.items()}
        return read, lost


def lost_frames(arrays: Mapping[str, StoredArray], frames: int) -> NDArray[np.bool_]:
    """Frames of which some array has a damaged chunk, (frames,)."""
    lost = np.zeros(frames, bool)
    for array in arrays.values():
        for one in array.damage("checksums" if array.checksums else "values", range(frames)):
            lost[one.start : one.stop] = True
    return lost


def read_around(array: StoredArray, rows: slice, lost: NDArray[np.bool_]) -> NDArray[Any]:
    """Some rows of an array, with zeros in frames that are lost."""
    values = np.zeros((rows.stop - rows.start, *array.shape[1:]), array.dtype)
    for start, stop in runs(~lost[rows]):
        values[start:stop] = array[rows.start + start : rows.start + stop]
    return values


def kept_parts(take: TakeEntry, lost: NDArray[np.bool_]) -> list[TakeEntry]:
    """Uninterrupted parts of a take between frames that are lost, under its name."""
    return [
        take.model_copy(update={"start": take.start + start, "stop": take.start + stop})
        for start, stop in runs(~lost[take.rows])
    ]
