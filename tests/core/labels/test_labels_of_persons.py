"""Spans of a scene of several name a person; files of one are as they were."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sd2core.cutouts.source import CutSource
from sd2core.labels.edits import Edits, merge
from sd2core.labels.files import read_labels, write_labels
from sd2core.labels.formats import write_labels as export
from sd2core.labels.spans import Labels, Span
from sd2core.timebase import Timebase

CLOCK = Timebase.regular(60, 20.0)
WAVE = Span(1, "Gestures", 0.5, 1.5, "wave")
LABELS = Labels(spans=(WAVE, Span(2, "Gestures", 1.5, 2.5, "wave", person="anna")))


def test_files_say_it_only_where_it_is_told(tmp_path: Path) -> None:
    path = tmp_path / "labels.json"
    write_labels(path, LABELS)
    wave, annas = [line for line in path.read_text("utf-8").splitlines() if '"start_s"' in line]
    assert "anna" in annas
    assert "person" not in wave
    assert read_labels(path).labels == LABELS


def test_what_cannot_hold_persons_says_so(tmp_path: Path) -> None:
    losses = export(tmp_path / "x.TextGrid", LABELS, CLOCK)
    assert [loss.count for loss in losses if loss.what == "persons"] == [1]
    alone = replace(LABELS, spans=(WAVE,))
    assert "persons" not in {one.what for one in export(tmp_path / "y.TextGrid", alone, CLOCK)}


def test_parts_of_a_span_are_of_the_same_person() -> None:
    parts = Edits(LABELS, CLOCK).split(2, 2.0).labels
    assert [span.person for span in parts.spans] == ["", "anna", "anna"]
    whole = merge(parts, [2, 3]).labels
    assert whole == LABELS


def test_cut_outs_of_one_person_are_described_as_before(tmp_path: Path) -> None:
    video = tmp_path / "x.mp4"
    video.touch()
    source = CutSource("x", False, CLOCK, video)
    wave, annas = (source.described(span)["span"] for span in LABELS.spans)
    assert "person" not in wave
    assert annas["person"] == "anna"
