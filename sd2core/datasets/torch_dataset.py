"""Data set for torch, read segment by segment.

::

    from sd2core.datasets.torch_dataset import SegmentDataset

    data = SegmentDataset("gestures.zarr", inputs="denoised", target="class", split="train")
    for energies, number in torch.utils.data.DataLoader(data, 64, shuffle=True, num_workers=2):
        ...  # (64, 72, 32) and (64,); data.names[number] is the class
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
import torch
from numpy.typing import NDArray
from torch.utils.data import Dataset as TorchDataset

from sd2core.datasets.layout import CHUNK_SEGMENTS
from sd2core.datasets.reading import Dataset, open_dataset
from sd2core.datasets.source import KINDS
from sd2core.errors import Sd2Error
from sd2core.maps import MapKind

LabelTarget = Literal["class", "label", "frame class", "frame label"]
LABEL_TARGETS: tuple[LabelTarget, ...] = get_args(LabelTarget)

NOT_LEARNT = -100
"""Frames whose label has no class: what torch's losses leave out."""

MapArray = MapKind | Literal["limbs", "kinematics"]
"""Array of energies: a kind of map, or the synthetic map split by the parts of the body; or the
kinematics of its joints."""

_POWERS: tuple[str, ...] = (*KINDS, "limbs")
_CHUNKS_KEPT = 8

Item = tuple[torch.Tensor, torch.Tensor]


class SegmentDataset(TorchDataset[Item]):
    """Pairs of a segment and its target.

    Only segments that have both are in it. The file is opened again in every process that
    reads from it, so it can be pickled and given to a ``DataLoader`` with workers.

    Parameters
    ----------
    path : Path or str
        Data set in any format.
    inputs : str
        Kind of map: an item's first tensor, float32 of shape (length, bins); or ``"limbs"``, of
        shape (length, parts, bins), and ``"kinematics"``, (length, joints, quantities), where
        the data set has them (``header.parts``).
    target : str
        Its second: another of these; ``"class"`` or ``"label"`` of the segment, an int64
        number; or ``"frame class"`` or ``"frame label"``, int64 of shape (length,). Segments
        whose label has no class are left out of ``"class"``; such frames, and those that fill a
        span's segment, are :data:`NOT_LEARNT`.
    split : str, optional
        ``"train"``, ``"validation"`` or ``"test"``; None: all.
    gain_db : float
        Powers of an item, input and target map alike, are multiplied by a factor drawn
        between minus and plus this: as a body nearer or farther would be seen.
    seed : int
        Seed of the gains; see :meth:`set_epoch`.

    Attributes
    ----------
    names : tuple of str
        Names that the numbers of a label or class target stand for.

    Raises
    ------
    Sd2Error
        When the data set cannot be opened, lacks what is asked for, or no segment has it.
    """

    def __init__(
        self,
        path: Path | str,
        inputs: MapArray = "denoised",
        target: MapArray | LabelTarget = "class",
        split: str | None = None,
        *,
        gain_db: float = 0.0,
        seed: int = 0,
    ) -> None:
        self.path = Path(path)
        self.inputs, self.target = inputs, target
        self.gain_db, self.seed, self._epoch = gain_db, seed, 0
        self._reader: tuple[int, Callable[[str, int], NDArray]] | None = None  # of a process
        with open_dataset(self.path) as dataset:
            self.header = dataset.header
            available: tuple[str, ...] = self.header.kinds
            available += ("limbs",) if self.header.parts else ()
            available += ("kinematics",) if self.header.joints else ()
            for what in (inputs, *([target] if target not in LABEL_TARGETS else [])):
                if what not in available:
                    targets = ", ".join((*available, *LABEL_TARGETS))
                    raise Sd2Error(f"{self.path} has no {what} maps", f"one of {targets}")
            self.names, self._numbers = self._names()
            self.indices = self._chosen(dataset, split)
        if not len(self.indices):
            where = f" of the split {split}" if split else ""
            raise Sd2Error(
                f"No segment{where} in {self.path} has {inputs} and {target}", "one at least"
            )

    def __len__(self) -> int:
        return len(self.indices)

    def __getitem__(self, index: int) -> Item:
        return self.__getitems__([index])[0]

    def __getitems__(self, indices: Sequence[int]) -> list[Item]:
        """Return several items, as a ``DataLoader`` asks for; each chunk is read once."""
        rows = self.indices[np.asarray(indices, np.int64)]
        energies = self._rows(self.inputs, rows)
        if self.target not in LABEL_TARGETS:
            targets = self._rows(self.target, rows)
        else:
            array = "label" if self.target.startswith("frame") else "segment_label"
            targets = self._numbers[self._rows(array, rows)]
            if array == "label" and self.header.spans is not None:
                targets = np.where(self._rows("mask", rows), targets, NOT_LEARNT)
        items = []
        for row, one, other in zip(rows.tolist(), energies, targets, strict=True):
            gain = self._gain(row)
            given = one * gain if self.inputs in _POWERS else one
            goal = other * gain if self.target in _POWERS else other
            items.append((torch.from_numpy(given), torch.as_tensor(goal)))
        return items

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_reader": None}

    def set_epoch(self, epoch: int) -> None:
        """Draw other gains; call it before the workers of that epoch start."""
        self._epoch = epoch

    def _names(self) -> tuple[tuple[str, ...], NDArray[np.int64]]:
        """Return the names of the target's numbers, and the number of every label."""
        header = self.header
        if not self.target.endswith("class"):
            return header.labels, np.arange(len(header.labels))
        names = tuple(dict.fromkeys(header.classes[one] for one in header.labels
                                    if one in header.classes))  # fmt: skip
        numbers = [
            names.index(header.classes[one]) if one in header.classes else NOT_LEARNT
            for one in header.labels
        ]
        return names, np.array(numbers, np.int64)

    def _chosen(self, dataset: Dataset, split: str | None) -> NDArray[np.int64]:
        rows = np.arange(len(dataset)) if split is None else dataset.of_split(split)
        available = np.asarray(dataset["available"][:])[rows]
        wanted = available[:, _kind_of(self.inputs)]
        if self.target not in LABEL_TARGETS:
            wanted &= available[:, _kind_of(self.target)]
        elif self.target == "class":
            wanted &= self._numbers[np.asarray(dataset["segment_label"][:])[rows]] != NOT_LEARNT
        return rows[wanted]

    def _gain(self, row: int) -> np.float32:
        if not self.gain_db:
            return np.float32(1.0)
        share = np.random.default_rng([self.seed, self._epoch, row]).uniform(-1.0, 1.0)
        return np.float32(10.0 ** (share * self.gain_db / 10.0))

    def _rows(self, name: str, rows: NDArray[np.int64]) -> NDArray:
        chunks = rows // CHUNK_SEGMENTS
        picked: list[Any] = [None] * len(rows)
        for chunk in np.unique(chunks).tolist():
            values = self._chunk(name, chunk)
            for place in np.flatnonzero(chunks == chunk).tolist():
                picked[place] = values[rows[place] - chunk * CHUNK_SEGMENTS]
        return np.stack(picked)

    def _chunk(self, name: str, number: int) -> NDArray:
        # Opened once per process: a file is not shared with a fork.
        if self._reader is None or self._reader[0] != os.getpid():
            dataset = open_dataset(self.path)

            @lru_cache(maxsize=_CHUNKS_KEPT)
            def read(name: str, number: int) -> NDArray:
                start = number * CHUNK_SEGMENTS
                return np.asarray(dataset[name][start : start + CHUNK_SEGMENTS])

            self._reader = os.getpid(), read
        return self._reader[1](name, number)


def _kind_of(array: str) -> int:
    """Place of an array's kind in ``available``; limb maps are where the synthetic map is."""
    kinds: tuple[str, ...] = KINDS
    return kinds.index("synthetic" if array in ("limbs", "kinematics") else array)
