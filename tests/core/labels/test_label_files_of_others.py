"""Files as other programs write them, and what those programs make of ours."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from any_labels import any_labels, finite_times_s, milliseconds_s
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sd2core.labels.formats import FORMATS, read_labels, write_labels
from sd2core.labels.formats.elan import edges_ms
from sd2core.labels.formats.lanes import lanes_of, track_of
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.timebase import Timebase

TIMEBASE = Timebase.regular(30, 10.0)
few = settings(
    max_examples=15,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
OVERLAPPING = Labels(
    (LabelTrack("Gestures"), LabelTrack("Hände", "free")),
    (
        Span(1, "Gestures", 0.5, 1.5, 'say "so"'),
        Span(2, "Hände", 1.0, 2.0, "wave"),
        Span(3, "Hände", 1.5, 2.5, "tap", "twice\n& <fast>"),
        Span(4, "Hände", 2.0, 3.0, "wave"),
    ),
)


def written(folder: Path, name: str, content: str, encoding: str = "utf-8") -> Path:
    path = folder / name
    path.write_bytes(content.encode(encoding))
    return path


def extents(labels: Labels) -> list[tuple[str, str, float, float]]:
    return [(span.track, span.label, span.start_s, span.end_s) for span in labels.spans]


# Rows without overlaps.


@given(labels=any_labels(finite_times_s))
@few
def test_lanes_hold_every_span_once_without_overlap_and_lead_back(labels: Labels) -> None:
    lanes = lanes_of(labels, lambda span: (span.start_s, span.end_s))
    assert sorted(span.id for lane in lanes for span in lane.spans) == sorted(
        span.id for span in labels.spans
    )
    assert len({lane.name for lane in lanes}) == len(lanes)
    for lane in lanes:
        assert track_of(lane.name)[0] == lane.track.name
        assert (track_of(lane.name)[1] or "exclusive") == lane.track.overlap
        assert {span.track for span in lane.spans} <= {lane.track.name}
        for before, after in zip(lane.spans, lane.spans[1:], strict=False):
            assert before.end_s <= after.start_s
    for track in labels.tracks:
        spans = labels.of_track(track.name)
        deepest = max(
            (sum(s.start_s <= one.start_s < s.end_s for s in spans) for one in spans), default=1
        )
        assert sum(lane.track is track for lane in lanes) == deepest


# CSV.


@given(
    start_s=st.floats(-1, 4),
    length_s=st.floats(1e-3, 2),
    steps=st.lists(st.floats(0.01, 0.2), min_size=1, max_size=30),
)
@few
def test_frames_in_a_table_are_those_shown(
    tmp_path: Path, start_s: float, length_s: float, steps: list[float]
) -> None:
    timebase = Timebase(np.cumsum(steps))
    span = Span(1, "Gestures", start_s, start_s + length_s, "wave")
    path = tmp_path / "x.csv"
    write_labels(path, Labels(spans=(span,)), timebase)
    heading, row = path.read_text(encoding="utf-8").splitlines()
    cell = dict(zip(heading.split(","), row.split(","), strict=True))
    first, stop = timebase.frames_between(span.start_s, span.end_s)
    shown = (first, stop - 1, stop - first) if stop > first else ("", "", 0)
    columns = ("first_frame", "last_frame", "frames")
    assert tuple(cell[name].strip('"') for name in columns) == tuple(map(str, shown))


def test_a_table_as_it_is_documented(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    write_labels(path, Labels(spans=(Span(7, "Gestures", 0.5, 1.5, "wave", 'a "b"'),)), TIMEBASE)
    assert path.read_text(encoding="utf-8") == (
        "id,track,overlap,label,start_s,end_s,first_frame,last_frame,frames,"
        "note,author,confidence,origin,person\n"
        '7,"Gestures","exclusive","wave",0.5,1.5,5,14,10,"a ""b""","","","person",""\n'
    )
    labels = Labels(spans=(Span(7, "Gestures", 0.5, 1.5, "wave", "a,\tb"),))
    write_labels(tmp_path / "x.tsv", labels, TIMEBASE)
    heading, row = (tmp_path / "x.tsv").read_text(encoding="utf-8").splitlines()
    assert heading.split("\t")[:3] == ["id", "track", "overlap"]
    assert row.startswith('7\t"Gestures"\t')
    assert read_labels(tmp_path / "x.tsv", TIMEBASE).spans == labels.spans


@pytest.mark.parametrize(
    "content",
    [
        "label,start_s,end_s\nwave,0.5,1.5\n",
        "\ufefflabel;start_s;end_s\r\nwave;0,5;1,5\r\n",
        "Label\tStart (s)\tDuration\nwave\t0.5\t1.0\n",
        "onset, duration, trial_type\n0.5, 1, wave\n",
        "label|start|stop\n\nwave|+.5|15e-1\n\n",
        "gesture,start_frame,end_frame\nwave,5,15\n",
        "gesture,start_frame,last_frame\nwave,5,14\n",
        "gesture,first_frame,last_frame,frames\nwave,5,14,10\n",
        "Observation id,Subject,Behavior,Behavior type,Start (s),Stop (s)\no,Gestures,wave,STATE,"
        ".5,1.5\n",
    ],
)
@pytest.mark.parametrize("suffix", ["csv", "tsv", "txt"])
def test_tables_of_others(tmp_path: Path, content: str, suffix: str) -> None:
    labels = read_labels(written(tmp_path, f"x.{suffix}", content), TIMEBASE)
    assert extents(labels) == [("Gestures", "wave", 0.5, 1.5)]
    assert {span.origin for span in labels.spans} == {"import"}


def test_tables_in_utf_16(tmp_path: Path) -> None:
    path = written(tmp_path, "x.csv", "label,start_s,end_s\nWörter,0.5,1.5\n", "utf-16")
    assert read_labels(path).spans[0].label == "Wörter"


def test_one_observation_of_a_table(tmp_path: Path) -> None:
    content = "observation id,behavior,start (s),stop (s)\na,wave,1,2\nb,tap,1,2\n"
    labels = read_labels(written(tmp_path, "x.csv", content), observation="b")
    assert [span.label for span in labels.spans] == ["tap"]


def test_overlaps_of_a_table_make_a_free_track(tmp_path: Path) -> None:
    content = "label,start_s,end_s\na,0,2\nb,1,3\n"
    assert read_labels(written(tmp_path, "x.csv", content)).tracks == (
        LabelTrack("Gestures", "free"),
    )


# Audacity.


def test_audacity_with_frequencies_points_and_empty_labels(tmp_path: Path) -> None:
    content = "0.5\t1.500000\twave\n\\\t100.0\t2000.0\n2.0\t2.0\tpoint\r\n2.5\t2.6\t\n"
    labels = read_labels(written(tmp_path, "x.txt", content), TIMEBASE)
    assert [(label, *map(float, edges)) for _, label, *edges in extents(labels)] == [
        ("wave", 0.5, 1.5),
        ("point", 2.0, pytest.approx(2.1)),
        ("unnamed", 2.5, 2.6),
    ]


def test_audacity_gets_six_digits_and_no_exponent(tmp_path: Path) -> None:
    labels = Labels(spans=(Span(1, "Gestures", 1e-7, 1 / 3, "wave"),))
    write_labels(tmp_path / "x.txt", labels, TIMEBASE, "audacity")
    text = (tmp_path / "x.txt").read_text(encoding="utf-8")
    assert text == "0.0000001\t0.3333333333333333\twave\n"


# ELAN.


@given(labels=any_labels(finite_times_s))
@few
def test_elan_moves_edges_to_the_nearest_millisecond(tmp_path: Path, labels: Labels) -> None:
    losses = write_labels(tmp_path / "x.eaf", labels, TIMEBASE)
    back = {span.id: span for span in read_labels(tmp_path / "x.eaf").spans}
    moved = 0
    for span in labels.spans:
        if span.id not in back:
            assert round(span.end_s * 1000) <= 0
            continue
        start_s, end_s = max(span.start_s, 0.0), span.end_s
        short = round(end_s * 1000) == round(start_s * 1000)
        assert abs(back[span.id].start_s - start_s) <= 0.0005 + 1e-9
        assert abs(back[span.id].end_s - end_s) <= (0.0015 if short else 0.0005) + 1e-9
        off_s = max(abs(back[span.id].start_s - span.start_s), abs(back[span.id].end_s - end_s))
        moved += off_s > 2e-9
    if moved and not losses:
        pytest.fail("edges moved and nothing was said")
    early = sum(loss.count for loss in losses if loss.what == "spans")
    assert early == len(labels.spans) - len(back)


ORDER = [
    "LICENSE", "HEADER", "TIME_ORDER", "TIER", "LINGUISTIC_TYPE", "LOCALE", "LANGUAGE",
    "CONSTRAINT", "CONTROLLED_VOCABULARY", "LEXICON_REF", "EXTERNAL_REF",
]  # fmt: skip


@given(labels=any_labels(milliseconds_s))
@few
def test_elan_documents_follow_the_schema(tmp_path: Path, labels: Labels) -> None:
    write_labels(tmp_path / "x.eaf", labels, TIMEBASE, media=tmp_path / "v" / "a b.mp4")
    document = ElementTree.parse(tmp_path / "x.eaf").getroot()
    assert (document.tag, document.get("FORMAT")) == ("ANNOTATION_DOCUMENT", "3.0")
    places = [ORDER.index(child.tag) for child in document]
    assert places == sorted(places)
    media = document.find("HEADER/MEDIA_DESCRIPTOR")
    assert media is not None
    assert media.get("RELATIVE_MEDIA_URL") == "./v/a%20b.mp4"
    assert media.get("MEDIA_URL") == (tmp_path.resolve() / "v" / "a b.mp4").as_uri()
    slots = {s.get("TIME_SLOT_ID"): int(s.get("TIME_VALUE", "")) for s in document[1]}
    assert list(slots.values()) == sorted(slots.values())
    tiers = {tier.get("TIER_ID"): tier for tier in document.iter("TIER")}
    assert len(tiers) == len(list(document.iter("TIER")))
    kinds = {k.get("LINGUISTIC_TYPE_ID"): k for k in document.iter("LINGUISTIC_TYPE")}
    vocabularies = {v.get("CV_ID") for v in document.iter("CONTROLLED_VOCABULARY")}
    entries = {one.get("CVE_ID"): one.findtext("CVE_VALUE") for one in document.iter("CV_ENTRY_ML")}
    ids: list[str] = []
    for tier in tiers.values():
        kind = kinds[tier.get("LINGUISTIC_TYPE_REF")]
        parent = tier.get("PARENT_REF")
        assert (parent is None) == (kind.get("TIME_ALIGNABLE") == "true")
        if parent is None:
            assert kind.get("CONTROLLED_VOCABULARY_REF") in vocabularies
        about = {a[0].get("ANNOTATION_ID") for a in tiers[parent]} if parent else set()
        reached = 0
        for (annotation,) in tier:
            ids.append(annotation.get("ANNOTATION_ID", ""))
            if parent is not None:
                assert annotation.get("ANNOTATION_REF") in about
                continue
            start, end = (slots[annotation.get(f"TIME_SLOT_REF{k}")] for k in (1, 2))
            assert reached <= start < end
            entry = annotation.get("CVE_REF")
            assert entry is None or entries[entry] == annotation.findtext("ANNOTATION_VALUE")
            known = annotation.findtext("ANNOTATION_VALUE") in entries.values()
            assert known == (entry is not None)
            reached = end
    assert len(set(ids)) == len(ids)
    last = document.findtext("HEADER/PROPERTY[@NAME='lastUsedAnnotationId']") or "0"
    assert max((int(one[1:]) for one in ids), default=0) <= int(last)


FOREIGN_EAF = """<?xml version="1.0" encoding="UTF-8"?>
<ANNOTATION_DOCUMENT AUTHOR="" DATE="2020-01-01T00:00:00+00:00" FORMAT="2.7" VERSION="2.7">
  <HEADER MEDIA_FILE="" TIME_UNITS="milliseconds">
    <MEDIA_DESCRIPTOR MEDIA_URL="file:///v.mp4" MIME_TYPE="video/mp4" TIME_ORIGIN="250"/>
  </HEADER>
  <TIME_ORDER>
    <TIME_SLOT TIME_SLOT_ID="ts1" TIME_VALUE="500"/><TIME_SLOT TIME_SLOT_ID="ts2" TIME_VALUE="900"/>
  </TIME_ORDER>
  <TIER LINGUISTIC_TYPE_REF="gloss" TIER_ID="Right hand" ANNOTATOR="Ada">
    <ANNOTATION><ALIGNABLE_ANNOTATION ANNOTATION_ID="a5" TIME_SLOT_REF1="ts1" TIME_SLOT_REF2="ts2">
      <ANNOTATION_VALUE>HOUSE</ANNOTATION_VALUE></ALIGNABLE_ANNOTATION></ANNOTATION>
  </TIER>
  <TIER LINGUISTIC_TYPE_REF="meaning" PARENT_REF="Right hand" TIER_ID="English">
    <ANNOTATION><REF_ANNOTATION ANNOTATION_ID="a6" ANNOTATION_REF="a5">
      <ANNOTATION_VALUE>a house</ANNOTATION_VALUE></REF_ANNOTATION></ANNOTATION>
  </TIER>
  <LINGUISTIC_TYPE LINGUISTIC_TYPE_ID="gloss" TIME_ALIGNABLE="true"
    CONTROLLED_VOCABULARY_REF="signs"/>
  <LINGUISTIC_TYPE LINGUISTIC_TYPE_ID="meaning" CONSTRAINTS="Symbolic_Association"/>
  <CONTROLLED_VOCABULARY CV_ID="signs">
    <CV_ENTRY DESCRIPTION="a building">HOUSE</CV_ENTRY>
  </CONTROLLED_VOCABULARY>
</ANNOTATION_DOCUMENT>
"""


def test_elan_files_of_others(tmp_path: Path) -> None:
    labels = read_labels(written(tmp_path, "x.eaf", FOREIGN_EAF))
    assert labels.tracks == (LabelTrack("Right hand"),)
    assert labels.spans == (
        Span(*(5, "Right hand", 0.75, 1.15, "HOUSE", "English: a house", "Ada", None, "import")),
    )
    assert labels.label_set.name == "signs"
    assert [(one.name, one.gesture_class) for one in labels.label_set.labels] == [
        ("HOUSE", "a building")
    ]


def test_elan_keeps_spans_shorter_than_a_millisecond_apart(tmp_path: Path) -> None:
    spans = (Span(1, "Gestures", 1.0, 1.0002, "a"), Span(2, "Gestures", 1.0002, 1.5, "b"))
    assert [edges_ms(span) for span in spans] == [(1000, 1001), (1000, 1500)]
    losses = write_labels(tmp_path / "x.eaf", Labels(spans=spans), TIMEBASE)
    back = read_labels(tmp_path / "x.eaf")
    assert extents(back) == [("Gestures", "a", 1.0, 1.001), ("Gestures", "b", 1.0, 1.5)]
    assert [str(one) for one in losses] == [
        "ELAN counts whole milliseconds: edges of 2 spans moved by up to 0.8 ms"
    ]


# Praat.

SHORT = """File type = "ooTextFile"
Object class = "TextGrid"

0
3
<exists>
2
"IntervalTier"
"Hände"
0
3
3
0
0.5
""
0.5
1.5
"say ""so"" ! 5"
1.5
3
""
"TextTier"
"Marks"
0
3
1
2
"tap"
"""


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize("suffix", ["TextGrid", "textgrid", "txt"])
def test_short_textgrids(tmp_path: Path, encoding: str, suffix: str) -> None:
    labels = read_labels(written(tmp_path, f"x.{suffix}", SHORT, encoding), TIMEBASE)
    assert extents(labels) == [
        ("Hände", 'say "so" ! 5', 0.5, 1.5),
        ("Marks", "tap", 2.0, pytest.approx(2.1)),
    ]


def test_big_endian_textgrids_with_windows_line_ends(tmp_path: Path) -> None:
    write_labels(tmp_path / "x.TextGrid", OVERLAPPING, TIMEBASE)
    text = (tmp_path / "x.TextGrid").read_text(encoding="utf-8").replace("\n", "\r\n")
    path = written(tmp_path, "y.TextGrid", f"\ufeff{text}", "utf-16-be")
    assert extents(read_labels(path)) == extents(OVERLAPPING)


# BORIS.


def test_a_boris_project_has_paired_state_events(tmp_path: Path) -> None:
    write_labels(tmp_path / "x.boris", OVERLAPPING, TIMEBASE, media=tmp_path / "v" / "a.mp4")
    content = (tmp_path / "x.boris").read_bytes()
    assert content.isascii()
    project = json.loads(content)
    observation = project["observations"]["x"]
    assert observation["file"]["1"] == ["v/a.mp4"]
    codes = {one["code"] for one in project["behaviors_conf"].values()}
    subjects = {one["name"] for one in project["subjects_conf"].values()}
    running: set[tuple[str, str]] = set()
    times = [event[0] for event in observation["events"]]
    assert times == sorted(times)
    for time_s, subject, code, modifiers, _, frame in observation["events"]:
        assert (subject in subjects, code in codes, modifiers) == (True, True, "")
        assert frame == TIMEBASE.frame_at(time_s)
        running ^= {(subject, code)}
    assert not running


def test_boris_projects_of_others(tmp_path: Path) -> None:
    events = [
        [0.5, "Ada", "wave", "left", "first"],
        [1.0, "", "tap", "", ""],
        [1.5, "Ada", "wave", "left", "last"],
    ]
    project = {
        "project_format_version": "7.0",
        "subjects_conf": {"0": {"key": "", "name": "Ada"}, "1": {"key": "", "name": "Bob"}},
        "behaviors_conf": {
            "0": {"type": "State event", "key": "w", "code": "wave", "category": "swipes"},
            "1": {"type": "Point event", "key": "t", "code": "tap", "color": "#FF0000"},
        },
        "observations": {"one": {"events": events}, "two": {"events": []}},
    }
    path = written(tmp_path, "x.boris", json.dumps(project))
    labels = read_labels(path, TIMEBASE, observation="one")
    assert labels.tracks == (LabelTrack("Ada"), LabelTrack("No focal subject"))
    assert extents(labels) == [
        ("Ada", "wave", 0.5, 1.5),
        ("No focal subject", "tap", 1.0, pytest.approx(1.1)),
    ]
    assert labels.spans[0].note == "left\nfirst\nlast"
    assert [(one.name, one.key, one.gesture_class) for one in labels.label_set.labels] == [
        ("wave", "w", "swipes"),
        ("tap", "t", ""),
    ]
    assert read_labels(path, observation="two").spans == ()


# MNE.


@pytest.mark.parametrize(
    "content",
    [
        "# MNE-Annotations\n# orig_time : 2002-12-03 19:01:11\n# onset, duration, description\n"
        "0.5,1.0,100%25 wave\n",
        "0.5,1.0,100%25 wave\n",
        "# onset, duration, description, ch_names\n0.5,1.0,100%25 wave,C3\n",
        "0.5,1.0,100%25 wave,C3\n",
    ],
)
def test_mne_files_of_others(tmp_path: Path, content: str) -> None:
    labels = read_labels(written(tmp_path, "x.txt", content))
    assert extents(labels) == [("Gestures", "100%25 wave", 0.5, 1.5)]


# Independent readers of our files.


@given(labels=any_labels(milliseconds_s))
@few
def test_pympi_reads_the_same(tmp_path: Path, labels: Labels) -> None:
    elan = pytest.importorskip("pympi.Elan")
    write_labels(tmp_path / "x.eaf", labels, TIMEBASE, "elan")
    document = elan.Eaf(str(tmp_path / "x.eaf"), suppress_version_warning=True)
    for lane in lanes_of(labels, edges_ms):
        found = document.get_annotation_data_for_tier(lane.name)
        assert sorted(one[:3] for one in found) == sorted(
            (*edges_ms(span), span.label) for span in lane.spans
        )


@given(labels=any_labels(milliseconds_s))  # praatio closes gaps that are shorter
@few
def test_praatio_reads_the_same(tmp_path: Path, labels: Labels) -> None:
    praatio = pytest.importorskip("praatio.textgrid")
    write_labels(tmp_path / "x.TextGrid", labels, TIMEBASE, "textgrid")
    grid = praatio.openTextgrid(str(tmp_path / "x.TextGrid"), includeEmptyIntervals=False)
    lanes = lanes_of(labels, lambda span: (span.start_s, span.end_s))
    assert len(grid.tiers) == len(lanes)
    for lane, tier in zip(lanes, grid.tiers, strict=True):
        # It strips labels.
        assert [tuple(one) for one in tier.entries] == [
            (span.start_s, span.end_s, span.label.strip()) for span in lane.spans
        ]


def test_mne_reads_the_same(tmp_path: Path) -> None:
    mne = pytest.importorskip("mne")
    write_labels(tmp_path / "x.txt", OVERLAPPING, TIMEBASE, "mne")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # without pandas it says that extras are texts
        found = mne.read_annotations(tmp_path / "x.txt")
    assert found.onset.tolist() == [span.start_s for span in OVERLAPPING.spans]
    assert found.duration.tolist() == [span.duration_s for span in OVERLAPPING.spans]
    assert list(found.description) == ["say %22so%22", "wave", "tap", "wave"]
    assert [str(one["id"]) for one in found.extras] == ["1", "2", "3", "4"]


# The table in the documentation.


def test_the_documentation_says_what_each_format_keeps() -> None:
    documentation = Path(__file__).parents[3] / "docs" / "formats.md"
    text = documentation.read_text(encoding="utf-8")
    for one in FORMATS:
        aspects = (
            *("tracks", "overlap", "empty tracks", "ids", "notes", "authors"),
            *("confidence", "origin", "persons", "label set", "colours and keys"),
        )
        kept = [aspect for aspect in aspects if aspect in one.keeps]
        said = "all" if len(kept) == len(aspects) else ", ".join(kept) or "–"
        step = "exact" if one.resolution_s == 0 else f"{one.resolution_s * 1000:g} ms"
        assert f"| {one.title} (`{one.name}`) | {said} | {step} |" in text
