"""Statistics per label: number and durations of spans, and share of the recording."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass

import numpy as np

from sd2core.files.tables import as_cell
from sd2core.labels.spans import Labels, Span

HEADINGS = ("label", "spans", "total s", "mean s", "sd s", "median s", "min s", "max s", "share %")
NO_NUMBER = "–"


@dataclass(frozen=True)
class LabelStatistics:
    """Statistics of the spans of one label; durations are None without any span."""

    label: str
    count: int
    total_s: float  # Sum of the durations: where spans overlap, an instant counts in each.
    mean_s: float | None
    sd_s: float | None  # The sample's (n - 1); None below two spans.
    median_s: float | None
    shortest_s: float | None
    longest_s: float | None
    # Share of the recording that they cover, 0 to 1, overlaps counting once. None where the length
    # of the recording is unknown.
    share: float | None


def label_statistics(
    labels: Labels, extent_s: tuple[float, float] | None = None
) -> list[LabelStatistics]:
    """Compute statistics of every label of the set, also those without a span, then of others.

    ``extent_s``: start and end of the recording.
    """
    spans: dict[str, list[Span]] = {one.name: [] for one in labels.label_set.labels}
    unknown: dict[str, list[Span]] = {}
    for span in labels.spans:
        (spans if span.label in spans else unknown).setdefault(span.label, []).append(span)
    ordered = [*spans.items(), *sorted(unknown.items())]
    return [_of(label, own, extent_s) for label, own in ordered]


def statistics_rows(statistics: Iterable[LabelStatistics]) -> list[tuple[str, ...]]:
    """Format a row of text per label, in the order of :data:`HEADINGS`."""
    rows = []
    for one in statistics:
        label, count, *seconds, share = astuple(one)
        cells = [NO_NUMBER if value is None else f"{value:.3f}" for value in seconds]
        percent = NO_NUMBER if share is None else f"{100 * share:.1f}"
        rows.append((label, str(count), *cells, percent))
    return rows


def statistics_text(rows: Iterable[Sequence[str]], separator: str = ",") -> str:
    """Format rows with their headings as CSV, or with a tab as a table to paste."""
    written = io.StringIO()
    writer = csv.writer(written, delimiter=separator, lineterminator="\n")
    writer.writerow(HEADINGS)
    for label, *cells in rows:
        writer.writerow([as_cell(label), *("" if cell == NO_NUMBER else cell for cell in cells)])
    return written.getvalue()


def _of(label: str, spans: Sequence[Span], extent_s: tuple[float, float] | None) -> LabelStatistics:
    durations_s = np.array([span.duration_s for span in spans])
    return LabelStatistics(
        label=label,
        count=len(spans),
        total_s=float(durations_s.sum()),
        mean_s=float(durations_s.mean()) if spans else None,
        sd_s=float(durations_s.std(ddof=1)) if len(spans) > 1 else None,
        median_s=float(np.median(durations_s)) if spans else None,
        shortest_s=float(durations_s.min()) if spans else None,
        longest_s=float(durations_s.max()) if spans else None,
        share=None if extent_s is None else _held_s(spans, extent_s) / (extent_s[1] - extent_s[0]),
    )


def _held_s(spans: Iterable[Span], extent_s: tuple[float, float]) -> float:
    """Total time covered inside an interval by spans in the order of their starts."""
    held_s, until_s = 0.0, extent_s[0]
    for span in spans:
        start_s, end_s = max(span.start_s, until_s), min(span.end_s, extent_s[1])
        if end_s > start_s:
            held_s += end_s - start_s
            until_s = end_s
    return held_s
