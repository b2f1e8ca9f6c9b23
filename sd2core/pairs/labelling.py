"""Labels put on the takes of pairs that are there: from a table, or spans of each take."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.stores import open_group
from sd2core.files.texts import read_text
from sd2core.pairs.rows import agreed
from sd2core.pairs.store import PairSet, open_takes
from sd2core.timebase import frames_that_begin

_NEEDED = ("subject", "take", "label")
_USED = (*_NEEDED, "start_s", "end_s")
_LIKE_A_TIME = re.compile("start|end|stop|begin|onset|offset|duration|time")
_EXPECTED = "columns subject, take, label, and start_s, end_s where a label is not of a whole take"


@dataclass(frozen=True)
class TakeLabel:
    """Label of a take, or from one time to another on its clock."""

    subject: str  # A name, or a pattern as of files: ``*`` is anybody.
    take: str  # Likewise.
    label: str
    start_s: float = 0.0
    end_s: float = math.inf  # Exclusive.
    person: str = ""  # Who of several does it; empty: everybody.

    def __post_init__(self) -> None:
        if not self.label.strip() or not self.start_s < self.end_s:
            raise Sd2Error(
                f"{self.subject}/{self.take}: the label {self.label!r} from {self.start_s:g} to"
                f" {self.end_s:g} s",
                "a name, and a start before the end",
            )


def read_take_labels(path: Path) -> list[TakeLabel]:
    """Read a table (CSV) with a row per label: ``subject,take,label[,start_s,end_s]``."""
    lines = read_text(path, _EXPECTED).splitlines()
    separator = max(",;\t", key=lines[0].count)
    try:
        names, *rows = csv.reader(lines, skipinitialspace=True, delimiter=separator)
    except csv.Error as error:
        raise Sd2Error(f"{path} cannot be read ({error})", _EXPECTED) from error
    names = [name.strip().casefold() for name in names]
    missing = [name for name in _NEEDED if name not in names]
    if missing:
        raise Sd2Error(f"{path} has no column {', '.join(missing)}", _EXPECTED)
    for name in names:
        if (name in _USED and names.count(name) > 1) or (
            name not in _USED and _LIKE_A_TIME.match(name)
        ):
            raise Sd2Error(
                f"{path} has the columns {', '.join(names)}"[:300],
                "times in start_s and end_s, in seconds, and each column once",
            )
    labels = []
    for number, cells in enumerate(rows, start=2):
        if not any(cells):
            continue
        row = dict(zip(names, cells, strict=False))
        try:
            if len(cells) > len(names):
                raise ValueError("more columns than the heading")
            subject, take, label = (row.get(name, "").strip() for name in _NEEDED)
            start_s, end_s = float(row.get("start_s") or 0.0), float(row.get("end_s") or math.inf)
            labels.append(TakeLabel(subject, take, label, start_s, end_s))
        except ValueError as error:
            raise Sd2Error(f"{path}: line {number} is {cells!r:.200}", _EXPECTED) from error
        except Sd2Error as error:
            raise error.within(f"{path}: line {number}") from error
    if not labels:
        raise Sd2Error(f"{path} has no row", "one for each label")
    return labels


def label_pairs(path: Path, rows: Sequence[TakeLabel]) -> dict[str, int]:
    """Put labels on a store of pairs in place of those there; return the frames of each.

    Later rows lie over earlier ones; frames without a label are background. All placements of a
    take get the same, of several persons that which :func:`~sd2core.pairs.rows.agreed` returns.
    Raises Sd2Error, and changes nothing, if a row is of no take.
    """
    facts, arrays = open_takes(path)
    labels = _together(facts.labels, rows)
    values = np.zeros(facts.frames, np.int8)
    used: set[int] = set()
    for take in facts.takes:
        times_s = np.asarray(arrays["times_s"][take.rows])
        values[take.rows] = _numbers(take.subject, take.name, times_s, rows, labels, used)
    _refuse_unused(str(path), rows, used, [take.key[:2] for take in facts.takes])
    group = open_group(path, "r+")
    # First the names: no number is ever without one.
    group.attrs["labels"] = list(labels)
    group["label"][: len(values)] = values
    counts = np.bincount(values[values >= 0], minlength=len(labels))
    return {name: int(count) for name, count in zip(labels, counts, strict=True) if count}


def labelled(pairs: PairSet, rows: Sequence[TakeLabel]) -> PairSet:
    """Pairs with labels in place of their own, as :func:`label_pairs` puts them on a store."""
    labels = _together(pairs.labels, rows)
    used: set[int] = set()
    takes = tuple(
        replace(take, label=_numbers(take.subject, take.name, take.times_s, rows, labels, used))
        for take in pairs.takes
    )
    _refuse_unused("The pairs", rows, used, [take.key[:2] for take in takes])
    return replace(pairs, labels=labels, takes=takes)


def _together(existing: Sequence[str], rows: Sequence[TakeLabel]) -> tuple[str, ...]:
    labels = tuple(dict.fromkeys([*existing, *(row.label for row in rows)]))
    if len(labels) > np.iinfo(np.int8).max:
        raise Sd2Error(f"There are {len(labels)} labels", f"up to {np.iinfo(np.int8).max}")
    return labels


def _numbers(
    subject: str,
    name: str,
    times_s: NDArray[np.float64],
    rows: Sequence[TakeLabel],
    labels: Sequence[str],
    used: set[int],
) -> NDArray[np.int8]:
    """Label of every frame of a take; rows that are of it are noted as used."""
    persons = {row.person for row in rows if row.person} or {""}
    each = {person: np.zeros(len(times_s), np.int8) for person in persons}
    for number, row in enumerate(rows):
        if _is(subject, row.subject) and _is(name, row.take):
            used.add(number)
            inside = frames_that_begin(times_s, row.start_s, row.end_s)
            for person in [row.person] if row.person else persons:
                each[person][inside] = labels.index(row.label)
    return agreed([*each.values()])


def _is(name: str, wanted: str) -> bool:
    return name == wanted or fnmatchcase(name, wanted)


def _refuse_unused(
    where: str, rows: Sequence[TakeLabel], used: set[int], takes: Sequence[tuple[str, ...]]
) -> None:
    unused = [row for number, row in enumerate(rows) if number not in used]
    if unused:
        raise Sd2Error(
            f"{where}: there is no take {unused[0].subject}/{unused[0].take}",
            f"takes such as {', '.join('/'.join(one) for one in takes[:4])}",
            "Correct the table",
        )
