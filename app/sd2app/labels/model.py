"""Labels of the open recording, with selection, current track and label, and marks in progress."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QObject, Signal

from sd2app.labels.arrays import UNKNOWN_COLOUR, SpanArrays
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.labels.suggest import TRACK as SUGGESTIONS


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

    def is_selected(self, span_id: int) -> bool:
        """True if the span is selected."""
        return span_id in self.selected_ids

    def within(self, start_s: float, end_s: float) -> list[Span]:
        """Return the spans that overlap an interval, in order."""
        return [self.labels.spans[row] for row in self.arrays.within(start_s, end_s)]

    def at(self, time_s: float) -> Span | None:
        """Return the span at a time: one on the track for new spans, else the shortest."""
        arrays = self.arrays
        rows = np.flatnonzero((arrays.starts_s <= time_s) & (time_s < arrays.ends_s))
        found = [self.labels.spans[row] for row in rows]
        return min(found, key=lambda one: (one.track != self.track, one.duration_s), default=None)

    def colour_of(self, label: str) -> str:
        """Return the ``#rrggbb`` of a label."""
        known = self.labels.label_set.find(label)
        return known.colour if known is not None else UNKNOWN_COLOUR

    @property
    def targets(self) -> tuple[LabelTrack, ...]:
        """Tracks that new spans can go to: all but that of the suggestions."""
        return tuple(one for one in self.labels.tracks if one.name != SUGGESTIONS)

    def open(self, labels: Labels) -> None:
        """Show another recording's labels; selection and marks are cleared."""
        self.marks = ()
        self.selected_ids = frozenset()
        self._assign(labels)
        self.selection_changed.emit()
        self.marks_changed.emit()

    def set_labels(self, labels: Labels) -> None:
        """Assign labels; spans that no longer exist are deselected."""
        if labels is self.labels:
            return
        there = {span.id for span in labels.spans}
        pruned = not self.selected_ids <= there
        self.selected_ids = self.selected_ids & there
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
        self.labels = labels
        self.arrays = SpanArrays.of(labels)
        names = [track.name for track in self.targets]
        left = tuple(mark for mark in self.marks if mark.track in names)
        dropped, self.marks = left != self.marks, left
        if self.track not in names:
            self.track = names[0] if names else ""
        if labels.label_set.find(self.label) is None and labels.label_set.labels:
            self.label = labels.label_set.labels[0].name
        self.changed.emit()
        if dropped:
            self.marks_changed.emit()
