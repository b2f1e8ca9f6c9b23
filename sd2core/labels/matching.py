"""One-to-one matching of the spans of two people, by intersection over union (IoU) of time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.labels.spans import Span
from sd2core.timebase import Timebase

# One frame of two is half of them wherever in a recording they lie: subtracting times of hours
# leaves an IoU of single frames uncertain by 1e-10.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Match:
    """Pair of spans, one of a and one of b, taken for the same event.

    Differences are b's edge less a's: positive when b is later.
    """

    a: Span
    b: Span
    iou: float  # Intersection over union of their times.
    start_difference_s: float
    end_difference_s: float
    start_difference_frames: int | None  # None where a span lies outside the recording.
    end_difference_frames: int | None

    @property
    def same_label(self) -> bool:
        """True if both spans have the same label."""
        return self.a.label == self.b.label


@dataclass(frozen=True)
class SpanAgreement:
    """Matches in the order of a, and the spans of each without a match."""

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


def match_spans(
    a: Sequence[Span], b: Sequence[Span], timebase: Timebase, *, min_iou: float = 0.5
) -> SpanAgreement:
    """Match spans one to one.

    Of all ways to match, one with the most matches is taken; of these, one with the most pairs of
    the same label; of these, one with the largest sum of IoU.

    Parameters
    ----------
    a, b : sequence of Span
    timebase : Timebase
        Of the recording, for differences in frames.
    min_iou : float
        Least IoU of a match, above 0 and up to 1.

    Raises
    ------
    Sd2Error
        When ``min_iou`` is not.
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


def _touching(a: Sequence[Span], b: Sequence[Span]) -> list[tuple[list[int], list[int]]]:
    """Groups of spans of a and b connected by overlaps, so that only small groups are matched."""
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
    # The window loads this module when it starts; importing SciPy's optimisers takes 0.2 s.
    from scipy.optimize import linear_sum_assignment

    some_a, some_b = [a[row] for row in rows], [b[column] for column in columns]
    iou = iou_of(some_a, some_b)
    same = np.array([[x.label == y.label for y in some_b] for x in some_a])
    allowed = iou >= min_iou - _ROUNDING
    # A sum of IoU is at most the number of matches, which is below `above`.
    above = min(iou.shape) + 1.0
    worth = np.where(allowed, above**2 + above * same + iou, 0.0)
    pairs = zip(*linear_sum_assignment(worth, maximize=True), strict=True)
    return [
        (rows[row], columns[column], float(iou[row, column]))
        for row, column in pairs
        if allowed[row, column]
    ]


def iou_of(a: Sequence[Span], b: Sequence[Span]) -> NDArray[np.float64]:
    """Compute the intersection over union of the times of spans, (len(a), len(b))."""
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
