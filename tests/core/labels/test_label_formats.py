"""What every format promises: what it can hold comes back, and what it cannot is said."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from any_labels import any_labels, finite_times_s, milliseconds_s
from hypothesis import HealthCheck, given, settings

from sd2core.labels.formats import (
    FORMATS,
    Loss,
    read_labels,
    write_labels,
)
from sd2core.labels.formats.losses import Aspect
from sd2core.labels.label_set import GESTURES, Label, LabelSet
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.timebase import Timebase

TIMEBASE = Timebase.regular(300, 30.0)
few = settings(max_examples=15, suppress_health_check=[HealthCheck.too_slow])
by_format = pytest.mark.parametrize("name", [one.name for one in FORMATS])
KEEPS = {one.name: one.keeps for one in FORMATS}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("labels")


def there_and_back(folder: Path, name: str, labels: Labels) -> tuple[Labels, list[Loss]]:
    path = folder / f"labels.{name}"
    losses = write_labels(path, labels, TIMEBASE, name)
    return read_labels(path, format=name), losses


def to_a_nanosecond(back: Labels, labels: Labels) -> Labels:
    """With the times as they were, from which these differ by less than anybody means."""
    before = {span.id: span for span in labels.spans}
    spans = []
    for span in back.spans:
        start_s, end_s = before[span.id].start_s, before[span.id].end_s
        assert span.start_s == pytest.approx(start_s, rel=0, abs=1e-9)
        assert span.end_s == pytest.approx(end_s, rel=0, abs=1e-9)
        spans.append(replace(span, start_s=start_s, end_s=end_s))
    return Labels(back.tracks, tuple(spans), back.label_set)


@by_format
@pytest.mark.parametrize("rate_hz", [24.0, 25.0, 30000 / 1001, 30.0, 1000.0])
@pytest.mark.parametrize("start_s", [0.0, 0.0123])
def test_beside_its_recording_a_span_is_on_the_frames_that_it_was_on(
    folder: Path, name: str, rate_hz: float, start_s: float
) -> None:
    clock = Timebase.regular(200, rate_hz, start_s)
    edges_s = clock.edges_s.tolist()
    spans = [Span(k + 1, "t", edges_s[4 * k], edges_s[4 * k + 3], "x") for k in range(50)]
    path = folder / f"on-frames.{name}"
    write_labels(path, Labels((LabelTrack("t"),), tuple(spans)), clock, name)
    back = read_labels(path, clock, name)
    found, there = ([(one.start_s, one.end_s) for one in some] for some in (back.spans, spans))
    np.testing.assert_allclose(found, there, rtol=0, atol=1e-6)


def crowded(spans: list[Span]) -> bool:
    return any(a.overlaps(b) for a in spans for b in spans if a is not b)


def surviving(labels: Labels, keeps: frozenset[Aspect]) -> Labels:
    """The labels without what is not kept, as the documentation says that they come back."""
    spans = [
        replace(
            span,
            id=span.id if "ids" in keeps else number,
            track=span.track if "tracks" in keeps else "Gestures",
            note=span.note if "notes" in keeps else "",
            author=span.author if "authors" in keeps else "",
            confidence=span.confidence if "confidence" in keeps else None,
            origin=span.origin if "origin" in keeps else "import",
            person=span.person if "persons" in keeps else "",
        )
        for number, span in enumerate(labels.spans, start=1)
    ]
    tracks = labels.tracks if "tracks" in keeps else (LabelTrack("Gestures"),)
    if "empty tracks" not in keeps:
        used = {span.track for span in spans}
        tracks = tuple(track for track in tracks if track.name in used) or (LabelTrack("Gestures"),)
    if "overlap" not in keeps:
        tracks = tuple(
            LabelTrack(
                track.name,
                "free" if crowded([s for s in spans if s.track == track.name]) else "exclusive",
            )
            for track in tracks
        )
    return Labels(tracks, tuple(spans), labels.label_set if "label set" in keeps else GESTURES)


def without_ids(labels: Labels) -> tuple[object, ...]:
    """Spans of one extent have no order of their own once their numbers are gone."""
    return labels.tracks, sorted(repr(replace(span, id=1)) for span in labels.spans)


@by_format
@given(labels=any_labels(milliseconds_s, min_spans=1))
@few
def test_all_that_a_format_can_hold_comes_back(folder: Path, name: str, labels: Labels) -> None:
    back, _ = there_and_back(folder, name, labels)
    if name == "mne":  # a start and a duration make the end within rounding only
        back = to_a_nanosecond(back, labels)
    expected = surviving(labels, KEEPS[name])
    assert without_ids(back) == without_ids(expected)
    assert back.label_set == expected.label_set
    if "ids" in KEEPS[name]:
        assert back == expected


@by_format
@given(labels=any_labels(min_spans=1))
@few
def test_what_comes_back_otherwise_was_named(folder: Path, name: str, labels: Labels) -> None:
    plain = Labels(
        labels.tracks,
        tuple(
            replace(span, id=number, note="", author="", confidence=None, origin="import")
            for number, span in enumerate(labels.spans, start=1)
        ),
    )
    for one in (labels, plain):
        back, losses = there_and_back(folder, name, one)
        if not losses:
            assert to_a_nanosecond(back, one) == one
        assert all(loss.count > 0 and loss.sentence for loss in losses)


@pytest.mark.parametrize("name", ["sd2", "csv", "audacity", "textgrid", "boris"])
@given(labels=any_labels(finite_times_s, min_spans=1))
@few
def test_times_are_exact(folder: Path, name: str, labels: Labels) -> None:
    back, _ = there_and_back(folder, name, labels)
    assert sorted((s.start_s, s.end_s, s.label) for s in back.spans) == sorted(
        (s.start_s, s.end_s, s.label) for s in labels.spans
    )


@by_format
def test_an_old_file_outlives_an_interrupted_save(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "labels"
    path.write_text("old", encoding="utf-8")

    def fail(descriptor: int) -> None:
        raise OSError("the disk is gone")

    monkeypatch.setattr("os.fsync", fail)
    with pytest.raises(OSError, match="gone"):
        write_labels(path, Labels(), TIMEBASE, name)
    assert path.read_text(encoding="utf-8") == "old"
    assert list(tmp_path.iterdir()) == [path]


@given(labels=any_labels(min_spans=1))
@few
def test_a_spreadsheet_computes_none_of_the_texts(folder: Path, labels: Labels) -> None:
    path = folder / "labels.csv"
    write_labels(path, labels, TIMEBASE)
    with path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            for name in ("track", "label", "note", "author"):
                assert not row[name].lstrip().startswith(tuple("=+-@＝＋－＠")), row[name]


RICH = Labels(
    (LabelTrack("Gestures"), LabelTrack("Left hand", "free"), LabelTrack("Empty")),
    (
        Span(4, "Gestures", 1.0, 2.0, "left-to-right", "blurred", "Ada", 0.5),
        Span(9, "Left hand", 1.5, 2.5, "wave", "", "Ada", None, "suggestion"),
    ),
    LabelSet("Mine", (Label("wave", "#112233", "w", "vertical"),)),
)


def test_losses_are_sentences_with_numbers(folder: Path) -> None:
    _, losses = there_and_back(folder, "audacity", RICH)
    assert [str(loss) for loss in losses] == [
        "Audacity keeps no tracks: 3 tracks become one",
        "Audacity does not say whether spans may overlap: 1 free track may come back as exclusive",
        "Audacity keeps no numbers of spans: 2 spans renumbered",
        "Audacity keeps no notes: 1 note left out",
        "Audacity keeps no authors: those of 2 spans left out",
        "Audacity keeps no confidence: that of 1 span left out",
        "Audacity does not say who made a span: 2 spans will count as imported",
        "Audacity keeps no label set: 'Mine' left out",
    ]
    assert str(losses[-1]) == "Audacity keeps no label set: 'Mine' left out"


@pytest.mark.parametrize("name", ["sd2", "boris", "elan"])
def test_some_formats_hold_everything(folder: Path, name: str) -> None:
    assert there_and_back(folder, name, RICH) == (RICH, [])


@by_format
def test_labels_without_spans(folder: Path, name: str) -> None:
    path = folder / "nothing"
    assert write_labels(path, Labels(), TIMEBASE, name) == []
    if name == "audacity":  # whose file then has no lines
        assert path.read_bytes() == b""
    else:
        assert read_labels(path, format=name) == Labels()


@pytest.mark.parametrize("name", ["csv", "elan"])
def test_control_characters_are_replaced_and_counted(folder: Path, name: str) -> None:
    labels = Labels(spans=(Span(1, "Gestures", 1, 2, "a", "bell\0\0", "A"),))
    back, losses = there_and_back(folder, name, labels)
    assert back.spans[0].note == "bell\N{REPLACEMENT CHARACTER}\N{REPLACEMENT CHARACTER}"
    assert [(loss.what, loss.count) for loss in losses] == [("characters", 1)]


@pytest.mark.parametrize("name", ["boris", "mne"])
def test_where_there_are_escapes_control_characters_stay(folder: Path, name: str) -> None:
    labels = Labels(spans=(Span(1, "Gestures", 1, 2, "a", "bell\0\x07\r\n", "A"),))
    assert there_and_back(folder, name, labels)[0] == labels


def test_spans_of_one_time_are_said_to_be_renumbered_by_their_tracks(folder: Path) -> None:
    """A TextGrid holds a part for each track: its order is that of the tracks."""
    tracks = (LabelTrack("Gestures"), LabelTrack("left-to-right"))
    spans = tuple(
        Span(number, track, 2.0, 3.0, "wave", origin="import")
        for number, track in enumerate(("left-to-right", "Gestures"), start=1)
    )
    back, losses = there_and_back(folder, "textgrid", Labels(tracks, spans))
    assert [span.track for span in back.spans] == ["Gestures", "left-to-right"]
    assert [loss.what for loss in losses] == ["ids"]
