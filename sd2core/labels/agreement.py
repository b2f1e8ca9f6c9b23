"""How far two people who labelled the same recording agree.

Frame by frame: Cohen's kappa. J. Cohen, "A coefficient of agreement for nominal scales",
Educational and Psychological Measurement 20(1), 1960:
kappa = (p_o - p_e) / (1 - p_e), where p_o is the share of frames in which both say the
same, and p_e the share in which they would if each used each answer as often as they did,
independently of the other.

Span by span: one-to-one matches by intersection over union (IoU) of time, as detections
of actions are matched to the truth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from sd2core.errors import Sd2Error
from sd2core.labels.spans import Labels, Span
from sd2core.timebase import Timebase

Answer = tuple[str, ...]
"""What one annotator says of a frame: its labels in alphabetical order, perhaps none."""

_ROUNDING_S = 1e-6


@dataclass(frozen=True)
class Kappa:
    """Cohen's kappa, and what it is made of.

    Parameters
    ----------
    value : float or None
        From -1 to 1, where 0 is chance. None where it is undefined: both gave one and
        the same answer throughout, so that agreement was certain beforehand.
    observed, expected : float
        p_o and p_e.
    frames : int
    """

    value: float | None
    observed: float
    expected: float
    frames: int

    @classmethod
    def of(cls, confusion: NDArray[np.int64]) -> Kappa:
        """Of counts (n, n) of what one (rows) and the other (columns) answered."""
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
    """Agreement frame by frame.

    Parameters
    ----------
    overall : Kappa
        Of whole answers.
    of_label : dict of str to Kappa
        Of every label that either used: is it there, or not?
    answers : tuple of Answer
        Every answer that either gave, ``()`` first.
    confusion : int64 array, shape (n, n)
        Frames by the answer of a (rows) and of b (columns), in the order of `answers`.
    """

    overall: Kappa
    of_label: dict[str, Kappa]
    answers: tuple[Answer, ...]
    confusion: NDArray[np.int64]


@dataclass(frozen=True)
class Match:
    """A span of a and the span of b that is taken for the same.

    Parameters
    ----------
    a, b : Span
    iou : float
        Intersection over union of their times.
    start_difference_s, end_difference_s : float
        b's edge less a's: positive when b is later.
    start_difference_frames, end_difference_frames : int or None
        The same in frames; None where a span lies outside the recording.
    """

    a: Span
    b: Span
    iou: float
    start_difference_s: float
    end_difference_s: float
    start_difference_frames: int | None
    end_difference_frames: int | None

    @property
    def same_label(self) -> bool:
        """Whether both call it the same."""
        return self.a.label == self.b.label


@dataclass(frozen=True)
class SpanAgreement:
    """Agreement span by span.

    Parameters
    ----------
    matches : tuple of Match
        In the order of a.
    only_a, only_b : tuple of Span
        What has no match.
    min_iou : float
    """

    matches: tuple[Match, ...]
    only_a: tuple[Span, ...]
    only_b: tuple[Span, ...]
    min_iou: float

    @property
    def f1(self) -> float | None:
        """2 matches / (spans of a + spans of b), whatever their labels; None without spans."""
        spans = 2 * len(self.matches) + len(self.only_a) + len(self.only_b)
        return 2 * len(self.matches) / spans if spans else None

    @property
    def mean_iou(self) -> float | None:
        """Over the matches; None without any."""
        return fmean(match.iou for match in self.matches) if self.matches else None


@dataclass(frozen=True)
class Agreement:
    """Both ways to see it."""

    frames: FrameAgreement
    spans: SpanAgreement


def agreement(
    a: Labels, b: Labels, timebase: Timebase, *, min_iou: float = 0.5, track: str | None = None
) -> Agreement:
    """Compare what two people said of one recording.

    Parameters
    ----------
    a, b : Labels
        Label sets and the names of tracks do not matter.
    timebase : Timebase
        Frames of the recording. A frame has the labels that hold when it appears.
    min_iou : float
        What a match must reach, above 0 and up to 1.
    track : str, optional
        Compare this one only.

    Raises
    ------
    Sd2Error
        When `min_iou` is none, or a track is missing.
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
    answers_a, answers_b = _answers(held_a, labels), _answers(held_b, labels)
    answers = tuple(sorted({(), *answers_a, *answers_b}))
    number = {answer: at for at, answer in enumerate(answers)}
    return FrameAgreement(
        overall=Kappa.of(
            confusion := _confusion(
                np.array([number[answer] for answer in answers_a]),
                np.array([number[answer] for answer in answers_b]),
                len(answers),
            )
        ),
        of_label={
            label: Kappa.of(_confusion(row_a.astype(int), row_b.astype(int), 2))
            for label, row_a, row_b in zip(labels, held_a, held_b, strict=True)
        },
        answers=answers,
        confusion=confusion,
    )


def match_spans(
    a: Sequence[Span], b: Sequence[Span], timebase: Timebase, *, min_iou: float = 0.5
) -> SpanAgreement:
    """Match spans one to one.

    Of all ways to match, one with the most matches is taken; of these, one with the most
    pairs of the same label; of these, one with the largest sum of IoU.

    Raises
    ------
    Sd2Error
        When `min_iou` is not above 0 and up to 1.
    """
    if not 0.0 < min_iou <= 1.0:
        raise Sd2Error(f"The least IoU of a match is {min_iou:g}", "above 0 and up to 1")
    pairs = [
        pair for rows, columns in _touching(a, b) for pair in _paired(a, b, rows, columns, min_iou)
    ]
    matches = [_match(a[row], b[column], iou, timebase) for row, column, iou in pairs]
    taken_a, taken_b = {row for row, _, _ in pairs}, {column for _, column, _ in pairs}
    return SpanAgreement(
        matches=tuple(sorted(matches, key=lambda match: (match.a.start_s, match.a.id))),
        only_a=tuple(span for at, span in enumerate(a) if at not in taken_a),
        only_b=tuple(span for at, span in enumerate(b) if at not in taken_b),
        min_iou=min_iou,
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
    """Which labels hold when each frame appears, (labels, T)."""
    held = np.zeros((len(labels), len(timebase)), bool)
    for span in spans:
        edges_s = np.array([span.start_s, span.end_s]) - _ROUNDING_S
        first, stop = np.searchsorted(timebase.times_s, edges_s)
        held[labels.index(span.label), first:stop] = True
    return held


def _answers(held: NDArray[np.bool_], labels: list[str]) -> list[Answer]:
    return [
        tuple(label for label, holds in zip(labels, frame, strict=True) if holds)
        for frame in held.T.tolist()
    ]


def _confusion(a: NDArray[np.int64], b: NDArray[np.int64], answers: int) -> NDArray[np.int64]:
    return np.bincount(a * answers + b, minlength=answers**2).reshape(answers, answers)


def _touching(a: Sequence[Span], b: Sequence[Span]) -> list[tuple[list[int], list[int]]]:
    """Groups of spans of a and b that may be matched: they hang together by overlaps.

    Ten thousand spans of each are matched in groups of a few.
    """
    kinds = [(span.start_s, span.end_s, 0, at) for at, span in enumerate(a)]
    kinds += [(span.start_s, span.end_s, 1, at) for at, span in enumerate(b)]
    groups: list[tuple[list[int], list[int]]] = []
    until_s = -np.inf
    for start_s, end_s, kind, at in sorted(kinds):
        if start_s >= until_s:
            groups.append(([], []))
        groups[-1][kind].append(at)
        until_s = max(until_s, end_s)
    return [(sorted(rows), sorted(columns)) for rows, columns in groups if rows and columns]


def _paired(
    a: Sequence[Span], b: Sequence[Span], rows: list[int], columns: list[int], min_iou: float
) -> list[tuple[int, int, float]]:
    """The best pairs within a group, with their IoU."""
    some_a, some_b = [a[row] for row in rows], [b[column] for column in columns]
    iou = iou_of(some_a, some_b)
    same = np.array([[x.label == y.label for y in some_b] for x in some_a])
    # Rounding must not lose the match of a span with itself at a threshold of 1.
    allowed = iou >= min_iou - 1e-12
    # A sum of IoU is at most the number of matches, which is below `above`.
    above = min(iou.shape) + 1.0
    worth = np.where(allowed, above**2 + above * same + iou, 0.0)
    found = zip(*linear_sum_assignment(worth, maximize=True), strict=True)
    return [
        (rows[row], columns[column], float(iou[row, column]))
        for row, column in found
        if allowed[row, column]
    ]


def iou_of(a: Sequence[Span], b: Sequence[Span]) -> NDArray[np.float64]:
    """Intersection over union of the times of spans, (len(a), len(b))."""
    start_a, end_a = np.array([(s.start_s, s.end_s) for s in a]).reshape(-1, 2).T[:, :, None]
    start_b, end_b = np.array([(s.start_s, s.end_s) for s in b]).reshape(-1, 2).T[:, None, :]
    both = np.maximum(np.minimum(end_a, end_b) - np.maximum(start_a, start_b), 0.0)
    return np.asarray(both / ((end_a - start_a) + (end_b - start_b) - both))


def _match(a: Span, b: Span, iou: float, timebase: Timebase) -> Match:
    frames_a = timebase.frames_between(a.start_s, a.end_s)
    frames_b = timebase.frames_between(b.start_s, b.end_s)
    inside = frames_a[1] > frames_a[0] and frames_b[1] > frames_b[0]
    return Match(
        a=a,
        b=b,
        iou=iou,
        start_difference_s=b.start_s - a.start_s,
        end_difference_s=b.end_s - a.end_s,
        start_difference_frames=frames_b[0] - frames_a[0] if inside else None,
        end_difference_frames=frames_b[1] - frames_a[1] if inside else None,
    )
