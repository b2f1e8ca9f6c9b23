"""Marking during playback: a key begins a span at the frame on screen, and ends it."""

from __future__ import annotations

from sd2app.labels.edits import LabelEdits
from sd2app.labels.model import Mark
from sd2app.settings import Settings
from sd2core.labels.edits import Edits
from sd2core.labels.free_time import LONGEST_REACTION_S, LabelledFrames

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
