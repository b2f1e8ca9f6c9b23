"""Rows of a store of pairs, checked as they are read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.stores import Damage, StoredArray
from sd2core.mesh.vertex_parts import QUANTITIES
from sd2core.pairs.summary import INDEX_NAME, REMAKE, TakeEntry


def check_array(array: StoredArray, frames: int, row: tuple[int, ...], kind: str) -> None:
    """Raise Sd2Error for an array that is not of this type, or has too few frames.

    Parameters
    ----------
    array : StoredArray
    frames : int
        Least number of rows.
    row : tuple of int
        Shape of a row.
    kind : str
        Wanted dtype, such as ``"float32"``.
    """
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
    path: Path, arrays: Mapping[str, StoredArray], takes: Sequence[TakeEntry]
) -> dict[str, NDArray[Any]]:
    """Read all frames that belong to a take.

    Raises Sd2Error if some of them are damaged, with the takes that are lost.
    """
    frames = max(take.stop for take in takes)
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
    lost = [
        f"{take.subject}/{take.name}@{take.placement}"
        for take in takes
        if any(take.start < damage.stop and damage.start < take.stop for damage in found)
    ]
    if lost:
        raise Sd2Error(
            f"{path} is damaged: {'; '.join(map(str, found))}."
            f" These takes are lost: {', '.join(lost)}",
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
