"""Scores of predicted classes: per frame, per gesture, and latency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.classify.data import UNKNOWN
from sd2core.errors import Sd2Error

ClassNumbers = NDArray[np.integer]
Confusion = NDArray[np.int64]
"""(true classes, found classes) of frames or gestures."""


def confusion_of(truth: ClassNumbers, answer: ClassNumbers, classes: int) -> Confusion:
    """Compute the confusion matrix; unknown frames do not count."""
    if truth.shape != answer.shape:
        raise Sd2Error(f"{len(answer)} answers for {len(truth)} frames", "one for each")
    counted = truth != UNKNOWN
    counts = np.zeros((classes, classes), np.int64)
    np.add.at(counts, (truth[counted], answer[counted]), 1)
    return counts


def shares(confusion: Confusion) -> NDArray[np.float64]:
    """Normalise the rows of a confusion matrix; NaN in an empty row."""
    totals = confusion.sum(axis=1, keepdims=True)
    normalised = np.full(confusion.shape, np.nan)
    return np.divide(confusion, totals, out=normalised, where=totals > 0)


def recalls(confusion: Confusion) -> NDArray[np.float64]:
    """Recall of each class, (classes,); NaN for one that does not occur."""
    return np.diag(shares(confusion))


def mean_recall(confusion: Confusion) -> float:
    """Mean recall over the classes that occur; NaN where none does."""
    known = recalls(confusion)
    known = known[~np.isnan(known)]
    return float(known.mean()) if known.size else float("nan")


@dataclass(frozen=True, eq=False)
class Score:
    """Score of a classifier on some clips."""

    classes: tuple[str, ...]
    frames: Confusion  # confusion matrix of frames, shape (classes, classes)
    gestures: Confusion  # of gestures: the class of most frames of a labelled gesture
    latencies_s: NDArray[np.float64]
    """From the beginning of each recognised gesture until a frame of it is recognised."""
    missed: int  # gestures without any correct frame

    @property
    def mean_recall(self) -> float:
        """Mean recall of frames over classes."""
        return mean_recall(self.frames)

    @property
    def latency_s(self) -> float:
        """Median latency; NaN where no gesture was recognised."""
        return float(np.median(self.latencies_s)) if len(self.latencies_s) else float("nan")

    def __add__(self, other: Score) -> Score:
        if other.classes != self.classes:
            raise Sd2Error("Scores of other classes are to be added", ", ".join(self.classes))
        return Score(
            self.classes,
            self.frames + other.frames,
            self.gestures + other.gestures,
            np.concatenate([self.latencies_s, other.latencies_s]),
            self.missed + other.missed,
        )

    def to_json(self) -> dict[str, Any]:
        """Return the counts, for files."""
        return {
            "classes": list(self.classes),
            "frames": self.frames.tolist(),
            "gestures": self.gestures.tolist(),
            "latencies_s": self.latencies_s.tolist(),
            "missed": self.missed,
        }

    def summary(self) -> dict[str, Any]:
        """Return recalls and latency; NaN where there is no data."""
        return {
            "recall_frames": recalls(self.frames).tolist(),
            "recall_gestures": recalls(self.gestures).tolist(),
            "mean_recall_frames": self.mean_recall,
            "mean_recall_gestures": mean_recall(self.gestures),
            "latency_s": self.latency_s,
        }

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> Score:
        """Parse :meth:`to_json`; raises KeyError, TypeError or ValueError."""
        return cls(
            tuple(content["classes"]),
            np.array(content["frames"], np.int64),
            np.array(content["gestures"], np.int64),
            np.array(content["latencies_s"], np.float64),
            int(content["missed"]),
        )


def score(
    truths: Sequence[ClassNumbers],
    answers: Sequence[ClassNumbers],
    classes: tuple[str, ...],
    frame_rate_hz: float,
    background: int | None,
    delay_s: float = 0.0,
) -> Score:
    """Compare classes frame by frame and gesture by gesture.

    Parameters
    ----------
    truths, answers : sequence of integer ndarray, (frames,)
        True and found classes, one array per clip; where a truth is ``UNKNOWN`` it does not count.
    classes : tuple of str
        Names of the classes.
    frame_rate_hz : float
        Frames per second of all clips.
    background : int or None
        Class that is no gesture; None if there is none.
    delay_s : float
        Time from a frame to its answer, which is added to latencies.
    """
    number = len(classes)
    frames = np.zeros((number, number), np.int64)
    gestures = np.zeros((number, number), np.int64)
    latencies, missed = [], 0
    for truth, answer in zip(truths, answers, strict=True):
        frames += confusion_of(truth, answer, number)
        for start, stop, true in gesture_runs(truth, background):
            own = answer[start:stop]
            # Of several equally frequent ones the first: background before a gesture.
            gestures[true, np.bincount(own, minlength=number).argmax()] += 1
            right = np.flatnonzero(own == true)
            if right.size:
                latencies.append((right[0] + 1) / frame_rate_hz + delay_s)
            else:
                missed += 1
    return Score(classes, frames, gestures, np.array(latencies), missed)


def gesture_runs(truth: ClassNumbers, background: int | None) -> list[tuple[int, int, int]]:
    """Find runs of frames of one gesture: half-open ranges with the class."""
    begins = np.flatnonzero(np.diff(truth, prepend=truth[:1] - 1))
    stops = np.append(begins, len(truth))[1:]
    return [
        (int(start), int(stop), int(truth[start]))
        for start, stop in zip(begins, stops, strict=True)
        if truth[start] not in (UNKNOWN, background)
    ]
