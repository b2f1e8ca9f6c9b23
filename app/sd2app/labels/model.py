"""Labels of the open recording: spans, also as arrays, selection, current track, and marks."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from sd2core.labels.formats.lanes import apart
from sd2core.labels.label_set import UNKNOWN
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.labels.suggest import LABEL as UNNAMED
from sd2core.labels.suggest import TRACK as SUGGESTIONS


@dataclass(frozen=True, eq=False)
class SpanArrays:
    """All spans, one row each, in the order of labels."""

    spans: tuple[Span, ...]
    starts_s: NDArray[np.float64]
    ends_s: NDArray[np.float64]
    ids: NDArray[np.int64]
    tracks: NDArray[np.int64]
    lanes: NDArray[np.int64]  # lane within the track
    tones: NDArray[np.int64]  # number of the colour
    lanes_of_track: tuple[int, ...]  # lanes per track: more than one where spans overlap
    colours: tuple[str, ...]  # #rrggbb; the last is for labels outside the label set

    @classmethod
    def of(cls, labels: Labels) -> SpanArrays:
        """Make the arrays of labels."""
        offered = labels.label_set
        colours = (*(one.colour for one in offered.labels), UNKNOWN)
        names = {one.label for one in labels.spans}
        tone_of = {name: colours.index(offered.colour_of(name)) for name in names}
        track_of = {one.name: number for number, one in enumerate(labels.tracks)}
        facts = [
            (one.start_s, one.end_s, one.id, track_of[one.track], tone_of[one.label])
            for one in labels.spans
        ]
        columns = np.array(facts, np.float64).reshape(-1, 5).T
        ids, tracks, tones = columns[2:].astype(np.int64)
        lanes = np.zeros(len(facts), np.int64)
        counts = [1] * len(labels.tracks)
        for number, track in enumerate(labels.tracks):
            if track.overlap == "free":
                rows = np.flatnonzero(tracks == number)
                lanes[rows], counts[number] = _lanes([labels.spans[row] for row in rows])
        return cls(
            labels.spans, columns[0], columns[1], ids, tracks, lanes, tones, tuple(counts), colours
        )

    @cached_property
    def rows(self) -> NDArray[np.int64]:
        """Lane of every span, counted over all tracks from the top."""
        before = np.concatenate([[0], np.cumsum(self.lanes_of_track, dtype=np.int64)])
        return before[self.tracks] + self.lanes

    @cached_property
    def ranks(self) -> Mapping[int, int]:
        """Rank of every suggestion without a name, by its id: 1 is where most moves."""
        unnamed = [one for one in self.spans if (one.label, one.origin) == (UNNAMED, "suggestion")]
        surest_first = sorted(unnamed, key=lambda one: -(one.confidence or 0.0))
        return {one.id: rank for rank, one in enumerate(surest_first, start=1)}

    def rows_of(self, ids: Collection[int]) -> NDArray[np.int64]:
        """Return the rows of the spans of some ids, in order."""
        return np.flatnonzero(np.isin(self.ids, list(ids)))

    def within(self, start_s: float, end_s: float) -> NDArray[np.int64]:
        """Return the rows of spans that overlap an interval."""
        return np.flatnonzero((self.starts_s < end_s) & (self.ends_s > start_s))


def _lanes(spans: list[Span]) -> tuple[list[int], int]:
    """Lane of each span, and the number of lanes."""
    lanes = apart(spans, lambda span: (span.start_s, span.end_s))
    lane_of = {span.id: lane for lane, row in enumerate(lanes) for span in row}
    return [lane_of[span.id] for span in spans], len(lanes)


@dataclass(frozen=True)
class Mark:
    """Span that has begun and not ended."""

    track: str
    label: str
    start_s: float


class LabelsModel(QObject):
    """Current labels; only :class:`sd2app.labels.edits.LabelEdits` changes them.

    Its values are changed by its methods only, which emit a signal.
    """

    changed = Signal()  # spans, tracks or the label set
    choices_changed = Signal()  # tracks or the label set; before the one above
    selection_changed = Signal()  # selected spans, or the track or label for new ones
    marks_changed = Signal()  # marks in progress

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.labels = Labels()
        self.arrays = SpanArrays.of(self.labels)  # the spans
        self.track = self.labels.tracks[0].name  # for new spans; empty without one
        self.label = self.labels.label_set.labels[0].name  # for drawn spans: the one used last
        self.marks: tuple[Mark, ...] = ()  # in progress, in the order of their starts
        self.selected_ids: frozenset[int] = frozenset()

    @property
    def selected(self) -> tuple[Span, ...]:
        """Selected spans, in the order of time."""
        return tuple(self.labels.spans[row] for row in self.arrays.rows_of(self.selected_ids))

    def within(self, start_s: float, end_s: float) -> list[Span]:
        """Return the spans that overlap an interval, in order."""
        return [self.labels.spans[row] for row in self.arrays.within(start_s, end_s)]

    def at(self, time_s: float) -> Span | None:
        """Return the span at a time: one on the track for new spans, else the shortest."""
        arrays = self.arrays
        rows = np.flatnonzero((arrays.starts_s <= time_s) & (time_s < arrays.ends_s))
        spans = [self.labels.spans[row] for row in rows]
        return min(spans, key=lambda one: (one.track != self.track, one.duration_s), default=None)

    @property
    def targets(self) -> tuple[LabelTrack, ...]:
        """Tracks that new spans can go to: all but that of the suggestions."""
        return tuple(one for one in self.labels.tracks if one.name != SUGGESTIONS)

    def open(self, labels: Labels) -> None:
        """Show another recording's labels; selection and marks are cleared."""
        self.marks = ()
        self.selected_ids = frozenset()
        self._assign(replace(labels, spans=()))  # spans of the same number are others
        self._assign(labels)
        self.selection_changed.emit()
        self.marks_changed.emit()

    def set_labels(self, labels: Labels) -> None:
        """Assign labels; spans that no longer exist are deselected."""
        if labels is self.labels:
            return
        ids = {span.id for span in labels.spans}
        pruned = not self.selected_ids <= ids
        self.selected_ids = self.selected_ids & ids
        self._assign(labels)
        if pruned:
            self.selection_changed.emit()

    def select(self, ids: Iterable[int]) -> None:
        """Select these spans and no others.

        The track of the first is the one for new spans, unless it is that of the suggestions.
        """
        wanted = frozenset(ids) & frozenset(self.arrays.ids.tolist())
        if wanted == self.selected_ids:
            return
        self.selected_ids = wanted
        if wanted and self.selected[0].track != SUGGESTIONS:
            self.track = self.selected[0].track
        self.selection_changed.emit()

    def select_all(self) -> None:
        """Select every span."""
        self.select(self.arrays.ids.tolist())

    def select_up_to(self, span: Span) -> None:
        """Select from the selection to a span: spans between in time, on tracks between."""
        names = [track.name for track in self.labels.tracks]
        corners = [*self.selected, span]
        rows = [names.index(one.track) for one in corners]
        first_s, last_s = min(one.start_s for one in corners), max(one.end_s for one in corners)
        self.select(
            one.id
            for one in self.within(first_s, last_s)
            if min(rows) <= names.index(one.track) <= max(rows)
        )

    def set_track(self, name: str) -> None:
        """Choose the track for new spans; that of the suggestions is none."""
        if name not in (self.track, SUGGESTIONS):
            self.track = self.labels.track(name).name
            self.selection_changed.emit()

    def set_label(self, name: str) -> None:
        """Choose the label for drawn spans."""
        if name != self.label:
            self.label = name
            self.selection_changed.emit()

    def set_marks(self, marks: Iterable[Mark]) -> None:
        """Set the marks in progress."""
        marks = tuple(marks)
        if marks != self.marks:
            self.marks = marks
            self.marks_changed.emit()

    def _assign(self, labels: Labels) -> None:
        before, self.labels = self.labels, labels
        self.arrays = SpanArrays.of(labels)
        names = [track.name for track in self.targets]
        left = tuple(mark for mark in self.marks if mark.track in names)
        dropped, self.marks = left != self.marks, left
        if self.track not in names:
            self.track = names[0] if names else ""
        if labels.label_set.find(self.label) is None and labels.label_set.labels:
            self.label = labels.label_set.labels[0].name
        if (labels.tracks, labels.label_set) != (before.tracks, before.label_set):
            self.choices_changed.emit()
        self.changed.emit()
        if dropped:
            self.marks_changed.emit()
