"""Results of an evaluation: numbers by model, gesture and person, and over seeds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.denoise.card import ModelCard
from sd2core.denoise.metrics import MapError, VelocityError


@dataclass(frozen=True)
class Score:
    """Errors on some frames."""

    frames: int  # all of them
    peak: VelocityError  # of the peak velocity, where something moves
    peak_all: VelocityError  # the same of all frames
    mean: VelocityError  # of the energy-weighted mean velocity, where something moves
    map: MapError  # of all cells of all frames

    def to_json(self) -> dict[str, Any]:
        """Errors by name."""
        parts = {name: getattr(self, name).to_json() for name in _PARTS}
        return {"frames": self.frames, **parts}


_PARTS = ("peak", "peak_all", "mean", "map")


@dataclass(frozen=True)
class Report:
    """Errors of one model."""

    name: str  # distinguishes it within its group: the file, or the filter
    card: ModelCard
    seed: int | None
    all: Score
    by_label: Mapping[str, Score]
    by_subject: Mapping[str, Score]


@dataclass(frozen=True)
class Group:
    """Models of one architecture that differ in their seeds."""

    name: str
    reports: tuple[Report, ...]  # at least one
    trained: bool  # False for what needs no training

    def values(
        self, part: str, number: str, label: str | None = None, subject: str | None = None
    ) -> NDArray[np.float64]:
        """One number of every model, e.g. ``values("peak", "mae_mps")``."""
        scores = [_score_of(report, label, subject) for report in self.reports]
        return np.array([getattr(getattr(score, part), number) for score in scores], np.float64)


@dataclass(frozen=True)
class Evaluation:
    """Errors of all groups on the same takes."""

    kind: str  # "simulated" or "real" radar
    subjects: tuple[str, ...]
    labels: tuple[str, ...]  # those that occur
    frames: int
    moving: int  # frames in which something moves
    groups: tuple[Group, ...]  # the filters first
    notes: tuple[str, ...] = field(default=())  # reservations about the result

    def to_json(self) -> dict[str, Any]:
        """All numbers of all models, and mean and sd over the models of a group."""
        return {
            "format": "sd2-evaluation",
            "version": 1,
            "kind": self.kind,
            "subjects": list(self.subjects),
            "labels": list(self.labels),
            "frames": self.frames,
            "moving_frames": self.moving,
            "notes": list(self.notes),
            "groups": [
                {
                    "name": group.name,
                    "model": group.reports[0].card.model,
                    "trained": group.trained,
                    "parameters": group.reports[0].card.parameters,
                    "peak_mae_mps": _spread(group.values("peak", "mae_mps")),
                    "peak_sd_mps": _spread(group.values("peak", "sd_mps")),
                    "peak_all_mae_mps": _spread(group.values("peak_all", "mae_mps")),
                    "mean_mae_mps": _spread(group.values("mean", "mae_mps")),
                    "mean_correlation": _spread(group.values("mean", "correlation")),
                    "map_rmse": _spread(group.values("map", "rmse_compressed")),
                    "models": [_report_json(report) for report in group.reports],
                }
                for group in self.groups
            ],
        }


def _score_of(report: Report, label: str | None, subject: str | None) -> Score:
    if label is not None:
        return report.by_label[label]
    return report.by_subject[subject] if subject is not None else report.all


def _spread(values: NDArray[np.float64]) -> dict[str, Any]:
    """Mean over models, and their standard deviation (of the sample) where there are two."""
    return {
        "mean": float(values.mean()),
        "sd": float(values.std(ddof=1)) if len(values) > 1 else None,
        "models": len(values),
    }


def _report_json(report: Report) -> dict[str, Any]:
    return {
        "name": report.name,
        "seed": report.seed,
        "all": report.all.to_json(),
        "by_label": {name: score.to_json() for name, score in report.by_label.items()},
        "by_subject": {name: score.to_json() for name, score in report.by_subject.items()},
    }
