"""Edits of labels by the user, and marking while it plays: applied first, then in the history."""

from __future__ import annotations

from typing import Any, Literal

from PySide6.QtCore import QObject, Signal

from sd2app.labels.autosave import LabelAutosave
from sd2app.labels.model import LabelsModel, Mark
from sd2app.session.document import DocumentModel
from sd2app.session.playback import PlaybackModel
from sd2app.session.undo import Edits as History
from sd2app.settings import Settings
from sd2core.errors import Sd2Error
from sd2core.labels import edits, field_edits
from sd2core.labels.edits import Change, Edit, Edits, Side
from sd2core.labels.free_time import LONGEST_REACTION_S, LabelledFrames, NoRoom
from sd2core.labels.spans import Labels, Span
from sd2core.recording.divergence import State
from sd2core.recording.edited import decoded_fields
from sd2core.recording.recording import Recording


class LabelEdits(QObject):
    """Edits of labels by keys and menus.

    Mouse drags (:class:`sd2app.labels.dragging.LabelDragging`) and marking during playback
    (:class:`sd2app.labels.edits.LabelMarking`) also end here. Each edit is on disk when it is
    made (see :class:`sd2app.labels.autosave.LabelAutosave`). Times are frames of the clock.
    An impossible edit changes nothing, and ``failed`` says why, or ``had_no_room`` where other
    spans are in the way. ``applying`` is emitted before an edit, so that a drag in progress ends
    first.
    """

    failed = Signal(str)
    had_no_room = Signal(str)
    applying = Signal()

    def __init__(
        self,
        document: DocumentModel,
        labels: LabelsModel,
        playback: PlaybackModel,
        session: LabelAutosave,
        history: History,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self.labels, self.playback = labels, playback
        self.undo_stack = document.undo_stack
        self._document, self._session, self._history = document, session, history
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
        chosen, ids, now_s = self.labels.selected, self._ids(), self._now_s
        if not chosen:
            return
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
        offer = self._session.offer
        if offer is None or self.refused():
            return
        others: dict[str, Any] = {}
        if offer.others is not None and self._session.changed_others(offer):
            try:
                others = decoded_fields(offer.others)
            except Sd2Error as error:
                self.failed.emit(str(error))
        self.applying.emit()
        labels = self._session.take_offer()  # on disk already, as a session of its own
        self._make_with("Restore edits" if others else "Restore labels", labels, others)

    def take_state(self, name: str, state: State) -> None:
        """Take over labels and settings that were saved elsewhere, as one step."""
        recording = self._document.recording
        assert recording is not None
        self.applying.emit()
        now = recording.state()
        others = {one: value for one, value in state.settings.items() if value != now.settings[one]}
        if others or state.labels != now.labels:
            self._make_with(name, state.labels, others)

    def _make_with(self, name: str, labels: Labels, others: dict[str, Any]) -> None:
        """Make one step of an edit of labels and of other fields."""
        self.undo_stack.beginMacro(name)
        self._history.set_labels(name, labels)
        self._history.restore(others)
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
        try:
            done = change(Edits(self.labels.labels, self.playback.timebase))
        except NoRoom as error:
            self.had_no_room.emit(str(error))
            return False
        except Sd2Error as error:
            self.failed.emit(str(error))
            return False
        self.make(done)
        return True

    def refused(self) -> bool:
        """True if labels cannot be edited; ``failed`` says why."""
        if self.refusal:
            self.failed.emit(self.refusal)
        return bool(self.refusal)

    def make(self, done: Edit) -> None:
        """Apply a computed edit as one step in the history."""
        self._history.set_labels(done.name, done.labels)
        if done.ids:
            self.labels.select(done.ids)


LONGEST_MS = round(1000 * LONGEST_REACTION_S)
REACTION = "reaction_ms"
"""Name of the reaction time in the settings."""

_NO_TRACK = "There is no track to mark on. Add one: Labels → Add track…"


def reaction_ms(settings: Settings) -> int:
    """Reaction time of the user, 0 to :data:`LONGEST_MS`; marks are put back by it."""
    return min(max(settings.stored(REACTION, 0), 0), LONGEST_MS)


class LabelMarking:
    """Begins and ends marks, at the frame on screen or, while playing, the reaction time earlier.

    The reaction time is real time: played at half speed, half as much of the recording goes by.
    """

    def __init__(self, edits: LabelEdits, settings: Settings) -> None:
        self._labels, self._playback, self._edits = edits.labels, edits.playback, edits
        self._settings = settings
        self._made: frozenset[int] = frozenset()  # the span that ended last, selected since then
        self._labels.selection_changed.connect(self._forget)

    @property
    def left_behind(self) -> bool:
        """True while the span that ended last is selected, but is not on screen."""
        chosen, playback = self._labels.selected, self._playback
        if not self._made or len(chosen) != 1:
            return False
        first, stop = playback.timebase.frames_between(chosen[0].start_s, chosen[0].end_s)
        return not first <= playback.frame <= stop

    def mark(self, label: str) -> None:
        """Begin a span with this label, or end the one that has begun.

        On an exclusive track this also ends other marks.
        """
        track = self._labels.track
        if self._edits.refused():
            return
        if not track:
            self._edits.failed.emit(_NO_TRACK)
            return
        self._labels.set_label(label)
        seen_s = self._seen_s(track)
        exclusive = self._labels.labels.track(track).overlap == "exclusive"
        ended = [
            mark
            for mark in self._labels.marks
            if mark.track == track and (mark.label == label or exclusive)
        ]
        for mark in ended:
            self._end(mark, seen_s)
        if not any(mark.label == label for mark in ended):
            # What has just ended may reach further than what was seen.
            seen_s = self._seen_s(track)
            self._labels.set_marks((*self._labels.marks, Mark(track, label, seen_s)))

    def end_marks(self, *, cutting: bool = False) -> None:
        """End all marks; ``cutting`` cuts away other spans of the track there."""
        for mark in self._labels.marks:
            self._end(mark, self._seen_s(mark.track), cutting=cutting)

    def _seen_s(self, track: str) -> float:
        playback = self._playback
        now_s = playback.timebase.time_of(playback.frame)
        reaction_s = (
            1e-3 * reaction_ms(self._settings) * playback.speed if playback.playing else 0.0
        )
        now = LabelledFrames(self._labels.labels, playback.timebase)
        return now.seen_at(track, now_s, reaction_s)

    def _end(self, mark: Mark, seen_s: float, *, cutting: bool = False) -> None:
        self._labels.set_marks(one for one in self._labels.marks if one != mark)
        make = Edits.overwrite if cutting else Edits.create
        # A reaction does not end what had not begun; going back and ending it there does.
        went_back = self._playback.time_s < mark.start_s
        end_s = seen_s if went_back else max(mark.start_s, seen_s)
        made = self._edits.apply(lambda now: make(now, mark.track, mark.start_s, end_s, mark.label))
        self._made = self._labels.selected_ids if made else frozenset()

    def _forget(self) -> None:
        self._made = frozenset()
