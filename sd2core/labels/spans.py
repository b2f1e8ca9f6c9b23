"""Labelled spans, their tracks, and all labels of one recording."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field, replace
from operator import attrgetter
from typing import Literal

from sd2core.errors import Sd2Error
from sd2core.files.recording_json import FARTHEST_S
from sd2core.labels.label_set import GESTURES, LabelSet, check_name, check_text
from sd2core.timebase import Timebase

Origin = Literal["person", "suggestion", "import"]
Overlap = Literal["exclusive", "free"]

ORIGINS: tuple[Origin, ...] = ("person", "suggestion", "import")
OVERLAPS: tuple[Overlap, ...] = ("exclusive", "free")

LARGEST_ID = 2**53 - 1
"""Largest number that a float, and so any program that reads JSON, tells from the next one."""
_IN_ORDER = attrgetter("start_s", "end_s", "id")


@dataclass(frozen=True)
class ShownFrames:
    """Frames on screen during a span, as people read them: both ends are among them."""

    first: int
    last: int
    count: int

    def words(self) -> str:
        """First and last frame and their number, as in "48–83 (36)"."""
        return f"{self.first}–{self.last} ({self.count})"


@dataclass(frozen=True)
class Span:
    """Labelled interval of time, half-open: ``[start_s, end_s)``.

    Parameters
    ----------
    id : int
        1 to :data:`LARGEST_ID`; unique within the labels of a recording, and kept by edits.
    track : str
        Name of a :class:`LabelTrack`.
    start_s, end_s : float
        On the clock of the recording; ``start_s < end_s``.
    label : str
        Usually one of the label set; others are shown in grey.
    confidence : float, optional
        0 to 1.
    person : str
        Who of a scene of several does it; empty where that is not told.
    """

    id: int
    track: str
    start_s: float
    end_s: float
    label: str
    note: str = ""
    author: str = ""
    confidence: float | None = None
    origin: Origin = "person"
    person: str = ""

    def __post_init__(self) -> None:
        whole = isinstance(self.id, int) and not isinstance(self.id, bool)
        if not whole or not 1 <= self.id <= LARGEST_ID:
            raise Sd2Error(
                f"The id of a span is {self.id!r:.40}", f"a whole number from 1 to {LARGEST_ID}"
            )
        check_name(self.label, "label")
        check_name(self.track, "track")
        check_text(self.note, "note of a span")
        check_text(self.author, "author of a span")
        if self.person:
            check_name(self.person, "person")
        if not (abs(self.start_s) <= FARTHEST_S and abs(self.end_s) <= FARTHEST_S):
            raise Sd2Error(
                f"{self.words()} is not in time", f"finite times in seconds, up to {FARTHEST_S:g}"
            )
        if not self.start_s < self.end_s:
            raise Sd2Error(f"{self.words()} ends before it has begun", "a start before the end")
        known = self.confidence
        if known is not None and not 0.0 <= known <= 1.0:
            raise Sd2Error(f"{self.words()} has the confidence {known!r}", "0 to 1")
        if self.origin not in ORIGINS:
            raise Sd2Error(
                f"{self.words()} is of origin {self.origin!r}", f"one of {', '.join(ORIGINS)}"
            )

    @property
    def duration_s(self) -> float:
        """End less start."""
        return self.end_s - self.start_s

    def overlaps(self, other: Span) -> bool:
        """True if the two spans share some instant; spans that only touch do not."""
        return self.start_s < other.end_s and other.start_s < self.end_s

    def frames(self, timebase: Timebase | None) -> ShownFrames | None:
        """Return the frames on screen; None where there are none or their times are not known."""
        first, stop = (
            (0, 0) if timebase is None else timebase.frames_between(self.start_s, self.end_s)
        )
        if timebase is None or stop <= first:
            return None
        number = first + timebase.first_number
        return ShownFrames(number, number + stop - first - 1, stop - first)

    def words(self) -> str:
        """Name of the span in a sentence."""
        return f"Span {self.id} ({self.label!r}, {self.start_s:g} to {self.end_s:g} s)"


@dataclass(frozen=True)
class LabelTrack:
    """Row of spans; on an ``"exclusive"`` one they do not overlap."""

    name: str
    overlap: Overlap = "exclusive"

    def __post_init__(self) -> None:
        check_name(self.name, "track")
        if self.overlap not in OVERLAPS:
            raise Sd2Error(
                f"The track {self.name!r} has the overlap {self.overlap!r}",
                f"one of {', '.join(OVERLAPS)}",
            )


@dataclass(frozen=True)
class Labels:
    """All labels of one recording.

    Parameters
    ----------
    tracks : tuple of LabelTrack
        From top to bottom; names differ.
    spans : tuple of Span
        Kept in the order of start, end and id. Each is on one of the tracks, ids differ,
        and on an exclusive track no two overlap.

    Raises
    ------
    Sd2Error
        When any of this does not hold; the message names the spans.
    """

    tracks: tuple[LabelTrack, ...] = (LabelTrack("Gestures"),)
    spans: tuple[Span, ...] = ()
    label_set: LabelSet = field(default=GESTURES)

    def __post_init__(self) -> None:
        object.__setattr__(self, "tracks", tuple(self.tracks))
        ordered = tuple(sorted(self.spans, key=_IN_ORDER))
        object.__setattr__(self, "spans", ordered)
        names = [track.name for track in self.tracks]
        if len(set(names)) < len(names):
            raise Sd2Error(f"Tracks are called {', '.join(names)}", "a name of its own for each")
        if len({span.id for span in ordered}) < len(ordered):
            raise Sd2Error("Two spans have the same id", "an id of its own for each")
        last: dict[str, Span | None] = {
            track.name: None for track in self.tracks if track.overlap == "exclusive"
        }
        # Ten thousand spans pass here at every edit: nothing is called for one that is right.
        for span in ordered:
            if span.track in last:
                before = last[span.track]
                if before is not None and span.start_s < before.end_s:
                    raise Sd2Error(
                        f"{before.words()} and {span.words()} overlap on {span.track!r}",
                        "spans apart from each other on an exclusive track",
                    )
                last[span.track] = span
            elif span.track not in names:
                raise Sd2Error(
                    f"{span.words()} is on the track {span.track!r}", f"one of {', '.join(names)}"
                )

    def __repr__(self) -> str:
        counts = Counter(span.label for span in self.spans)
        named = ", ".join(f"{label} {count:,}" for label, count in counts.most_common(6))
        more = f" and {len(counts) - 6} other labels" if len(counts) > 6 else ""
        tracks = ", ".join(track.name for track in self.tracks)
        return f"<Labels {len(self.spans):,} spans on {tracks}: {named or 'none'}{more}>"

    @property
    def next_id(self) -> int:
        """Smallest id above those in use."""
        return max((span.id for span in self.spans), default=0) + 1

    @property
    def decided(self) -> tuple[Span, ...]:
        """All spans but suggestions, which are no labels until they are accepted."""
        return tuple(span for span in self.spans if span.origin != "suggestion")

    @property
    def persons(self) -> tuple[str, ...]:
        """Persons whom spans name; suggestions do not count."""
        return tuple(dict.fromkeys(span.person for span in self.decided if span.person))

    def of_person(self, person: str) -> Labels:
        """Return those of a person, and those that name nobody: these hold for everybody."""
        return replace(self, spans=tuple(one for one in self.spans if one.person in ("", person)))

    def of_track(self, name: str) -> tuple[Span, ...]:
        """Return the spans of one track, in order."""
        return tuple(span for span in self.spans if span.track == name)

    def span(self, span_id: int) -> Span:
        """Return the span of an id; it must exist."""
        for span in self.spans:
            if span.id == span_id:
                return span
        raise Sd2Error(f"No span has the id {span_id}", f"one of the {len(self.spans)} spans")

    def these(self, ids: Iterable[int]) -> list[Span]:
        """Return the spans of some ids, in order; they must exist."""
        wanted = set(ids)
        spans = [span for span in self.spans if span.id in wanted]
        for missing in wanted.difference(span.id for span in spans):
            self.span(missing)
        return spans

    def track(self, name: str) -> LabelTrack:
        """Return the track of a name; it must exist."""
        for track in self.tracks:
            if track.name == name:
                return track
        known = ", ".join(one.name for one in self.tracks)
        raise Sd2Error(f"No track is called {name!r}", f"one of {known}" if known else "a track")

    def shifted(self, offset_s: float) -> Labels:
        """Return the same labels ``offset_s`` later."""
        moved = (
            replace(span, start_s=span.start_s + offset_s, end_s=span.end_s + offset_s)
            for span in self.spans
        )
        return replace(self, spans=tuple(moved))

    def with_spans(self, changed: Iterable[Span] = (), without: Collection[int] = ()) -> Labels:
        """Return the same labels with spans replaced by id, added or removed.

        Without any change these very labels are returned.
        """
        put = {span.id: span for span in changed}
        kept = [put.pop(one.id, one) for one in self.spans if one.id not in without]
        spans = (*kept, *put.values())
        return self if spans == self.spans else replace(self, spans=spans)
