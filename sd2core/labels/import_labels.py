"""Import of labels from a file into a recording, cut to the recording's time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Literal

from sd2core.errors import Sd2Error
from sd2core.labels.edits import Edit
from sd2core.labels.free_time import LabelledFrames
from sd2core.labels.label_set import GESTURES, LONGEST_NAME, LabelSet, with_own_keys
from sd2core.labels.spans import Labels, Span
from sd2core.timebase import Timebase

Way = Literal["replace", "add"]
"""Instead of the labels that are there, or on tracks of their own below them."""


@dataclass(frozen=True)
class Incoming:
    """Labels of a file, fitted to a recording."""

    labels: Labels  # Labels to import: inside the recording, each span with at least one frame.
    # Spans of the file that reach beyond the recording and are cut at its ends.
    cut: tuple[Span, ...] = ()
    # Spans of the file without a frame of the recording, which are left out.
    outside: tuple[Span, ...] = ()

    @classmethod
    def of(cls, labels: Labels, timebase: Timebase) -> Incoming:
        """Fit labels of a file to the frames of a recording.

        Edges inside the recording stay where the file has them, on a frame or not.
        """
        frames = LabelledFrames(labels, timebase)
        low_s, high_s = frames.whole
        kept, cut, outside = [], [], []
        for span in labels.spans:
            start_s, end_s = max(span.start_s, low_s), min(span.end_s, high_s)
            within = (start_s, end_s) == (span.start_s, span.end_s)
            # One that lies between two frames is nothing to look at, but it is there.
            if within or frames.held(start_s, end_s):
                kept.append(span if within else replace(span, start_s=start_s, end_s=end_s))
                if not within:
                    cut.append(span)
            else:
                outside.append(span)
        return cls(replace(labels, spans=tuple(kept)), tuple(cut), tuple(outside))

    def refusal(self, way: Way) -> str:
        """Why nothing can be taken in; empty where something can, or all labels are to go."""
        if self.labels.spans or (way == "replace" and not self.outside):
            return ""
        return f"no spans{' within the recording' if self.outside else ''}"

    def unknown(self, label_set: LabelSet) -> dict[str, int]:
        """Count the spans of each label that a set does not have."""
        counts = Counter(span.label for span in self.labels.spans)
        return {name: count for name, count in counts.items() if label_set.find(name) is None}

    def set_after(self, label_set: LabelSet, way: Way) -> LabelSet:
        """Return the label set of a recording after :meth:`take_into`.

        Adding brings those labels that only the file has.
        """
        theirs = self.labels.label_set
        if way == "replace":
            # A file that says nothing of labels is read with the default set.
            return theirs if theirs != GESTURES else label_set
        brought = (theirs.find(name) for name in self.unknown(label_set))
        added = with_own_keys(
            (one for one in brought if one is not None), (one.key for one in label_set.labels)
        )
        return replace(label_set, labels=(*label_set.labels, *added)) if added else label_set

    def take_into(self, labels: Labels, way: Way, source: str) -> Edit:
        """Import the labels of a file (``source``) into a recording.

        Replacing takes the tracks, spans and numbers of the file, and its label set where it brings
        one of its own. Adding leaves all that is there: the file's tracks come below it, with its
        name where theirs are taken, and what the file says of labels that the set does not have is
        added to the set. Raises Sd2Error when the file has no spans in the recording; one without
        any may replace all labels.
        """
        brought = self.labels
        if refusal := self.refusal(way):
            raise Sd2Error(f"{source} holds {refusal}", "at least one, to take it in")
        name = f"Import {len(brought.spans)} span{'s' * (len(brought.spans) != 1)}"
        label_set = self.set_after(labels.label_set, way)
        if way == "replace":
            after = replace(brought, label_set=label_set)
            return Edit(name, labels if after == labels else after)
        names = {track.name for track in labels.tracks}
        called: dict[str, str] = {}
        tracks = []
        for track in brought.tracks:
            if brought.of_track(track.name):
                called[track.name] = free_name(track.name, source, names)
                names.add(called[track.name])
                tracks.append(replace(track, name=called[track.name]))
        first = labels.next_id
        spans = [
            replace(span, id=first + number, track=called[span.track])
            for number, span in enumerate(brought.spans)
        ]
        after = Labels((*labels.tracks, *tracks), (*labels.spans, *spans), label_set)
        return Edit(name, after, tuple(span.id for span in spans))


def free_name(name: str, source: str, taken: Collection[str]) -> str:
    """Return a track name that is not in use: itself, with the source, or with a number as well."""
    if name not in taken:
        return name
    shown = "".join(one if one.isprintable() else " " for one in source).strip() or "import"
    number = 1
    while True:
        more = f" ({shown[: LONGEST_NAME // 2]}{'' if number == 1 else f', {number}'})"
        free = name[: LONGEST_NAME - len(more)] + more
        if free not in taken:
            return free
        number += 1
