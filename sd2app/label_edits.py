"""Every edit of labels: done first, then pushed to the history as one step."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Literal

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QUndoCommand

from sd2app.models.document import DocumentModel
from sd2app.models.label_session import LabelSession
from sd2app.models.labels import LabelsModel, Mark
from sd2app.models.playback import PlaybackModel
from sd2core.errors import Sd2Error
from sd2core.labels import edits, span_fields
from sd2core.labels.edits import Edit, Side
from sd2core.labels.snapping import snap
from sd2core.labels.spans import Labels, Span
from sd2core.timebase import Timebase

Change = Callable[[Labels, Timebase], Edit]


class _Step(QUndoCommand):
    """One edit, taken back and done again."""

    def __init__(
        self,
        name: str,
        become: Callable[[str, Labels, Labels], None],
        before: Labels,
        after: Labels,
    ) -> None:
        super().__init__(name)
        self._become, self._before, self._after = become, before, after

    def undo(self) -> None:
        self._become(f"Undo {self.text().lower()}", self._after, self._before)

    def redo(self) -> None:
        self._become(self.text(), self._before, self._after)


class LabelEdits(QObject):
    """What the user can do to labels. A drag is one step in the history.

    Each edit is on disk when it is made (see :class:`.models.label_session.LabelSession`).
    Times are the frames of the playback clock. What cannot be done changes nothing, and
    ``failed`` says why; while a hand drags it is silent, for the hand sees that it stops.
    """

    failed = Signal(str)

    def __init__(
        self,
        document: DocumentModel,
        labels: LabelsModel,
        playback: PlaybackModel,
        session: LabelSession,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._document, self._labels, self._playback = document, labels, playback
        self._session = session
        self._before: Labels | None = None
        self._dragged: Edit | None = None

    @property
    def refusal(self) -> str:
        """Why nothing can be edited; empty where it can."""
        return self._session.refusal

    # --- a hand on the timeline -----------------------------------------------------------

    @property
    def dragging(self) -> bool:
        """Whether a hand holds something."""
        return self._before is not None

    def begin_drag(self) -> bool:
        """A hand takes hold of a span, an edge, or an empty place; False where it may not."""
        if self._refused():
            return False
        self._before, self._dragged = self._labels.labels, None
        return True

    def drag_edge(self, span_id: int, side: Side, time_s: float, within_s: float) -> None:
        """The hand has an edge of a span at a time, and spans within a distance attract it."""
        place_s = self._snapped(time_s, within_s, span_id)
        self._drag(lambda labels, base: edits.resize(labels, base, span_id, side, place_s))

    def drag_span(self, span_id: int, start_s: float, within_s: float) -> None:
        """The hand has a span so that it begins at a time; either end is attracted."""
        assert self._before is not None
        length_s = self._before.span(span_id).duration_s
        ends = (
            (self._snapped(start_s, within_s, span_id), 0.0),
            (self._snapped(start_s + length_s, within_s, span_id), length_s),
        )
        near_s = min((at_s - offset_s for at_s, offset_s in ends), key=lambda t: abs(t - start_s))
        self._drag(lambda labels, base: edits.move(labels, base, span_id, near_s))

    def drag_new(self, track: str, from_s: float, to_s: float, within_s: float) -> None:
        """The hand draws a span from one time to another."""
        one_s, other_s = (self._snapped(time_s, within_s) for time_s in (from_s, to_s))
        label = self._labels.label
        self._drag(lambda labels, base: edits.create(labels, base, track, one_s, other_s, label))

    def end_drag(self) -> None:
        """The hand lets go."""
        before, self._before = self._before, None
        if before is not None and self._dragged is not None:
            self._make(self._dragged, before)
        self._dragged = None

    def cancel_drag(self) -> None:
        """Everything as it was before the hand took hold."""
        before, self._before, self._dragged = self._before, None, None
        if before is not None:
            self._labels.set_labels(before)

    def _drag(self, change: Change) -> None:
        assert self._before is not None
        try:
            self._dragged = change(self._before, self._playback.timebase)
        except Sd2Error:
            return
        self._labels.set_labels(self._dragged.labels)

    def _snapped(self, time_s: float, within_s: float, held: int | None = None) -> float:
        assert self._before is not None
        ignore = () if held is None else (held,)
        base = self._playback.timebase
        return snap(self._before, base, time_s, within_s, ignore=ignore).time_s

    # --- keys -----------------------------------------------------------------------------

    def mark(self, label: str) -> None:
        """Begin a span with the frame on screen, or end the one with this label before it.

        On a track without overlaps what else is being marked ends where this begins.
        """
        track = self._labels.track
        if not track or self._refused():
            return
        self._labels.set_label(label)
        now_s = self._playback.timebase.time_of(self._playback.frame)
        exclusive = self._labels.labels.track(track).overlap == "exclusive"
        ended = [
            mark
            for mark in self._labels.marks
            if mark.track == track and (mark.label == label or exclusive)
        ]
        for mark in ended:
            self._end(mark, now_s)
        if not any(mark.label == label for mark in ended):
            self._labels.set_marks((*self._labels.marks, Mark(track, label, now_s)))

    def end_marks(self) -> None:
        """End all that is being marked before the frame on screen."""
        now_s = self._playback.timebase.time_of(self._playback.frame)
        for mark in self._labels.marks:
            self._end(mark, now_s)

    def drop_marks(self) -> None:
        """Forget what is being marked."""
        self._labels.set_marks(())

    def relabel(self, label: str) -> None:
        """Give the selected spans another label."""
        self._labels.set_label(label)
        ids = self._ids()
        self.apply(lambda labels, base: span_fields.relabel(labels, ids, label))

    def edge_here(self, side: Side) -> None:
        """Put an edge of the selected span at the frame on screen."""
        chosen, base = self._labels.selected, self._playback.timebase
        if not chosen:
            return
        # The frame on screen is the first of the span, or its last.
        frame = self._playback.frame + (side == "end")
        time_s = base.time_of(frame) if frame < len(base) else base.end_s
        self.apply(lambda labels, base: edits.resize(labels, base, chosen[0].id, side, time_s))

    def split(self) -> None:
        """Cut the selected span, or the one on the track, in two at the frame on screen."""
        now_s = self._playback.timebase.time_of(self._playback.frame)
        here = [span for span in self._candidates() if span.start_s < now_s < span.end_s]
        if here:
            self.apply(lambda labels, base: edits.split(labels, base, here[0].id, now_s))

    def delete(self) -> None:
        """Delete the selected spans."""
        if ids := self._ids():
            self.apply(lambda labels, base: edits.delete(labels, ids))

    def merge(self) -> None:
        """Join the selected spans."""
        ids = self._ids()
        self.apply(lambda labels, base: edits.merge(labels, ids))

    def nudge(self, frames: int) -> None:
        """Move the selected span by frames."""
        chosen = self._labels.selected
        if chosen:
            self.apply(lambda labels, base: edits.nudge(labels, base, chosen[0].id, frames))

    def restore(self) -> None:
        """Take over what an earlier session left behind."""
        recording = self._document.recording
        if recording is None or self._session.offer is None or self._refused():
            return
        before = self._labels.labels
        recording.labels = self._session.take_offer()  # on disk already, as a session of its own
        self._labels.set_labels(recording.labels)
        self._make(Edit("Restore labels", recording.labels), before)

    # --- finding one's way ----------------------------------------------------------------

    def step(self, towards: Literal[-1, 1]) -> None:
        """Select the next span of the track, or the one before, and go to its start."""
        spans = self._labels.labels.of_track(self._labels.track) if self._labels.track else ()
        now_s = self._playback.timebase.time_of(self._playback.frame)
        chosen = self._labels.selected
        from_s = chosen[0].start_s if chosen else now_s
        if towards > 0:
            found = next((one for one in spans if one.start_s > from_s), None)
        else:
            found = next((one for one in reversed(spans) if one.start_s < from_s), None)
        if found is not None:
            self.go_to(found)

    def go_to(self, span: Span) -> None:
        """Select a span and show its first frame."""
        self._labels.select((span.id,))
        self._playback.seek(span.start_s)

    # --- doing ----------------------------------------------------------------------------

    def _candidates(self) -> Iterable[Span]:
        return self._labels.selected or self._labels.labels.of_track(self._labels.track)

    def _ids(self) -> tuple[int, ...]:
        return tuple(span.id for span in self._labels.selected)

    def _end(self, mark: Mark, now_s: float) -> None:
        self._labels.set_marks(one for one in self._labels.marks if one != mark)
        self.apply(
            lambda labels, base: edits.create(
                labels, base, mark.track, mark.start_s, now_s, mark.label
            )
        )

    def apply(self, change: Change) -> bool:
        """Make an edit, one step in the history; False where it was refused.

        What a hand has dragged until then is a step before it.
        """
        if self._refused():
            return False
        self.end_drag()
        before = self._labels.labels
        try:
            done = change(before, self._playback.timebase)
        except Sd2Error as error:
            self.failed.emit(str(error))
            return False
        self._make(done, before)
        return True

    def _refused(self) -> bool:
        if self.refusal:
            self.failed.emit(self.refusal)
        return bool(self.refusal)

    def _make(self, done: Edit, before: Labels) -> None:
        if done.labels is not before:
            step = _Step(done.name, self._become, before, done.labels)
            step.redo()
            self._document.undo_stack.push(step)
        if done.ids:
            self._labels.select(done.ids)

    def _become(self, name: str, before: Labels, after: Labels) -> None:
        """The one way by which labels of a recording change: on disk first, then on screen."""
        recording = self._document.recording
        if recording is None or recording.labels is after:
            return
        self._session.keep(name, before, after)
        recording.labels = after
        self._labels.set_labels(after)
