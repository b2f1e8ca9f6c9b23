"""What is taken of label files of others, what is left out, and the sentence that says so."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.labels.formats import (
    LabelReading,
    format_for,
    observations,
    read_label_file,
    read_labels,
    write_labels,
)
from sd2core.labels.spans import Labels, Span
from sd2core.labels.typed_times import typed_end, typed_start
from sd2core.timebase import Timebase, common_clock

BASE = Timebase.regular(100, 10.0)  # 0 to 10 s
EARLIER = common_clock([BASE, Timebase.regular(99, 20.0, -2.0)])  # a radar began 2 s before
few = settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])


def reading(path: Path, content: str, base: Timebase | None = BASE, **more: object) -> LabelReading:
    path.write_text(content, encoding="utf-8")
    return read_label_file(path, base, **more)  # type: ignore[arg-type]


def spans(found: LabelReading) -> list[tuple[float, float, str]]:
    return [
        (round(one.start_s, 6), round(one.end_s, 6), one.label)
        for one in sorted(found.labels.spans, key=lambda one: one.start_s)
    ]


# One odd entry is left out and listed; the rest is read.


@pytest.mark.parametrize(
    ("name", "content", "place"),
    [
        ("a.csv", "label,start,end\nA,1,2\nB,n/a,4\nC,5,6\n", "line 3: start_s is 'n/a'"),
        ("a.csv", "label,start,end\nA,1,2\nB,4,3\nC,5,6\n", "line 3: the span ('B', 4 to 3 s)"),
        ("a.csv", "label,start,end\nA,1,2\nB,4\nC,5,6\n", "line 3 has 2 columns"),
        ("a.csv", "label,start,end\nA,1,2\nB,0:0:0:1,4\nC,5,6\n", "start_s is '0:0:0:1'"),
        ("a.csv", "label,first_frame,last_frame\nA,10,19\nB,7,x\nC,50,59\n", "last_frame is 'x'"),
        ("a.csv", "label,first_frame,last_frame\nA,10,19\nB,7,100\nC,50,59\n", "frame 101, excl"),
        ("a.txt", "1\t2\tA\n3\tx\tB\n5\t6\tC\n", "line 2: a time is 'x'"),
        ("a.txt", "# onset, duration, description\n1,1,A\n3,n/a,B\n5,1,C\n", "duration is 'n/a'"),
        ("a.vtt", "WEBVTT\n\n0:01.0 --> 0:02.0\nA\n\n0:03 --> x\nB\n\n0:05.0 --> 0:06.0\nC\n",
         "cue 2: its times are"),
    ],
)  # fmt: skip
def test_one_odd_entry(tmp_path: Path, name: str, content: str, place: str) -> None:
    found = reading(tmp_path / name, content)
    assert spans(found) == [(1.0, 2.0, "A"), (5.0, 6.0, "C")]
    assert [place in one for one in found.left_out] == [True]
    assert found.left_out[0] in found.sentence
    assert "2 spans on 1 track taken" in found.sentence
    assert str(tmp_path) not in found.sentence


def test_nothing_left_to_be_read_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match=r"a\.csv: line 2: start_s is 'n/a'"):
        reading(tmp_path / "a.csv", "label,start,end\nA,n/a,2\nB,3,n/a\n")


def test_many_are_counted_and_some_named(tmp_path: Path) -> None:
    rows = "".join(f"A,x,{k}\n" for k in range(30))
    found = reading(tmp_path / "a.csv", f"label,start,end\n{rows}A,1,2\n")
    assert len(found.left_out) == 30
    assert "30 left out (" in found.sentence
    assert "25 more" in found.sentence


# Times.


@given(st.floats(0, 90_000).map(lambda s: round(s, 3)), st.sampled_from(".,"), st.booleans())
@few
def test_hours_minutes_and_seconds(tmp_path: Path, start_s: float, point: str, hours: bool) -> None:
    def clock(time_s: float) -> str:
        whole, ms = divmod(round(time_s * 1000), 1000)
        minutes, seconds = divmod(whole, 60)
        shown = f"{minutes // 60:02}:{minutes % 60:02}" if hours else f"{minutes}"
        return f"{shown}:{seconds:02}{point}{ms:03}"

    end_s = start_s + 1.5
    for content in (
        f"label;start;end\nA;{clock(start_s)};{clock(end_s)}\n",
        f"label;Begin Time - hh:mm:ss.ms;Duration\nA;{clock(start_s)};0:01{point}5\n",
    ):
        found = reading(tmp_path / "a.csv", content, None)
        assert spans(found) == [(pytest.approx(start_s), pytest.approx(end_s), "A")]


@pytest.mark.parametrize(
    ("suffix", "head", "point"), [("vtt", "WEBVTT\n\n", "."), ("srt", "", ",")]
)
def test_subtitles(tmp_path: Path, suffix: str, head: str, point: str) -> None:
    content = (
        f"{head}1\n00:00:01{point}000 --> 00:00:02{point}500 line:0\n<v Ada><i>wave &amp;</i> tap\n"
        f"\nNOTE 00:07 --> 00:08\n\n2\n01:00:00{point}250 --> 01:00:01{point}000\nhands\nup\n"
    )
    found = reading(tmp_path / f"a.{suffix}", content, None)
    assert spans(found) == [(1.0, 2.5, "wave & tap"), (3600.25, 3601.0, "hands up")]
    assert [one.track for one in found.labels.spans] == ["Ada", "Gestures"]


# Marks without a duration.

MARKS = "label,start,end\ntap,2.04,2.04\n"


def test_marks_are_frames_or_of_a_length(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    assert spans(reading(path, MARKS)) == [(2.0, 2.1, "tap")]
    assert spans(reading(path, MARKS, None, frames_per_s=10.0)) == [(2.0, 2.1, "tap")]
    for base in (BASE, None):
        assert spans(reading(path, MARKS, base, mark_s=0.5)) == [(2.04, 2.54, "tap")]
    with pytest.raises(Sd2Error, match="give marks a length"):
        reading(path, MARKS, None)


def test_frames_with_a_rate(tmp_path: Path) -> None:
    content = "label,first_frame,last_frame\nA,10,19\n"
    assert spans(reading(tmp_path / "a.csv", content, None, frames_per_s=20.0)) == [(0.5, 1.0, "A")]


@pytest.mark.parametrize(
    ("start_s", "end_s"), [(15.6, 15.6), (9.0, 12.0), (-1.0, 1.0), (10.1, 10.2)]
)
def test_what_is_beyond_the_recording_stays_and_is_told(
    tmp_path: Path, start_s: float, end_s: float
) -> None:
    found = reading(tmp_path / "a.csv", f"label,start,end\nA,1,2\nB,{start_s},{end_s}\n")
    (span,) = (one for one in found.labels.spans if one.label == "B")
    assert span.start_s == start_s
    assert span.end_s == (end_s if end_s > start_s else pytest.approx(start_s + 0.1))
    assert "1 of 2 labels reaches beyond the recording (0 to 10 s), as far as " in found.sentence


def test_times_in_another_unit_are_told_as_such(tmp_path: Path) -> None:
    found = reading(tmp_path / "a.csv", "label,start,end\nA,1000,2000\nB,3000,4000\n")
    assert "(0 to 10 s), as far as 4000 s (their times are probably milliseconds)" in found.sentence


def test_labels_within_the_recording_are_not_beyond_it(tmp_path: Path) -> None:
    labels = Labels(spans=(Span(1, "Gestures", 0.0, BASE.end_s, "A"),))
    for name in ("a.json", "a.csv", "a.eaf", "a.boris", "a.TextGrid"):
        write_labels(tmp_path / name, labels, BASE)
        found = read_label_file(tmp_path / name, BASE)
        assert found.sentence == "1 span on 1 track taken, nothing left out."


def test_what_ends_a_moment_after_the_last_frame_is_not_beyond(tmp_path: Path) -> None:
    found = reading(tmp_path / "a.csv", "label,start,end\nA,9,10.4\n")
    assert found.sentence == "1 span on 1 track taken, nothing left out."


# Tables and JSON of others.


@pytest.mark.parametrize(
    "content",
    [
        "label,start_min,end_min\nA,0.05,0.1\n",
        "label,start (minutes),duration (sec)\nA,0.05,3\n",
        "sep=;\r\nlabel;start;end\r\nA;3;6\r\n",
        "label,first_frame,last_frame\nA,30.0,59.0\n",
    ],
)
def test_units_separators_and_frames_as_others_write_them(tmp_path: Path, content: str) -> None:
    assert spans(reading(tmp_path / "a.csv", content)) == [(3.0, 6.0, "A")]


def test_a_table_without_ends_says_that_it_has_marks(tmp_path: Path) -> None:
    found = reading(tmp_path / "a.csv", "label,start,duration_weeks\nA,1,2\n")
    assert spans(found) == [(1.0, 1.1, "A")]
    assert "marks, as no column of ends is known (label, start, duration_weeks)" in found.sentence


@pytest.mark.parametrize(
    "content",
    [
        '[{"start": 1, "end": 2, "label": "A"}]',
        '{"database": {"v": {"annotations": [{"segment": [1, 2], "label": "A"}]}}}',
        "[]",
    ],
)
def test_json_of_another_program_is_refused(tmp_path: Path, content: str) -> None:
    with pytest.raises(Sd2Error, match=r"a\.json is JSON without annotated tasks"):
        reading(tmp_path / "a.json", content)


# ELAN.


def eaf(slots: dict[str, int | str | None], pairs: list[tuple[str, str]], media: str = "") -> str:
    order = "".join(
        f'<TIME_SLOT TIME_SLOT_ID="{name}"' + ("/>" if at is None else f' TIME_VALUE="{at}"/>')
        for name, at in slots.items()
    )
    annotations = "".join(
        f'<ANNOTATION><ALIGNABLE_ANNOTATION ANNOTATION_ID="a{k}" TIME_SLOT_REF1="{a}" '
        f'TIME_SLOT_REF2="{b}"><ANNOTATION_VALUE>{k}</ANNOTATION_VALUE></ALIGNABLE_ANNOTATION>'
        "</ANNOTATION>"
        for k, (a, b) in enumerate(pairs, start=1)
    )
    return (
        f"<ANNOTATION_DOCUMENT><HEADER>{media}</HEADER><TIME_ORDER>{order}</TIME_ORDER>"
        f'<TIER TIER_ID="t">{annotations}</TIER></ANNOTATION_DOCUMENT>'
    )


@given(st.integers(0, 8), st.integers(0, 3))
@few
def test_slots_without_a_time_divide_evenly(tmp_path: Path, between: int, others: int) -> None:
    # Slots of another tier stand between them and change nothing.
    slots: dict[str, int | str | None] = {"first": 1000}
    names = ["first", *(f"u{k}" for k in range(between)), "last"]
    for name in names[1:-1]:
        slots |= {f"{name} other {k}": 1500 for k in range(others)} | {name: None}
    slots["last"] = 4000
    found = reading(tmp_path / "a.eaf", eaf(slots, list(pairwise(names))))
    starts_s = [start_s for start_s, _, _ in spans(found)]
    step_s = 3.0 / (between + 1)
    assert starts_s == pytest.approx([1.0 + k * step_s for k in range(between + 1)], abs=1e-5)
    assert found.labels.spans[-1].end_s == 4.0
    assert ("evenly between" in found.sentence) == bool(between)


def test_slots_may_have_parts_of_milliseconds(tmp_path: Path) -> None:
    found = reading(tmp_path / "a.eaf", eaf({"a": "1010.5", "b": "2000.0"}, [("a", "b")]))
    assert [(one.start_s, one.end_s) for one in found.labels.spans] == [(1.0105, 2.0)]


def test_slots_that_cannot_be_placed_leave_their_annotations_out(tmp_path: Path) -> None:
    slots: dict[str, int | str | None] = {"a": 1000, "b": 2000, "odd": "-5", "c": 3000, "end": None}
    found = reading(tmp_path / "a.eaf", eaf(slots, [("a", "b"), ("odd", "c"), ("c", "end")]))
    assert spans(found) == [(1.0, 2.0, "1")]
    assert ["a2: the time slot 'odd'" in found.left_out[0], "'end'" in found.left_out[1]] == [
        True,
        True,
    ]


@pytest.mark.parametrize("first", ["audio/x-wav", "video/mp4"])
def test_origin_of_the_video_counts_wherever_it_is_linked(tmp_path: Path, first: str) -> None:
    linked = [
        '<MEDIA_DESCRIPTOR MEDIA_URL="a.mp4" MIME_TYPE="video/mp4" TIME_ORIGIN="3000"/>',
        '<MEDIA_DESCRIPTOR MEDIA_URL="a.wav" MIME_TYPE="audio/x-wav" TIME_ORIGIN="700"/>',
    ]
    media = "".join(linked if first.startswith("video") else reversed(linked))
    found = reading(tmp_path / "a.eaf", eaf({"a": 500, "b": 1500}, [("a", "b")], media))
    assert spans(found) == [(3.5, 4.5, "1")]


# BORIS.


def boris(events: list[list[object]], **observation: object) -> str:
    behaviours = {"0": {"type": "State event", "code": "wave"}, "1": {"type": "Point event",
                  "code": "tap"}}  # fmt: skip
    return json.dumps(
        {"behaviors_conf": behaviours, "observations": {"one": {"events": events, **observation}}}
    )


def test_open_states_and_times_that_are_none_are_left_out(tmp_path: Path) -> None:
    events: list[list[object]] = [[1, "", "wave"], ["NA", "", "tap"], [2, "", "wave"],
                                  [3, "", "wave"]]  # fmt: skip
    found = reading(tmp_path / "a.boris", boris(events))
    assert spans(found) == [(1.0, 2.0, "wave")]
    assert "event 2: the time is 'NA'" in found.left_out[0]
    assert "begins at 3 s and does not end" in found.left_out[1]


@given(st.floats(-100, 100), st.floats(-5, 5), st.booleans())
@few
def test_offsets_of_boris(tmp_path: Path, offset_s: float, player_s: float, first: bool) -> None:
    players = {"1": ["a.mp4"], "2": ["a.wav"]} if first else {"1": ["a.wav"], "2": ["a.mp4"]}
    media = {"hasVideo": {"a.mp4": True, "a.wav": False}, "offset": {"1": 0.0, "2": player_s}}
    zero_s = offset_s + (0.0 if first else player_s)
    events: list[list[object]] = [[zero_s + 1, "", "wave"], [zero_s + 2, "", "wave"]]
    content = boris(events, file=players, media_info=media, **{"time offset": offset_s})
    found = reading(tmp_path / "a.boris", content)
    assert spans(found) == [(pytest.approx(1.0), pytest.approx(2.0), "wave")]


# Label Studio.

WAVE = {"ranges": [{"start": 11, "end": 20}], "timelinelabels": ["wave"]}
SWIPE = {"start": 3.0, "end": 4.0, "timeserieslabels": ["swipe"]}
TIMELINE = {"type": "timelinelabels", "from_name": "hand", "value": WAVE}
SERIES = {"type": "timeserieslabels", "from_name": "imu", "value": SWIPE}
SOUND = {"type": "labels", "value": {"start": 5.0, "end": 6.0, "channel": 0, "labels": ["clap"]}}
BOX = {"type": "videorectangle", "value": {"sequence": [], "labels": ["Man"]}}


def task(file: str, regions: list[object], **more: object) -> dict[str, object]:
    annotation = {"result": regions, "completed_by": {"id": 3, "email": "ada@x.org"}, **more}
    return {"id": 7, "data": {"video": f"/data/upload/1/{file}"}, "annotations": [annotation]}


@pytest.mark.parametrize("base", [BASE, EARLIER, None])
def test_timelines_count_frames_from_1_to_the_last_one_within(
    tmp_path: Path, base: Timebase | None
) -> None:
    content = json.dumps([task("a.mp4", [TIMELINE, SERIES, SOUND, BOX])])
    rate = None if base is not None else 10.0
    found = reading(tmp_path / "a.json", content, base, frames_per_s=rate)
    assert spans(found) == [(1.0, 2.0, "wave"), (3.0, 4.0, "swipe"), (5.0, 6.0, "clap")]
    assert [one.name for one in found.labels.tracks] == ["hand", "imu", "Gestures"]
    assert {one.author for one in found.labels.spans} == {"ada@x.org"}
    assert "annotation 1, region 4 is 'videorectangle'" in found.sentence


def test_short_exports_hold_the_same(tmp_path: Path) -> None:
    short = [{"id": 7, "video": "a.mp4", "annotator": 3, "hand": [WAVE], "imu": [SWIPE]}]
    found = reading(tmp_path / "a.json", json.dumps(short))
    assert spans(found) == [(1.0, 2.0, "wave"), (3.0, 4.0, "swipe")]


def test_tasks_are_observations_and_cancelled_ones_are_told(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    content = json.dumps([task("a.mp4", [TIMELINE]), task("b.mp4", [SERIES]),
                          task("c.mp4", [SERIES], was_cancelled=True)])  # fmt: skip
    path.write_text(content)
    assert observations(path) == ("a.mp4", "b.mp4", "c.mp4")
    assert spans(read_label_file(path, BASE, observation="b.mp4")) == [(3.0, 4.0, "swipe")]
    with pytest.raises(Sd2Error, match="3 annotated tasks"):
        read_labels(path, BASE)
    with pytest.raises(Sd2Error, match="is cancelled"):
        read_labels(path, BASE, "label-studio", observation="c.mp4")


def test_our_own_json_is_ours_whatever_its_labels_are_called(tmp_path: Path) -> None:
    labels = Labels(spans=(Span(1, "Gestures", 0, 1, "annotations"),))
    write_labels(tmp_path / "a.json", labels, BASE)
    assert read_labels(tmp_path / "a.json") == labels


@pytest.mark.parametrize(("name", "frame"), [("csv", "13,24,12"), ("sd2", '"first": 13')])
def test_frames_are_the_videos_where_a_radar_began_before(
    tmp_path: Path, name: str, frame: str
) -> None:
    """What another program finds at a frame of the video is there."""
    labels = Labels(spans=(Span(1, "Gestures", 1.3, 2.5, "wave"),))
    texts = []
    for number, base in enumerate((BASE, EARLIER)):
        write_labels(path := tmp_path / f"{number}.{name}", labels, base, name)
        texts.append(path.read_text("utf-8"))
    assert frame in texts[0]
    assert texts[0] == texts[1]
    assert typed_start("f13", EARLIER) == 1.3
    assert typed_end("f24", EARLIER) == 2.5


def test_formats_that_are_only_read_are_not_written(tmp_path: Path) -> None:
    assert format_for(tmp_path / "a.json", writing=True).name == "sd2"
    for name in ("subtitles", "label-studio"):
        with pytest.raises(Sd2Error, match="which is only read"):
            write_labels(tmp_path / "a.x", Labels(), BASE, name)


@pytest.mark.parametrize("ending", ["_ms", " (ms)", " [ms]", "_msec"])
def test_headings_that_name_another_unit_are_understood(tmp_path: Path, ending: str) -> None:
    table = f"label,start{ending},duration{ending}\nA,500,1000\n"
    assert spans(reading(tmp_path / "a.csv", table)) == [(0.5, 1.5, "A")]


def test_a_table_of_one_time_each_is_of_marks(tmp_path: Path) -> None:
    found = reading(tmp_path / "a.csv", "time,label\n0.5,tap\n2,tap\n", mark_s=0.2)
    assert spans(found) == [(0.5, 0.7, "tap"), (2.0, 2.2, "tap")]
    with pytest.raises(Sd2Error, match="export aggregated events"):
        reading(tmp_path / "b.csv", "Time,Behavior,Behavior type\n1,wave,START\n2,wave,STOP\n")
