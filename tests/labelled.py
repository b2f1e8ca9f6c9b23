"""Labels for tests: frames evenly and unevenly spaced, spans, and what must always hold."""

from __future__ import annotations

import random
from collections.abc import Callable
from itertools import combinations

import numpy as np

from sd2core.errors import Sd2Error
from sd2core.labels import field_edits
from sd2core.labels.edits import (
    Edit,
    Edits,
    merge,
)
from sd2core.labels.free_time import LabelledFrames
from sd2core.labels.spans import ORIGINS, Labels, LabelTrack, Span
from sd2core.timebase import Timebase

NAMES = ("left-to-right", "up-to-down", "background", "something else")


def uneven(seed: int, frames: int = 120) -> Timebase:
    """Frames at a rate that varies by a factor of ten, and starts anywhere."""
    rng = np.random.default_rng(seed)
    return Timebase(rng.uniform(-2, 2) + np.cumsum(rng.uniform(0.01, 0.1, frames)))


def even(frames: int = 120) -> Timebase:
    """30 frames per second."""
    return Timebase.regular(frames, 30.0)


def imported(timebase: Timebase, seed: int, count: int = 12) -> Labels:
    """Spans between frames, each holding one frame at least, on a track without overlaps."""
    rng = np.random.default_rng(seed)
    chosen = np.sort(rng.choice(len(timebase) - 1, 2 * count, replace=False))
    times_s = timebase.times_s
    steps_s = np.diff(times_s)
    before_s = times_s[chosen] - rng.uniform(0, 0.4, 2 * count) * steps_s[np.maximum(chosen - 1, 0)]
    edges_s = np.maximum(before_s, timebase.start_s).reshape(count, 2)
    spans = [
        Span(k + 1, "Imported", float(a), float(b), NAMES[k % 3], origin=ORIGINS[1 + k % 2])
        for k, (a, b) in enumerate(edges_s)
    ]
    tracks = (LabelTrack("Gestures"), LabelTrack("Imported"), LabelTrack("Free", "free"))
    return Labels(tracks, tuple(spans))


def many_spans(count: int) -> Labels:
    """One span a second, 0.8 s long, on frames of :func:`even`."""
    times_s = even(30 * count).times_s
    starts, ends = times_s[::30], times_s[24::30]
    return Labels(
        spans=tuple(
            Span(k + 1, "Gestures", float(a), float(b), NAMES[k % 3], author="A")
            for k, (a, b) in enumerate(zip(starts, ends, strict=True))
        )
    )


def random_edit(labels: Labels, timebase: Timebase, rng: random.Random) -> Edit:
    """Any edit with any arguments; what is refused leaves the labels as they were."""
    ids = [span.id for span in labels.spans]
    tracks = [track.name for track in labels.tracks]
    if not tracks:
        return field_edits.add_track(labels, "Gestures")
    span_id = rng.choice(ids) if ids else 1
    some = rng.sample(ids, min(len(ids), rng.randint(1, 3)))
    track, label = rng.choice(tracks), rng.choice(NAMES)

    def time_s() -> float:
        return rng.uniform(timebase.start_s - 0.5, timebase.end_s + 0.5)

    def near_s() -> float:
        return labels.span(span_id).start_s + rng.gauss(0, 0.4)

    side = rng.choice(("start", "end"))
    choices: list[Callable[[], Edit]] = [
        lambda: Edits(labels, timebase).create(track, time_s(), time_s(), label),
        lambda: Edits(labels, timebase).create(track, near_s(), near_s(), label),
        lambda: Edits(labels, timebase).overwrite(track, near_s(), near_s(), label),
        lambda: Edits(labels, timebase).duplicate([span_id], time_s()),
        lambda: field_edits.delete(labels, some),
        lambda: Edits(labels, timebase).resize(span_id, side, near_s()),
        lambda: Edits(labels, timebase).resize(span_id, side, time_s()),
        lambda: Edits(labels, timebase).move([span_id], span_id, near_s()),
        lambda: Edits(labels, timebase).move([span_id], span_id, time_s()),
        lambda: Edits(labels, timebase).nudge([span_id], rng.randint(-12, 12)),
        lambda: Edits(labels, timebase).move(some, span_id, near_s()),
        lambda: Edits(labels, timebase).nudge(some, rng.randint(-12, 12)),
        lambda: Edits(labels, timebase).duplicate(some, time_s()),
        lambda: Edits(labels, timebase).split(span_id, near_s()),
        lambda: merge(labels, some),
        lambda: Edits(labels, timebase).join_at(span_id, rng.choice(ids or [1]), near_s()),
        lambda: field_edits.change_spans(labels, some, label=label),
        lambda: field_edits.change_spans(labels, some, note=rng.choice(("", "blurred", "sure?"))),
        lambda: field_edits.change_spans(labels, some, confidence=rng.choice((None, 0.5, 1.0))),
        lambda: field_edits.change_spans(labels, some, author="C"),
        lambda: field_edits.change_spans(labels, some, track=track),
        lambda: field_edits.take(LabelledFrames(labels, timebase), some, track, label),
        lambda: field_edits.change_track(labels, track, overlap=rng.choice(("exclusive", "free"))),
        lambda: field_edits.move_track(labels, track, rng.randint(0, 2)),
        lambda: field_edits.change_track(labels, track, name=rng.choice(("Left", "Right", "Both"))),
        lambda: field_edits.change_label(labels, label, name=f"{label}'"),
        lambda: field_edits.add_label(labels, field_edits.new_label(labels.label_set)),
        lambda: field_edits.remove_label(labels, label, rng.choice((None, NAMES[0]))),
        lambda: field_edits.move_label(labels, label, rng.randint(0, 3)),
        lambda: field_edits.change_label(labels, label, colour=rng.choice(("#0072b2", "#332288"))),
        lambda: field_edits.change_label(labels, label, key=rng.choice(("", "1", "q", "Q"))),
    ]
    if rng.random() < 0.01:
        choices = [
            lambda: field_edits.remove_track(labels, track),
            lambda: Edits(labels, timebase).fill_gaps(track, label),
            lambda: field_edits.add_track(labels, f"Track {rng.random()}", rng.choice(("free",))),
        ]
    try:
        return rng.choice(choices)()
    except Sd2Error:
        return Edit("Refused", labels)


def broken_rules(labels: Labels, timebase: Timebase, placed_s: set[float]) -> list[str]:
    """What is wrong with labels; edges are of frames, or among ``placed_s`` (of imports)."""
    wrong = []
    edges = {*timebase.times_s.tolist(), timebase.end_s, *placed_s}
    keys = [(span.start_s, span.end_s, span.id) for span in labels.spans]
    if keys != sorted(keys) or len({key[2] for key in keys}) < len(keys):
        wrong.append("order or ids")
    free = {track.name for track in labels.tracks if track.overlap == "free"}
    for span in labels.spans:
        if not timebase.start_s <= span.start_s < span.end_s <= timebase.end_s:
            wrong.append(f"{span} is outside")
        if not ((span.start_s <= timebase.times_s) & (timebase.times_s < span.end_s)).any():
            wrong.append(f"{span} holds no frame")
        if not {span.start_s, span.end_s} <= edges:
            wrong.append(f"{span} is between frames")
    for one, other in combinations(labels.spans, 2):
        if one.track == other.track and one.track not in free and one.overlaps(other):
            wrong.append(f"{one} and {other} overlap")
    return wrong
