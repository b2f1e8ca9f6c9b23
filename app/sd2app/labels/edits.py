"""Edits of labels by the user: each is applied first, then pushed to the undo history."""

from __future__ import annotations

from typing import Any, Literal

from PySide6.QtCore import QObject, Signal

from sd2app.labels.autosave import LabelAutosave
from sd2app.labels.model import LabelsModel
from sd2app.session.document import DocumentModel
from sd2app.session.playback import PlaybackModel
from sd2app.session.undo import Assign
from sd2core.errors import Sd2Error
from sd2core.labels import edits, field_edits
from sd2core.labels.comparison import changed_stretch
from sd2core.labels.edits import Change, Edit, Edits, Side
from sd2core.labels.free_time import NoRoom
from sd2core.labels.spans import Labels, Span
from sd2core.recording.divergence import State
from sd2core.recording.edited import decoded_fields
from sd2core.recording.recording import Recording


class LabelEdits(QObject):
    """Edits of labels by keys and menus.

    Mouse drags (:class:`sd2app.labels.dragging.LabelDragging`) and marking during playback
    (:class:`sd2app.labels.marking.LabelMarking`) also end here. Each edit is on disk when it is
    made (see :class:`sd2app.labels.autosave.LabelAutosave`). Times are frames of the clock.
    An impossible edit changes nothing, and ``failed`` says why, or ``had_no_room`` where other
    spans are in the way. ``applying`` is emitted before an
    edit, so that a drag in progress ends first; ``done_at`` after an edit, an undo or a redo, with
    the earliest start and latest end of changed spans; ``restoring`` with the other fields of the
    recording that are restored, or taken over, with the labels in the same step.
    """

    failed = Signal(str)
    had_no_room = Signal(str)
    applying = Signal()
    restoring = Signal(dict)
    done_at = Signal(float, float)

    def __init__(
        self,
        document: DocumentModel,
        labels: LabelsModel,
        playback: PlaybackModel,
        session: LabelAutosave,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self.labels, self.playback = labels, playback
        self.undo_stack = document.undo_stack
        self._document, self._session = document, session
        document.renamed.connect(self._rename)

    @property
    def refusal(self) -> str:
        """Reason why labels cannot be edited; empty where they can."""
        return self._session.refusal

    @property
    def recording(self) -> Recording | None:
        """The recording that is labelled."""
        return self._document.recording

    @property
    def persons(self) -> tuple[str, ...]:
        """Persons of the scene where there are several; none of one alone."""
        mesh = self._document.mesh
        return () if mesh is None or not mesh.others else mesh.persons

    # --- keys -----------------------------------------------------------------------------

    def relabel(self, label: str) -> None:
        """Give the selected spans another label."""
        self.labels.set_label(label)
        self.give("label", label)

    def give(self, field: Literal["label", "track", "person"], value: str) -> None:
        """Give the selected spans another label or track, or say whose they are (nobody's: "")."""
        ids = self._ids()
        self.apply(lambda now: field_edits.change_spans(now.labels, ids, **{field: value}))

    def _rename(self, names: dict[str, str]) -> None:
        """Call the persons whose spans are by their new names."""
        if any(span.person in names for span in self.labels.labels.spans):
            self.apply(lambda now: field_edits.rename_persons(now.labels, names))

    def edge_here(self, side: Side) -> None:
        """Put an edge of the selected span at the frame on screen."""
        chosen, base = self.labels.selected, self.playback.timebase
        if not chosen:
            return
        # The frame on screen is the first of the span, or its last.
        time_s = float(base.edges_s[self.playback.frame + (side == "end")])
        self.apply(lambda now: now.resize(chosen[0].id, side, time_s))

    def split(self) -> None:
        """Split the selected span, or the one on the track, at the frame on screen."""
        now_s, track = self._now_s, self.labels.track
        among = self.labels.selected or (self.labels.labels.of_track(track) if track else ())
        here = [span for span in among if span.start_s < now_s < span.end_s]
        if here:
            self.apply(lambda now: now.split(here[0].id, now_s))

    def delete(self) -> None:
        """Delete the selected spans."""
        if ids := self._ids():
            self.apply(lambda now: field_edits.delete(now.labels, ids))

    def merge(self) -> None:
        """Merge the selected spans."""
        ids = self._ids()
        self.apply(lambda now: edits.merge(now.labels, ids))

    def nudge(self, frames: int) -> None:
        """Move the selected spans together by some frames."""
        if ids := self._ids():
            self.apply(lambda now: now.nudge(ids, frames))

    def duplicate(self) -> None:
        """Copy the selected spans to the frame on screen; behind them where it is within them."""
        chosen = self.labels.selected
        if not chosen:
            return
        ids, now_s = self._ids(), self._now_s
        first_s, last_s = chosen[0].start_s, max(span.end_s for span in chosen)
        start_s = last_s if first_s <= now_s < last_s else now_s
        self.apply(lambda now: now.duplicate(ids, start_s))

    def meet(self) -> None:
        """Make the two selected neighbours meet at the frame on screen."""
        ids, now_s = self._ids(), self._now_s
        if len(ids) == 2:
            self.apply(lambda now: now.join_at(*ids, now_s))

    def fill_gaps(self) -> None:
        """Fill every gap of the track with a span of background."""
        track, offered = self.labels.track, self.labels.labels.label_set.labels
        if track:
            named = (one.name for one in offered if one.gesture_class == "background")
            label = next(named, self.labels.label)
            self.apply(lambda now: now.fill_gaps(track, label))

    def restore(self) -> None:
        """Take over what an earlier session left unsaved, as one step."""
        recording, offer = self._document.recording, self._session.offer
        if recording is None or offer is None or self.refused():
            return
        others: dict[str, Any] = {}
        if offer.others is not None and self._session.changed_others(offer):
            try:
                others = decoded_fields(offer.others)
            except Sd2Error as error:
                self.failed.emit(str(error))
        self.applying.emit()
        before, first = self.labels.labels, recording.labels is None
        recording.labels = self._session.take_offer()  # on disk already, as a session of its own
        self.labels.set_labels(recording.labels)
        name = "Restore edits" if others else "Restore labels"
        self._make_with(name, before, recording.labels, others, first)

    def take_state(self, name: str, state: State) -> None:
        """Take over labels and settings that were saved elsewhere, as one step."""
        recording = self._document.recording
        if recording is None:
            return
        self.applying.emit()
        before, now = self.labels.labels, recording.state()
        after = before if state.labels == now.labels else state.labels
        others = {one: value for one, value in state.settings.items() if value != now.settings[one]}
        if others or after is not before:
            self._make_with(name, before, after, others)

    def _make_with(
        self, name: str, before: Labels, after: Labels, others: dict[str, Any], first: bool = False
    ) -> None:
        """Make one step of an edit of labels and of other fields."""
        self.undo_stack.beginMacro(name)
        self.make(Edit(name, after), before, first=first)
        if others:
            self.restoring.emit(others)
        self.undo_stack.endMacro()

    # --- finding one's way ----------------------------------------------------------------

    def step(self, towards: Literal[-1, 1]) -> None:
        """Select the next span of the track, or the one before, and go to its start."""
        chosen = self.labels.selected
        track = chosen[0].track if chosen else self.labels.track
        spans = self.labels.labels.of_track(track) if track else ()
        from_s = chosen[0].start_s if chosen else self._now_s
        ahead = [one for one in spans if (one.start_s - from_s) * towards > 0]
        if ahead:
            self.go_to(ahead[0 if towards > 0 else -1])

    def go_to(self, span: Span) -> None:
        """Select a span and show its first frame."""
        self.labels.select((span.id,))
        self.playback.seek(span.start_s)

    # --- doing ----------------------------------------------------------------------------

    @property
    def _now_s(self) -> float:
        return self.playback.timebase.time_of(self.playback.frame)

    def _ids(self) -> tuple[int, ...]:
        return tuple(span.id for span in self.labels.selected)

    def apply(self, change: Change) -> bool:
        """Make an edit, one step in the history; False where it was refused.

        A drag in progress becomes a step before it.
        """
        if self.refused():
            return False
        self.applying.emit()
        before = self.labels.labels
        try:
            done = change(Edits(before, self.playback.timebase))
        except NoRoom as error:
            self.had_no_room.emit(str(error))
            return False
        except Sd2Error as error:
            self.failed.emit(str(error))
            return False
        self.make(done, before)
        return True

    def refused(self) -> bool:
        """True if labels cannot be edited; ``failed`` says why."""
        if self.refusal:
            self.failed.emit(self.refusal)
        return bool(self.refusal)

    def make(self, done: Edit, before: Labels, *, first: bool = False) -> None:
        """Apply a computed edit as one step in the history.

        ``first`` of a recording that was not labelled before, and is not once it is undone.
        """
        if done.labels is not before:
            recording = self._document.recording
            first = first or (recording is not None and recording.labels is None)
            forward = done.name, before, done.labels, False
            back = f"Undo {done.name.lower()}", done.labels, before, first
            step = Assign(done.name, lambda change: self._become(*change), back, forward)
            step.redo()
            self.undo_stack.push(step)
        if done.ids:
            self.labels.select(done.ids)

    def _become(self, name: str, before: Labels, after: Labels, unlabel: bool) -> None:
        """Change the labels: the only place that does, on disk first, then on screen."""
        recording = self._document.recording
        if recording is None or recording.labels is after:
            return
        self._session.keep(name, before, after)
        recording.labels = after
        if unlabel:
            recording.unlabel()
        self.labels.set_labels(after)
        if (stretch := changed_stretch(before, after)) is not None:
            self.done_at.emit(*stretch)
