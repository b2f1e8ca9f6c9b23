"""Clips for classifiers, joined again from the segments of a data set."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sd2core.classify.data import UNKNOWN, Clip, ClipSet, in_order
from sd2core.datasets.reading import Dataset
from sd2core.datasets.source import KINDS
from sd2core.errors import Sd2Error
from sd2core.labels.per_frame import BACKGROUND
from sd2core.maps import MapKind

_SLACK_FRAMES = 0.01
"""Tolerance for times that were rounded."""


def clips_of_dataset(dataset: Dataset, kind: MapKind) -> ClipSet:
    """Return the clips of one kind of maps in a data set.

    Segments of a source that overlap or touch become one clip again, so that a frame
    counts once and a classifier that remembers sees whole movements. Labels without a class are
    unknown.
    """
    header = dataset.header
    if header.spans is not None and header.spans.length == "resampled":
        raise Sd2Error(
            f"{dataset.path} holds spans that were stretched to one length",
            "frames at the pace at which they came",
            "Export windows, or spans that are padded",
        )
    if kind not in header.kinds:
        raise Sd2Error(f"{dataset.path} holds no {kind} maps", f"one of {', '.join(header.kinds)}")
    named = {BACKGROUND: BACKGROUND, **header.classes}
    classes = in_order(named.values())
    numbers = {label: classes.index(name) for label, name in named.items()}
    table = np.array([numbers.get(label, UNKNOWN) for label in header.labels], np.int8)
    rows = np.flatnonzero(dataset["available"][:][:, KINDS.index(kind)])
    if not len(rows):
        raise Sd2Error(
            f"{dataset.path} says that no segment of it has {kind} maps",
            "one at least",
            "Choose another kind of maps, or export it again",
        )
    source = dataset["source"][:][rows]
    subject, placement = dataset["subject"][:][rows], dataset["placement"][:][rows]
    recordings = [one["recording"] for one in dataset.sources()]
    clips = []
    resampled = dataset["resampled"][:][rows]
    # Only differences within a source have a meaning. A camera's frames come at times of its own,
    # which are no whole numbers of frames; only what was resampled has just its times.
    frames, times_s = dataset["start_frame"][:][rows], dataset["start_s"][:][rows]
    first_frame = np.where(resampled, times_s * header.frame_rate_hz, frames.astype(np.float64))
    # Spans are clips of their own, even where they lie side by side.
    belongs = 2 * source + resampled if header.spans is None else np.arange(len(rows))
    for run, starts in _runs(belongs, first_frame, header.length):
        energies = _joined(dataset[kind][rows[run]], starts)
        label = _joined(dataset["label"][rows[run]], starts)
        if header.spans is not None:
            filled = dataset["mask"][rows[run]][0]
            energies, label = energies[filled], label[filled]
        first = run.start
        clips.append(
            Clip(
                header.subjects[subject[first]],
                recordings[source[first]],
                kind,
                energies,
                table[label],
                int(placement[first]),
            )
        )
    return ClipSet(
        header.axis,
        header.null_bins,
        header.frame_rate_hz,
        classes,
        tuple(clips),
        {"dataset": header.title, "kind": kind, "made": header.provenance},
    )


def _runs(
    belongs: NDArray[np.integer], first_frame: NDArray[np.float64], length: int
) -> Iterator[tuple[slice, NDArray[np.int64]]]:
    """Yield the rows of each clip (one number in ``belongs``), and where its segments begin."""
    apart = np.diff(first_frame)
    steps = np.rint(apart)
    continues = (
        (np.diff(belongs) == 0)
        & (np.abs(apart - steps) <= _SLACK_FRAMES)
        & (steps > 0)
        & (steps <= length)
    )
    edges = np.concatenate([[0], np.flatnonzero(~continues) + 1, [len(belongs)]])
    for begun, ended in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        starts = np.concatenate([[0], np.cumsum(steps[begun : ended - 1])]).astype(np.int64)
        yield slice(begun, ended), starts


def _joined(segments: NDArray, starts: NDArray[np.int64]) -> NDArray:
    """Join segments, equal where they overlap: (segments, length, …) → (frames, …)."""
    length = segments.shape[1]
    whole = np.empty((int(starts[-1]) + length, *segments.shape[2:]), segments.dtype)
    for start, segment in zip(starts, segments, strict=True):
        whole[start : start + length] = segment
    return whole
