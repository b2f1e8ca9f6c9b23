"""Edits of the tracks of labels, each one step in the history."""

from __future__ import annotations

from typing import Literal

from sd2app.labels.edits import LabelEdits
from sd2app.labels.model import LabelsModel
from sd2core.labels import field_edits
from sd2core.labels.spans import Overlap


class LabelTracks:
    """Edits of the track for new spans, and the choice of it."""

    def __init__(self, labels: LabelsModel, edits: LabelEdits) -> None:
        self._labels, self._edits = labels, edits

    @property
    def free(self) -> bool:
        """True if spans of the track may overlap."""
        track = self._labels.track
        return bool(track) and self._labels.labels.track(track).overlap == "free"

    @property
    def new_name(self) -> str:
        """Name that no track has."""
        taken = {track.name for track in self._labels.labels.tracks}
        names = (f"Track {number}" for number in range(len(taken) + 1, 2 * len(taken) + 3))
        return next(name for name in names if name not in taken)

    def step(self, towards: Literal[-1, 1]) -> None:
        """Make the next or the previous track the one for new spans."""
        names, place = self._names, self._place + towards
        if 0 <= place < len(names):
            self._labels.set_track(names[place])

    def add(self, name: str, overlap: Overlap) -> bool:
        """Add a track for new spans; False where it was refused."""
        done = self._edits.apply(lambda labels, _: field_edits.add_track(labels, name, overlap))
        if done:
            self._labels.set_track(name)
        return done

    def rename(self, name: str) -> bool:
        """Rename the track; False where it was refused."""
        old = self._labels.track
        done = self._edits.apply(lambda labels, _: field_edits.rename_track(labels, old, name))
        if done:
            self._labels.set_track(name)
        return done

    def remove(self) -> bool:
        """Remove the track with its spans; False where it was refused."""
        gone = self._labels.track
        return self._edits.apply(lambda labels, _: field_edits.remove_track(labels, gone))

    def move(self, towards: Literal[-1, 1]) -> None:
        """Move the track up or down."""
        track, place = self._labels.track, self._place + towards
        if 0 <= place < len(self._names):
            self._edits.apply(lambda labels, _: field_edits.move_track(labels, track, place))

    def toggle_overlap(self) -> None:
        """Allow or forbid that spans of the track overlap."""
        track = self._labels.track
        overlap: Overlap = "exclusive" if self.free else "free"
        self._edits.apply(lambda labels, _: field_edits.set_overlap(labels, track, overlap))

    def put_spans(self, towards: Literal[-1, 1]) -> None:
        """Move the selected spans to the track below or above."""
        names, chosen = self._names, self._labels.selected
        place = names.index(chosen[0].track) + towards if chosen else -1
        if 0 <= place < len(names):
            ids = [span.id for span in chosen]
            self._edits.apply(lambda labels, _: field_edits.set_track(labels, ids, names[place]))
            self._labels.set_track(self._labels.selected[0].track)

    @property
    def _names(self) -> list[str]:
        return [track.name for track in self._labels.labels.tracks]

    @property
    def _place(self) -> int:
        return self._names.index(self._labels.track) if self._labels.track else -1
