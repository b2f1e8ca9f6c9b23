"""The labels of the recording that is open, what is selected, and what is being marked."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QObject, Signal

from sd2core.labels.spans import Labels, Span

UNKNOWN_COLOUR = "#8a8f98"
"""Of labels that the label set does not have."""


@dataclass(frozen=True)
class Mark:
    """A span that has begun and not ended.

    Parameters
    ----------
    track, label : str
    start_s : float
    """

    track: str
    label: str
    start_s: float


class LabelsModel(QObject):
    """Labels as they are now; only :class:`sd2app.label_edits.LabelEdits` changes them.

    Signals
    -------
    changed
        Spans, tracks or the label set.
    selection_changed
        Which spans are selected, on which track new ones come, or with which label.
    marks_changed
        What is being marked.
    """

    changed = Signal()
    selection_changed = Signal()
    marks_changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._labels = Labels()
        self._selected: tuple[int, ...] = ()
        self._track = self._labels.tracks[0].name
        self._label = self._labels.label_set.labels[0].name
        self._marks: tuple[Mark, ...] = ()
        self._edges_s = np.empty((2, 0))

    @property
    def labels(self) -> Labels:
        """All of them."""
        return self._labels

    @property
    def selected(self) -> tuple[Span, ...]:
        """The spans that are selected, in the order of time."""
        return tuple(span for span in self._labels.spans if span.id in self._selected)

    @property
    def track(self) -> str:
        """Where new spans come; empty where there is no track."""
        return self._track

    @property
    def label(self) -> str:
        """What a span is called that a hand draws: the label that was used last."""
        return self._label

    @property
    def marks(self) -> tuple[Mark, ...]:
        """What has begun and not ended, in the order of beginning."""
        return self._marks

    def is_selected(self, span_id: int) -> bool:
        """Whether a span is selected."""
        return span_id in self._selected

    def within(self, start_s: float, end_s: float) -> list[Span]:
        """The spans of which something lies between two times, in order."""
        starts_s, ends_s = self._edges_s
        rows = np.flatnonzero((starts_s < end_s) & (ends_s > start_s))
        return [self._labels.spans[row] for row in rows]

    def colour_of(self, label: str) -> str:
        """``#rrggbb`` of a label."""
        known = self._labels.label_set.find(label)
        return known.colour if known is not None else UNKNOWN_COLOUR

    # --- changing -------------------------------------------------------------------------

    def open(self, labels: Labels) -> None:
        """Take over another recording's labels; nothing is selected or being marked."""
        self._selected, self._marks = (), ()
        self._assign(labels)
        self.selection_changed.emit()
        self.marks_changed.emit()

    def set_labels(self, labels: Labels) -> None:
        """Assign labels; what is gone is no longer selected."""
        if labels is self._labels:
            return
        there = {span.id for span in labels.spans}
        kept = tuple(one for one in self._selected if one in there)
        pruned, self._selected = kept != self._selected, kept
        self._assign(labels)
        if pruned:
            self.selection_changed.emit()

    def select(self, ids: Iterable[int]) -> None:
        """Select these spans and no others; new ones come on the track of the first."""
        wanted = set(ids)
        chosen = tuple(span.id for span in self._labels.spans if span.id in wanted)
        if chosen == self._selected:
            return
        self._selected = chosen
        if chosen:
            self._track = self._labels.span(chosen[0]).track
        self.selection_changed.emit()

    def set_track(self, name: str) -> None:
        """Choose where new spans come."""
        if name != self._track:
            self._track = self._labels.track(name).name
            self.selection_changed.emit()

    def set_label(self, name: str) -> None:
        """Choose what a span is called that a hand draws."""
        if name != self._label:
            self._label = name
            self.selection_changed.emit()

    def set_marks(self, marks: Iterable[Mark]) -> None:
        """Say what is being marked."""
        marks = tuple(marks)
        if marks != self._marks:
            self._marks = marks
            self.marks_changed.emit()

    def _assign(self, labels: Labels) -> None:
        self._labels = labels
        edges_s = [(span.start_s, span.end_s) for span in labels.spans]
        self._edges_s = np.array(edges_s, np.float64).reshape(-1, 2).T
        names = [track.name for track in labels.tracks]
        if self._track not in names:
            self._track = names[0] if names else ""
        if labels.label_set.find(self._label) is None and labels.label_set.labels:
            self._label = labels.label_set.labels[0].name
        self.changed.emit()
