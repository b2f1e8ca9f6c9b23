"""Confusion matrices and learning curves, read from what commands wrote."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.classify.metrics import mean_recall, shares
from sd2core.errors import Sd2Error
from sd2core.files.texts import read_json

_EXPECTED = (
    "study.json of `sd2 study` or `sd2 classify table`, or a file of what"
    " `sd2 classify eval --json` prints"
)
_STUDY = "study.json"


@dataclass(frozen=True)
class Spread:
    """Mean and standard deviation over seeds, or half an interval; NaN where there is none."""

    mean: float
    sd: float

    def text(self, signed: bool = False) -> str:
        """Text in per cent, or in percentage points for a difference."""
        if not math.isfinite(self.mean):
            return "–"
        sign = "+" if signed else ""
        text = f"{100 * self.mean:{sign}.1f}"
        text += f" ± {100 * self.sd:.1f}" if self.sd > 0 else ""
        return text.replace("-", "−")


@dataclass(frozen=True, eq=False)
class Matrix:
    """Confusion matrix, shape (classes, classes): shares of answers per true class."""

    title: str  # the training data, or the judged data
    mean: NDArray[np.float64]  # rows are true classes with sum 1, NaN without frames
    sd: NDArray[np.float64]  # over seeds; zero for one seed
    recall: Spread  # mean over classes
    gain: Spread | None = None  # over learning from the radar's maps alone

    def cell(self, row: int, column: int) -> Spread:
        """One of its cells."""
        return Spread(float(self.mean[row, column]), float(self.sd[row, column]))


@dataclass(frozen=True)
class CurvePoint:
    """Share of frames found after learning from a share of the radar's data."""

    title: str
    share: float
    recall: Spread


@dataclass(frozen=True)
class ClassResult:
    """Results of a study, or of the evaluation of a classifier."""

    path: Path
    kind: str  # kind of the judged maps, such as simulated
    classes: tuple[str, ...]
    seeds: int  # 0 if one classifier was judged
    matrices: tuple[Matrix, ...]  # the first is the reference of the others
    curves: tuple[tuple[CurvePoint, ...], ...] = ()  # from small to large shares
    summary: str = ""  # conclusion in words, and what it does not say

    @property
    def heading(self) -> str:
        """Title of the results."""
        text = f"Frames of a {self.kind} radar" if self.seeds else f"Judged on {self.kind} maps"
        if self.seeds > 1:
            text += f", mean ± standard deviation of {self.seeds} seeds"
        return text


def read_result(path: Path) -> ClassResult:
    """Read a file, or the folder of a study; Sd2Error if there is none or it is something else."""
    path = Path(path)
    if path.is_dir():
        path = path / _STUDY
        if not path.is_file():
            raise Sd2Error(f"{path.parent} holds no {_STUDY}", _EXPECTED)
    try:
        content = read_json(path, _EXPECTED)
        if "totals" in content:
            return _of_study(path, content)
        return _of_score(path, content)
    except (ValueError, KeyError, TypeError, IndexError, AttributeError) as error:
        raise Sd2Error(f"{path} is no such result ({error!r})", _EXPECTED) from error


def _of_study(path: Path, content: Mapping[str, Any]) -> ClassResult:
    classes = tuple(map(str, content["classes"]))
    totals = [
        (str(one["title"]), [np.array(seed["frames"], np.int64) for seed in one["seeds"]])
        for one in content["totals"]
    ]
    plain = [mean_recall(counts) for counts in totals[0][1]]
    matrices = tuple(_matrix(title, seeds, classes, plain) for title, seeds in totals)
    curves: dict[str, list[CurvePoint]] = {}
    for one in content["curve"]:
        low, high = one["over_takes"]
        recall = Spread(float(one["mean"]), 0.5 * (high - low))
        point = CurvePoint(str(one["title"]), float(one["share"]), recall)
        curves.setdefault(point.title, []).append(point)
    summary = str(content["conclusion"])
    if len(content["takes"]) < 2:
        summary += "\nAll data is of one person: how it is with others stays unknown."
    points = tuple(tuple(one) for one in curves.values())
    seeds = len(totals[0][1])
    return ClassResult(path, str(content["radar"]), classes, seeds, matrices, points, summary)


def _matrix(
    title: str,
    seeds: Sequence[NDArray[np.int64]],
    classes: tuple[str, ...],
    plain: Sequence[float] | None = None,
) -> Matrix:
    each = np.array([shares(counts) for counts in seeds])
    if each.shape[1:] != (len(classes), len(classes)):
        raise ValueError(f"a matrix of shape {each.shape[1:]}")
    recalls = [mean_recall(counts) for counts in seeds]
    gains = [own - other for own, other in zip(recalls, plain or recalls, strict=True)]
    gain = _spread(gains) if plain and any(gains) else None
    return Matrix(title, each.mean(axis=0), _sd(each), _spread(recalls), gain)


def _sd(each: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(each.std(axis=0, ddof=1) if len(each) > 1 else np.zeros(each.shape[1:]))


def _spread(values: Sequence[float]) -> Spread:
    each = np.array(values)
    return Spread(float(each.mean()), float(_sd(each)))


def _of_score(path: Path, content: Mapping[str, Any]) -> ClassResult:
    classes = tuple(map(str, content["classes"]))
    matrices = tuple(
        _matrix(name.capitalize(), [np.array(content[name], np.int64)], classes)
        for name in ("frames", "gestures")
    )
    kind = " and ".join(map(str, content["maps"]))
    return ClassResult(path, kind, classes, 0, matrices, summary=_summary(content))


def _summary(content: Mapping[str, Any]) -> str:
    """People and delay of an evaluation; files of earlier versions may lack them."""
    notes = []
    if subjects := content.get("subjects"):
        notes.append(f"People: {', '.join(map(str, subjects))}.")
    if learnt := content.get("learnt_from"):
        names = ", ".join(map(str, learnt))
        notes.append(f"It has learnt from {names}: this is not what it does for others.")
    latency_s = content.get("latency_s")
    if latency_s is not None:
        gestures = int(np.array(content["gestures"], np.int64).sum())
        notes.append(
            f"A gesture is recognised after {float(latency_s):.2f} s (median);"
            f" {int(content['missed'])} of {gestures} never."
        )
    return "\n".join(notes)
