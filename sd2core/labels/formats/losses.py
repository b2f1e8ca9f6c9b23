"""Capabilities of label formats, and the losses of writing given labels to them."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, replace
from typing import Literal, get_args

from sd2core.files.tables import counted
from sd2core.labels.label_set import GESTURES
from sd2core.labels.spans import Labels, LabelTrack, Span

Aspect = Literal[
    "tracks", "overlap", "empty tracks", "ids", "notes", "authors", "confidence", "origin",
    "persons", "label set", "colours and keys",
]  # fmt: skip

ASPECTS: tuple[Aspect, ...] = get_args(Aspect)
"""All that a file may hold besides start, end and label of each span."""

DEFAULT_TRACK = "Gestures"
"""The track of spans from a file that has no tracks."""


@dataclass(frozen=True)
class LabelFormat:
    """Description of a label format."""

    name: str  # Name in code and on the command line.
    title: str  # Name on screen.
    suffixes: tuple[str, ...]  # Lower case, with the dot; the first is the usual one.
    made_for: str  # Programs that open it, with the version of the format.
    keeps: frozenset[Aspect]  # Aspects that it holds besides start, end and label of each span.
    resolution_s: float = 0.0  # Smallest step between times; 0 where they are kept exactly.
    remark: str = ""  # A sentence on anything else to know; may be empty.


@dataclass(frozen=True)
class Loss:
    """Loss of a part of the labels in a file."""

    what: str  # An :data:`Aspect`, or ``"times"``, ``"characters"`` or ``"spans"``.
    count: int  # Number of spans, tracks or sets concerned.
    sentence: str  # The same for readers.

    def __str__(self) -> str:
        return self.sentence


def losses_by_format(labels: Labels, file_format: LabelFormat) -> list[Loss]:
    """List the losses of these labels in a file of a format."""
    title = file_format.title
    losses: list[Loss] = []

    def leave_out(what: Aspect, count: int, sentence: str) -> None:
        if count and what not in file_format.keeps:
            losses.append(Loss(what, count, sentence))

    names = {track.name for track in labels.tracks}
    if names != {DEFAULT_TRACK}:
        become = f"{len(names)} tracks become one" if len(names) > 1 else "its name is left out"
        leave_out("tracks", len(names), f"{title} keeps no tracks: {become}")
    if "tracks" in file_format.keeps and labels.tracks != (LabelTrack(DEFAULT_TRACK),):
        empty = sum(not labels.of_track(track.name) for track in labels.tracks)
        words = f"{title} keeps no tracks without spans: {counted(empty, 'track')} left out"
        leave_out("empty tracks", empty, words)
    apart = sum(track.overlap == "free" for track in labels.tracks)
    words = f"{title} does not say whether spans may overlap: {counted(apart, 'free track')}"
    leave_out("overlap", apart, f"{words} may come back as exclusive")
    # Files with a part for each track bring spans of one time back in the order of the tracks.
    place = {track.name: number for number, track in enumerate(labels.tracks)}
    by_track = sorted(labels.spans, key=lambda one: (one.start_s, one.end_s, place[one.track]))
    count = sum(
        one.id != number or other.id != number
        for number, (one, other) in enumerate(zip(labels.spans, by_track, strict=True), start=1)
    )
    words = f"{title} keeps no numbers of spans: {counted(count, 'span')} renumbered"
    leave_out("ids", count, words)
    found = Counter(name for span in labels.spans for name in details_of(span))
    fields: tuple[tuple[Aspect, str, str], ...] = (
        ("notes", "note", "keeps no notes: {} left out"),
        ("authors", "author", "keeps no authors: those of {} left out"),
        ("confidence", "confidence", "keeps no confidence: that of {} left out"),
        ("origin", "origin", "does not say who made a span: {} will count as imported"),
        ("persons", "person", "keeps no persons: those of {} left out"),
    )
    for what, name, sentence in fields:
        things = counted(found[name], "note" if name == "note" else "span")
        leave_out(what, found[name], f"{title} {sentence.format(things)}")
    if labels.label_set != GESTURES:
        name = labels.label_set.name
        if "label set" not in file_format.keeps:
            leave_out("label set", 1, f"{title} keeps no label set: {name!r} left out")
        else:
            words = f"{title} keeps no colours and keys: those of the set {name!r} left out"
            leave_out("colours and keys", len(labels.label_set.labels), words)
    return losses


def details_of(span: Span) -> dict[str, str | float]:
    """What a span holds besides its number, track, times and label, by the names of its fields."""
    details = {
        "note": span.note,
        "author": span.author,
        "confidence": "" if span.confidence is None else float(span.confidence),
        "origin": "" if span.origin == "import" else span.origin,
        "person": span.person,
    }
    return {name: value for name, value in details.items() if value != ""}


def hold_texts(labels: Labels, banned: re.Pattern[str], title: str) -> tuple[Labels, list[Loss]]:
    """Replace characters in notes and authors that a format cannot hold; names have none."""

    def held(text: str) -> str:
        return banned.sub("\N{REPLACEMENT CHARACTER}", text)

    spans = tuple(
        replace(span, note=held(span.note), author=held(span.author)) for span in labels.spans
    )
    count = sum(a != b for a, b in zip(spans, labels.spans, strict=True))
    if not count:
        return labels, []
    where = counted(count, "note or author", "notes or authors")
    words = f"{title} cannot hold control characters: replaced in {where}"
    return replace(labels, spans=spans), [Loss("characters", count, words)]
