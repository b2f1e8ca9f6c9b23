"""Labels are read back as they were; what is no such file is refused by name and place."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from labelled import even, imported, uneven

from sd2core.errors import Sd2Error
from sd2core.files.recording_json import Span as InlineSpan
from sd2core.files.resources import resource_path
from sd2core.labels.files import (
    FILE_NAME,
    NO_LABEL,
    labels_of,
    read_label_set,
    read_labels,
    write_label_set,
    write_labels,
)
from sd2core.labels.label_set import GESTURES, Label, LabelSet
from sd2core.labels.spans import ORIGINS, Labels, LabelTrack, Span
from sd2core.recording.document import read_document
from sd2core.timebase import Timebase

names = st.text(st.characters(codec="utf-8", exclude_categories=["C", "Z"]), min_size=1, max_size=9)
notes = st.text(st.characters(codec="utf-8"), max_size=12)


@st.composite
def any_labels(draw: st.DrawFn) -> Labels:
    tracks = tuple(
        LabelTrack(name, "free") for name in draw(st.lists(names, max_size=3, unique=True))
    )
    spans = []
    for k in range(draw(st.integers(0, 6)) if tracks else 0):
        start_s = draw(st.floats(-1e6, 1e6))
        spans.append(
            Span(
                3 * k + 1,
                draw(st.sampled_from(tracks)).name,
                start_s,
                start_s + draw(st.floats(1e-3, 1e3)),
                draw(names),
                draw(notes),
                draw(notes),
                draw(st.none() | st.floats(0, 1)),
                draw(st.sampled_from(ORIGINS)),
                draw(st.just("") | names),
            )
        )
    found = draw(st.lists(names, max_size=4, unique=True))
    entries = tuple(Label(name, f"#{k:06x}", str(k), "class") for k, name in enumerate(found))
    return Labels(tracks, tuple(spans), LabelSet(draw(notes), entries))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("labels")


@settings(max_examples=30)
@given(labels=any_labels())
def test_everything_is_read_back(labels: Labels, folder: Path) -> None:
    path = folder / FILE_NAME
    write_labels(path, labels, timebase=even())
    assert read_labels(path).labels == labels
    write_label_set(path, labels.label_set)
    assert read_label_set(path) == labels.label_set


def test_frames_are_written_for_people(tmp_path: Path) -> None:
    timebase = uneven(3)
    labels = imported(timebase, 3)
    write_labels(tmp_path / FILE_NAME, labels, timebase=timebase)
    entries = json.loads((tmp_path / FILE_NAME).read_text(encoding="utf-8"))["spans"]
    for entry, span in zip(entries, labels.spans, strict=True):
        first, stop = timebase.frames_between(span.start_s, span.end_s)
        assert entry["frames"] == {"first": first, "last": stop - 1, "count": stop - first}
    write_labels(tmp_path / FILE_NAME, labels)
    assert "frames" not in (tmp_path / FILE_NAME).read_text(encoding="utf-8")


def test_a_line_for_every_span_and_label(tmp_path: Path) -> None:
    write_labels(tmp_path / FILE_NAME, Labels(spans=(Span(1, "Gestures", 1.6, 2.8, "wave"),)))
    lines = (tmp_path / FILE_NAME).read_text(encoding="utf-8").splitlines()
    spans = [line for line in lines if '"start_s"' in line]
    assert [json.loads(line) for line in spans] == [
        {"id": 1, "track": "Gestures", "start_s": 1.6, "end_s": 2.8, "label": "wave"}
    ]
    assert sum('"colour"' in line for line in lines) == len(GESTURES.labels)


def test_numbers_of_numpy_are_read_back_as_plain_ones(tmp_path: Path) -> None:
    start_s, end_s, sure = np.float32([1.5, 2.5, 0.25])
    span = Span(1, "Gestures", start_s, end_s, "wave", confidence=sure)
    write_labels(tmp_path / "labels.json", Labels((LabelTrack("Gestures"),), (span,), GESTURES))
    assert read_labels(tmp_path / "labels.json").labels.spans == (span,)


def test_recording_and_video_move_with_the_file(tmp_path: Path) -> None:
    (tmp_path / "a" / "walk.sd2").mkdir(parents=True)
    path = tmp_path / "a" / "walk.sd2" / FILE_NAME
    write_labels(path, Labels(), recording=path.parent, video=tmp_path / "a" / "walk.mkv")
    written = json.loads(path.read_text(encoding="utf-8"))
    assert (written["recording"], written["video"]) == (".", "../walk.mkv")
    (tmp_path / "a").rename(tmp_path / "b")
    read = read_labels(tmp_path / "b" / "walk.sd2" / FILE_NAME)
    assert read.recording == tmp_path / "b" / "walk.sd2"
    assert read.video == tmp_path / "b" / "walk.mkv"


def test_an_interrupted_write_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / FILE_NAME
    labels = Labels(spans=(Span(1, "Gestures", 1.6, 2.8, "wave"),))
    write_labels(path, labels)

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("sd2core.files.atomic.os.fsync", full)
    with pytest.raises(OSError, match="No space"):
        write_labels(path, Labels())
    assert read_labels(path).labels == labels
    assert [one.name for one in tmp_path.iterdir()] == [FILE_NAME]


def test_the_example_of_the_documentation_is_read(tmp_path: Path) -> None:
    text = (Path(__file__).resolve().parents[3] / "docs" / "formats.md").read_text("utf-8")
    example = text.partition("\n## Labels\n")[2].partition("```json\n")[2].partition("```")[0]
    (tmp_path / FILE_NAME).write_text(example, "utf-8")
    read = read_labels(tmp_path / FILE_NAME)
    assert read.recording == tmp_path
    span = Span(1, "Gestures", 1.6, 2.8, "left-to-right", author="B")
    assert read.labels == Labels((LabelTrack("Gestures"),), (span,), read.labels.label_set)
    assert Timebase.regular(90, 30.0).frames_between(span.start_s, span.end_s) == (48, 84)


SPAN = {"id": 1, "track": "Gestures", "start_s": 1.0, "end_s": 2.0, "label": "wave"}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"version": 2}, r"of version 2\. Expected.*the version of SD² Studio that wrote it, or a"),
        ({"version": True}, "of version True"),
        ({"format": "sd2-label-set"}, "has the format 'sd2-label-set'. Expected: the format 'sd2"),
        ({"spans": [SPAN, SPAN | {"start_s": "soon"}]}, r"spans\.1\.start_s is 'soon' \(Input sh"),
        ({"spans": [SPAN | {"start_s": 3.0}]}, r"Span 1 \('wave', 3 to 2 s\) ends before it has"),
        ({"spans": [SPAN, SPAN]}, "Two spans have the same id"),
        ({"spans": [SPAN, SPAN | {"id": 2}]}, r"Span 1 .* and Span 2 .* overlap on 'Gestures'"),
        ({"spans": [SPAN | {"track": "Feet"}]}, "on the track 'Feet'. Expected: one of Gestures"),
        ({"spans": [SPAN | {"id": "1"}]}, r"spans\.0\.id is '1'"),
        ({"spans": [SPAN | {"confidence": 2}]}, "has the confidence 2"),
        ({"spans": [SPAN | {"origin": "dream"}]}, r"spans\.0\.origin is 'dream'"),
        ({"spans": [SPAN | {"weather": 1}]}, r"spans\.0\.weather is nothing that this version kn"),
        ({"weather": "north"}, "weather is nothing that this version knows"),
        ({"spans": [{"id": 1}]}, r"spans\.0\.track is missing"),
        ({"spans": None}, "spans is None"),
        ({"tracks": [{"name": ""}]}, "The name of a track is ''"),
        ({"tracks": [{"name": "Gestures", "overlap": "some"}]}, r"tracks\.0\.overlap is 'some'"),
        ({"label_set": {"name": "x"}}, r"label_set\.labels is missing"),
        (
            {"label_set": {"name": "x", "labels": [{"name": "a", "colour": "red"}]}},
            "The colour of the label 'a' is 'red'. Expected: #rrggbb",
        ),
    ],
)
def test_what_cannot_be_is_refused(tmp_path: Path, change: dict[str, Any], says: str) -> None:
    path = tmp_path / FILE_NAME
    write_labels(path, Labels(spans=(Span(**SPAN),)))  # type: ignore[arg-type]
    path.write_text(json.dumps(json.loads(path.read_text(encoding="utf-8")) | change))
    with pytest.raises(Sd2Error, match=says) as caught:
        read_labels(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "is empty"),
        (b'{"format": "sd2-labels",', "cannot be read .*line 1 column"),
        (b"\xff\xfe", "is empty"),
        (b"\xff", "is not UTF-8"),
        (b"[" * 100_000, "cannot be read .*nested too deeply"),
        (b'{"format": ' + b"9" * 5000 + b"}", "cannot be read .*line 1: a number of 5,000 digits"),
        (b"[]", "has the format None"),
        (b'{"format": "sd2-recording", "version": 1}', "has the format 'sd2-recording'"),
    ],
)
def test_what_is_no_such_file_is_refused(tmp_path: Path, content: bytes, says: str) -> None:
    path = tmp_path / FILE_NAME
    path.write_bytes(content)
    for read in (read_labels, read_label_set):
        with pytest.raises(Sd2Error, match=says) as caught:
            read(path)
        assert str(path) in str(caught.value)


def test_a_long_value_is_not_repeated_whole(tmp_path: Path) -> None:
    path = tmp_path / FILE_NAME
    for label in ('"\\ud800"', f'["{"x" * 9000}"]'):
        write_labels(path, Labels(spans=(Span(**SPAN),)))  # type: ignore[arg-type]
        path.write_text(path.read_text(encoding="utf-8").replace('"wave"', label))
        with pytest.raises(Sd2Error) as caught:
            read_labels(path)
        assert len(str(caught.value)) < 400 + len(str(path))


@pytest.mark.parametrize(
    "beyond",
    [{"id": 2**53}, {"id": 10**250}, {"end_s": 2e12}, {"start_s": -1e308}, {"end_s": math.nan}],
)
def test_what_no_window_can_show_is_refused(beyond: dict[str, Any]) -> None:
    with pytest.raises(Sd2Error, match=r"1 to 9007199254740991|is not in time"):
        Span(**SPAN | beyond)  # type: ignore[arg-type]
    assert Span(**SPAN | {"id": 2**53 - 1, "end_s": 1e12}).duration_s > 9e11  # type: ignore[arg-type]


def test_half_characters_are_refused_before_they_spoil_a_file() -> None:
    with pytest.raises(Sd2Error, match=r"note of a span is .*whole characters"):
        Span(1, "Gestures", 0.0, 1.0, "wave", note="\ud83d")
    with pytest.raises(Sd2Error, match="class of a label"):
        Label("wave", "#000000", gesture_class="\udc00")
    with pytest.raises(Sd2Error, match="key of the label 'wave'"):
        Label("wave", "#000000", "\ud83d")
    assert Label("wave", "#000000", "\U0001f44b", "\U0001f44b").key == "\U0001f44b"


def test_times_that_are_no_numbers_are_refused(tmp_path: Path) -> None:
    path = tmp_path / FILE_NAME
    write_labels(path, Labels(spans=(Span(**SPAN),)))  # type: ignore[arg-type]
    path.write_text(path.read_text(encoding="utf-8").replace("2.0", "NaN"))
    with pytest.raises(Sd2Error, match=r"1 to nan s.* is not in time"):
        read_labels(path)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match=r"labels\.json does not exist"):
        read_labels(tmp_path / FILE_NAME)
    with pytest.raises(Sd2Error, match="is a folder"):
        read_labels(tmp_path)


class TestOfRecordings:
    def test_the_sample(self) -> None:
        spans = read_document(resource_path("swipes.sd2") / "recording.json").spans
        labels = labels_of(spans)
        assert [(one.start_s, one.end_s, one.label) for one in labels.spans] == [
            (one.start_s, one.end_s, one.label) for one in spans
        ]
        assert labels.tracks == (LabelTrack("Gestures"),)
        assert {one.origin for one in labels.spans} == {"import"}
        assert all(labels.label_set.find(one.label) for one in labels.spans)

    def test_overlapping_spans_stay_what_they_are(self) -> None:
        inline = [
            InlineSpan(start_s=a, end_s=b, label="x") for a, b in ((5, 6), (0, 9), (1, 2), (3, 4))
        ]
        labels = labels_of(inline)
        assert labels.tracks == (LabelTrack("Gestures", "free"),)
        assert [(one.id, one.start_s) for one in labels.spans] == [(1, 0), (2, 1), (3, 3), (4, 5)]

    @pytest.mark.parametrize(
        ("label", "expected"),
        [
            ("", NO_LABEL),
            (" \n", NO_LABEL),
            ("to\nthe  left", "to the left"),
            ("x" * 300, "x" * 200),
        ],
    )
    def test_labels_that_no_file_can_hold(self, label: str, expected: str) -> None:
        made = labels_of([InlineSpan(start_s=0, end_s=1, label=label)])
        assert made.spans[0].label == expected

    def test_none(self) -> None:
        assert labels_of([]) == Labels()
