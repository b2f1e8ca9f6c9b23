"""Confusion matrices and learning curves, read from what ``sd2 classify`` wrote."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.classify.metrics import shares
from sd2core.errors import Sd2Error
from sd2core.files.texts import read_json

_EXPECTED = (
    "table.json of `sd2 classify table`, or a file of what `sd2 classify eval --json` prints"
)
_TABLE = "table.json"


@dataclass(frozen=True)
class Spread:
    """Mean and standard deviation over seeds; NaN where there is none."""

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
    """Recall after learning from a share of the radar's data."""

    title: str
    share: float
    recall: Spread


@dataclass(frozen=True)
class ClassResult:
    """Results of a comparison, or of the evaluation of a classifier."""

    path: Path
    kind: str  # kind of the judged maps, such as simulated
    classes: tuple[str, ...]
    seeds: int  # 0 if one classifier was judged
    matrices: tuple[Matrix, ...]  # the first is the reference of the others
    curves: tuple[tuple[CurvePoint, ...], ...] = ()  # from small to large shares
    by_movement: bool = False  # all data is of one person: no result for other people
    notes: tuple[str, ...] = ()  # further remarks

    @property
    def heading(self) -> str:
        """Title of the results."""
        text = f"Frames of a {self.kind} radar" if self.seeds else f"Judged on {self.kind} maps"
        if self.seeds:
            text += f", mean ± standard deviation of {self.seeds} seeds"
        return text

    @property
    def summary(self) -> str:
        """Conclusion in words: whether the added data helps."""
        parts = []
        plain = {point.share: point.recall.mean for point in next(iter(self.curves), ())}
        for curve in self.curves[1:]:
            known = [point for point in curve if point.share in plain]
            gains = []
            for point in dict.fromkeys((*known[:1], *known[-1:])):
                gain = 100 * (point.recall.mean - plain[point.share])
                text = f"{gain:+.1f}".replace("-", "−")
                gains.append(f"{text} points with {100 * point.share:g} %")
            if gains:
                of = f"of the {self.kind} radar's data"
                parts.append(f"{curve[0].title}: {', '.join(gains)} {of}.")
        if self.by_movement:
            parts.append("All data is of one person: how it is with others stays unknown.")
        parts += self.notes
        return "\n".join(parts)


def read_result(path: Path) -> ClassResult:
    """Read a file, or a folder with a table; Sd2Error if there is none or it is something else."""
    path = Path(path)
    if path.is_dir():
        inside = next(
            (one for one in (path / _TABLE, path / "table" / _TABLE) if one.is_file()), None
        )
        if inside is None:
            raise Sd2Error(f"{path} holds no {_TABLE}", _EXPECTED)
        path = inside
    try:
        content = read_json(path, _EXPECTED)
        if "conditions" in content:
            return _of_table(path, content)
        return _of_score(path, content)
    except (ValueError, KeyError, TypeError, IndexError, AttributeError) as error:
        raise Sd2Error(f"{path} is no such result ({error!r})", _EXPECTED) from error


def _of_table(path: Path, content: Mapping[str, Any]) -> ClassResult:
    classes = tuple(map(str, content["classes"]))
    conditions = list(content["conditions"])
    own = [one for one in conditions if one["network"] == content["network"]]
    whole = [one for one in own if one["share"] == 1.0]
    matrices = tuple(_matrix(one, len(classes)) for one in whole)
    if not matrices:
        raise KeyError("no condition with all real data")
    titles = list(dict.fromkeys(_title(one) for one in own if one["share"] < 1.0))
    curves = tuple(
        tuple(
            CurvePoint(title, float(one["share"]), _spread(one["mean_recall_frames"]))
            for one in sorted(own, key=lambda one: one["share"])
            if _title(one) == title
        )
        for title in titles
    )
    return ClassResult(
        path,
        str(content["radar"]),
        classes,
        int(content["seeds"]),
        matrices,
        curves,
        bool(content["by_movement"]),
    )


def _matrix(condition: Mapping[str, Any], classes: int) -> Matrix:
    each = np.array(
        [shares(np.array(run["score"]["frames"], np.int64)) for run in condition["runs"]]
    )
    if each.shape[1:] != (classes, classes):
        raise ValueError(f"a matrix of shape {each.shape[1:]}")
    sd = each.std(axis=0, ddof=1) if len(each) > 1 else np.zeros((classes, classes))
    return Matrix(
        _title(condition),
        each.mean(axis=0),
        sd,
        _spread(condition["mean_recall_frames"]),
        None if condition["added"] == "nothing" else _spread(condition["gain"]),
    )


def _of_score(path: Path, content: Mapping[str, Any]) -> ClassResult:
    classes = tuple(map(str, content["classes"]))
    matrices = []
    for name in ("frames", "gestures"):
        counts = np.array(content[name], np.int64)
        if counts.shape != (len(classes), len(classes)):
            raise ValueError(f"a matrix of shape {counts.shape}")
        mean = shares(counts)
        known = np.diag(mean)[~np.isnan(np.diag(mean))]
        recall = Spread(float(known.mean()) if known.size else math.nan, 0.0)
        matrices.append(Matrix(name.capitalize(), mean, np.zeros_like(mean), recall))
    kind = " and ".join(map(str, content["maps"]))
    return ClassResult(path, kind, classes, 0, tuple(matrices), notes=_notes(content))


def _notes(content: Mapping[str, Any]) -> tuple[str, ...]:
    """People and delay of an evaluation; files of earlier versions may lack them."""
    found = []
    if subjects := content.get("subjects"):
        found.append(f"People: {', '.join(map(str, subjects))}.")
    if learnt := content.get("learnt_from"):
        names = ", ".join(map(str, learnt))
        found.append(f"It has learnt from {names}: this is not what it does for others.")
    latency_s = content.get("latency_s")
    if latency_s is not None:
        gestures = int(np.array(content["gestures"], np.int64).sum())
        found.append(
            f"A gesture is recognised after {float(latency_s):.2f} s (median);"
            f" {int(content['missed'])} of {gestures} never."
        )
    return tuple(found)


def _title(condition: Mapping[str, Any]) -> str:
    return str(condition["title"])


def _spread(value: Mapping[str, Any]) -> Spread:
    mean, sd = value["mean"], value["sd"]
    return Spread(math.nan if mean is None else float(mean), 0.0 if sd is None else float(sd))
