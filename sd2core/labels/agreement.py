"""Agreement of two people who labelled the same recording, frame by frame.

Cohen's kappa. J. Cohen, "A coefficient of agreement for nominal scales",
Educational and Psychological Measurement 20(1), 1960:
kappa = (p_o - p_e) / (1 - p_e), where p_o is the share of frames in which both say the
same, and p_e the share in which they would if each used each answer as often as they did,
independently of the other. Agreement span by span: :mod:`sd2core.labels.matching`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.labels.matching import SpanAgreement, match_spans
from sd2core.labels.spans import Labels, Span
from sd2core.mesh.presence import runs
from sd2core.timebase import Timebase, frames_that_begin

Answer = tuple[str, ...]
"""One annotator's labels of a frame, in alphabetical order, perhaps none."""


@dataclass(frozen=True)
class Kappa:
    """Cohen's kappa with the agreements that it is computed from."""

    # From -1 to 1, where 0 is chance. None where it is undefined: both gave one and the same answer
    # throughout, so that agreement was certain beforehand.
    value: float | None
    observed: float  # Observed agreement p_o.
    expected: float  # Agreement expected by chance p_e.
    frames: int

    @classmethod
    def of(cls, confusion: NDArray[np.int64]) -> Kappa:
        """Compute kappa from counts (n, n) of the answers of one (rows) and the other (columns)."""
        frames = int(confusion.sum())
        same = int(np.trace(confusion))
        # Whole numbers, so that an undefined kappa is told exactly. Python's do not overflow.
        rows, columns = confusion.sum(axis=1).tolist(), confusion.sum(axis=0).tolist()
        by_chance = sum(a * b for a, b in zip(rows, columns, strict=True))
        if frames == 0:
            raise ValueError("no frames")
        certain = by_chance == frames**2
        value = None if certain else (same * frames - by_chance) / (frames**2 - by_chance)
        return cls(value, same / frames, by_chance / frames**2, frames)


@dataclass(frozen=True, eq=False)
class FrameAgreement:
    """Agreement frame by frame."""

    overall: Kappa  # Kappa of whole answers.
    of_label: dict[str, Kappa]  # Presence or absence of every label that either used.
    answers: tuple[Answer, ...]  # Every answer that either gave, ``()`` first.
    # Frames by the answer of a (rows) and of b (columns), in the order of `answers`.
    confusion: NDArray[np.int64]


@dataclass(frozen=True)
class Agreement:
    """Agreement frame by frame and span by span."""

    frames: FrameAgreement
    spans: SpanAgreement


def agreement(
    a: Labels, b: Labels, timebase: Timebase, *, min_iou: float = 0.5, track: str | None = None
) -> Agreement:
    """Compare the labels of two people for one recording.

    Parameters
    ----------
    a, b : Labels
        Label sets and the names of tracks do not matter.
    timebase : Timebase
        Frames of the recording. A frame has the labels that hold when it appears.
    min_iou : float
        Intersection over union that a match must reach, above 0 and up to 1.
    track : str, optional
        Compare this one only.

    Raises
    ------
    Sd2Error
        When `min_iou` is out of range, or a track is missing.
    """
    spans_a, spans_b = _spans(a, track, "first"), _spans(b, track, "second")
    return Agreement(
        frame_agreement(spans_a, spans_b, timebase),
        match_spans(spans_a, spans_b, timebase, min_iou=min_iou),
    )


def frame_agreement(a: Sequence[Span], b: Sequence[Span], timebase: Timebase) -> FrameAgreement:
    """Compare the labels of every frame."""
    labels = sorted({span.label for span in (*a, *b)})
    held_a, held_b = (held_labels(spans, labels, timebase) for spans in (a, b))  # (labels, T)
    kinds, kind = np.unique(np.hstack([held_a, held_b]), axis=1, return_inverse=True)
    kind_answers = [_answer(labels, one) for one in kinds.T]
    answers = tuple(sorted({(), *kind_answers}))
    numbers = np.array([answers.index(answer) for answer in kind_answers])[kind.ravel()]
    frames = len(timebase)
    return FrameAgreement(
        overall=Kappa.of(confusion := _confusion(numbers[:frames], numbers[frames:], len(answers))),
        of_label={
            label: Kappa.of(_confusion(row_a.astype(int), row_b.astype(int), 2))
            for label, row_a, row_b in zip(labels, held_a, held_b, strict=True)
        },
        answers=answers,
        confusion=confusion,
    )


def _spans(labels: Labels, track: str | None, which: str) -> tuple[Span, ...]:
    if track is None:
        return labels.spans
    names = [one.name for one in labels.tracks]
    if track not in names:
        raise Sd2Error(
            f"The {which} labels have no track {track!r}", f"one of {', '.join(names) or 'none'}"
        )
    return labels.of_track(track)


def held_labels(spans: Sequence[Span], labels: list[str], timebase: Timebase) -> NDArray[np.bool_]:
    """Return whether each label is present in each frame, (labels, T)."""
    held = np.zeros((len(labels), len(timebase)), bool)
    rows = {label: row for row, label in enumerate(labels)}
    for span in spans:
        during = frames_that_begin(timebase.times_s, span.start_s, span.end_s)
        held[rows[span.label], during] = True
    return held


def _answer(labels: list[str], held: NDArray[np.bool_]) -> Answer:
    return tuple(label for label, holds in zip(labels, held.tolist(), strict=True) if holds)


def _confusion(a: NDArray[np.int64], b: NDArray[np.int64], answers: int) -> NDArray[np.int64]:
    return np.bincount(a * answers + b, minlength=answers**2).reshape(answers, answers)


_WORDS = (
    (0.0, "less than by chance"),
    (0.2, "slight"),
    (0.4, "fair"),
    (0.6, "moderate"),
    (0.8, "substantial"),
)
"""J. R. Landis and G. G. Koch, "The measurement of observer agreement for categorical data",
Biometrics 33(1), 1977: upper ends, and what they call it. The steps are custom, not theory."""


@dataclass(frozen=True)
class Disagreement:
    """Consecutive frames in which two people give different answers.

    ``a`` and ``b`` are the answers of each in most of the frames.
    """

    start_s: float
    end_s: float
    frames: int
    a: Answer
    b: Answer


def disagreements(
    a: Sequence[Span], b: Sequence[Span], timebase: Timebase
) -> tuple[Disagreement, ...]:
    """Find runs of frames whose labels differ, in order.

    Frames have the labels that hold when they appear, as in :func:`frame_agreement`.
    """
    labels = sorted({span.label for span in (*a, *b)})
    held = np.stack([held_labels(spans, labels, timebase) for spans in (a, b)])  # (2, labels, T)
    differs = (held[0] != held[1]).any(axis=0)
    result = []
    for start, stop in runs(differs):
        both = held[:, :, start:stop].reshape(-1, stop - start)
        answers, counts = np.unique(both, axis=1, return_counts=True)
        usual = answers[:, int(np.argmax(counts))].reshape(2, -1)
        pair = [_answer(labels, row) for row in usual]
        start_s, end_s = timebase.edges_s[[start, stop]].tolist()
        result.append(Disagreement(start_s, end_s, stop - start, pair[0], pair[1]))
    return tuple(result)


def kappa_words(kappa: float | None) -> str:
    """Return the customary word for a kappa, such as "moderate"."""
    if kappa is None:
        return "not defined: both say one and the same throughout"
    return next((words for high, words in _WORDS if kappa < high), "almost perfect")
