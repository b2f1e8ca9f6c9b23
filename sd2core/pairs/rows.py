"""Rows of a store of pairs, where they are not damaged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.stores import Damage, StoredArray

INDEX_NAME = "takes.jsonl"


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
