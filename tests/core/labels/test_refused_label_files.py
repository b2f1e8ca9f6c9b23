"""Files that are no labels, or not certainly these: each is refused with a sentence."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.files.limits import VARIABLE
from sd2core.labels.formats import FORMATS, read_labels, write_labels
from sd2core.labels.spans import Labels, Span
from sd2core.timebase import Timebase

TIMEBASE = Timebase.regular(30, 10.0)
NAMES = [one.name for one in FORMATS if one.name != "sd2"]  # which has tests of its own
SOME = Labels(spans=(Span(1, "Gestures", 0.5, 1.5, "wave"), Span(2, "Gestures", 2, 2.5, "tap")))


def refusal(path: Path, content: bytes | str, format: str | None = None) -> str:
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    with pytest.raises(Sd2Error) as caught:
        read_labels(path, format=format)
    assert str(path) in str(caught.value)
    assert caught.value.expected
    return str(caught.value)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("content", [b"", b" \n\n", b"\xef\xbb\xbf \n"])
def test_empty(tmp_path: Path, name: str, content: bytes) -> None:
    sentence = refusal(tmp_path / "x", content, name)
    assert "is empty" in sentence or "not whole XML" in sentence


@pytest.mark.parametrize("name", NAMES)
def test_missing_or_a_folder(tmp_path: Path, name: str) -> None:
    with pytest.raises(Sd2Error, match="does not exist"):
        read_labels(tmp_path / "x", format=name)
    with pytest.raises(Sd2Error, match="is a folder"):
        read_labels(tmp_path, format=name)


@pytest.mark.parametrize("name", NAMES)
def test_too_large(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "0.032")
    assert "has 2 MB" in refusal(tmp_path / "x", b"x" * 2_000_000, name)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    "content", [b"\x89PNG\r\n\x1a\n\0\0\0", b"\xff\xfe\xfa", "wört".encode("latin-1"), b"a\0b\0"]
)
def test_no_text(tmp_path: Path, name: str, content: bytes) -> None:
    sentence = refusal(tmp_path / "x", content, name)
    assert "UTF-" in sentence or "not whole XML" in sentence or "zero bytes" in sentence


@pytest.mark.parametrize("other", NAMES)
@pytest.mark.parametrize("name", NAMES)
def test_a_file_of_another_format(tmp_path: Path, name: str, other: str) -> None:
    path = tmp_path / "x"
    write_labels(path, SOME, TIMEBASE, other)
    if name == other:
        assert len(read_labels(path, format=name).spans) == 2
    else:
        refusal(path, path.read_bytes(), name)


@pytest.mark.parametrize("name", ["elan", "textgrid", "boris"])
def test_cut_short_anywhere(tmp_path: Path, name: str) -> None:
    path = tmp_path / "x"
    write_labels(path, SOME, TIMEBASE, name)
    whole = path.read_bytes().rstrip()
    for length in range(1, len(whole) - 3, 97):
        refusal(path, whole[:length], name)


@pytest.mark.parametrize("name", NAMES)
@given(
    place=st.floats(0, 1),
    length=st.integers(0, 40),
    other=st.binary(max_size=4)
    | st.sampled_from((b"-1", b"9" * 30, b'"', b"null", b"<a>", b"1e9")),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_damaged_file_is_labels_or_a_sentence(
    tmp_path: Path, name: str, place: float, length: int, other: bytes
) -> None:
    path = tmp_path / "x"
    write_labels(path, SOME, TIMEBASE, name)
    whole = path.read_bytes()
    start = int(place * len(whole))
    path.write_bytes(whole[:start] + other + whole[start + length :])
    sentence = str(path)
    try:
        read_labels(path, TIMEBASE, name)
    except Sd2Error as error:  # and no other
        sentence = str(error)
    assert str(path) in sentence


@pytest.mark.parametrize(
    "declaration",
    [
        "<!DOCTYPE ANNOTATION_DOCUMENT>",
        '<!DOCTYPE d [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]>',
        '<!DOCTYPE d [<!ENTITY x SYSTEM "file:///etc/passwd">]>',
        '<!DOCTYPE d SYSTEM "http://localhost/d.dtd">',
    ],
)
def test_hostile_xml(tmp_path: Path, declaration: str) -> None:
    content = f'<?xml version="1.0"?>{declaration}<ANNOTATION_DOCUMENT/>'
    sentence = refusal(tmp_path / "x.eaf", content)
    assert "declares a document type or entities" in sentence
    assert "save it again" in sentence


def test_a_heading_may_be_longer_than_a_field_is_by_default(tmp_path: Path) -> None:
    limit = csv.field_size_limit(131_072)
    assert "a heading" in refusal(tmp_path / "x.tsv", f"label\t{'[' * 140_000}\n")
    assert csv.field_size_limit(limit) > 140_000


def test_deeply_nested_files_do_not_end_the_program(tmp_path: Path) -> None:
    assert "nested too deeply" in refusal(tmp_path / "x.boris", "[" * 200_000)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("<list/>", "root is 'list'"),
        ('<ANNOTATION_DOCUMENT><HEADER TIME_UNITS="PAL-frames"/></ANNOTATION_DOCUMENT>', "PAL"),
        (
            '<ANNOTATION_DOCUMENT><TIER TIER_ID="t"><ANNOTATION><ALIGNABLE_ANNOTATION '
            'ANNOTATION_ID="a1" TIME_SLOT_REF1="ts1" TIME_SLOT_REF2="ts2"/></ANNOTATION></TIER>'
            "</ANNOTATION_DOCUMENT>",
            "annotation a1: the time slot 'ts1' has no time",
        ),
    ],
)
def test_elan(tmp_path: Path, content: str, words: str) -> None:
    assert words in refusal(tmp_path / "x.eaf", content)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("a,b,c\n1,2,3\n", "names label, start_s and end_s"),
        ("Subject,Behavior,Behavior type,Time\nx,y,START,1\n", "export aggregated events"),
        ("label,start_s,end_s\nwave,0,5,1,5\n", "Decimal commas in a table separated by commas?"),
        ("label;start_s;end_s\nwave;0,5\n", "has 2 columns, its heading 3"),
        ("label;start_s;end_s\nwave;0,5;1.5\n", "'0,5' as well as '1.5'"),
        ("label;start_s;end_s\nwave;1,500;2,250\n", "thousands or a decimal comma?"),
        ("label,start_s,end_s\nwave,0:0:0:1,2\n", "line 2: start_s is '0:0:0:1'"),
        ("label,start_s,end_s\nwave,1,nan\n", "end_s is 'nan'"),
        ("label,start_s,end_s\nwave,1,1e999\n", "a finite number"),
        ("label,start_s,end_s\nwave,2,1\n", "ends before it has begun"),
        ("label,start_s,end_s\nwave,1,1\n", "has no duration"),
        ('label,start_s,end_s\n"wave,1,2\n', "quotation marks are closed"),
        ("label,start_s,end_s,label\nwave,1,2,x\n", "two columns 'label'"),
        ("label,start_s,end_s,confidence\nwave,1,2,3\n", "has the confidence 3.0"),
        ("label,start_frame,end_frame\nwave,1,2\n", "gives frames and no seconds"),
        (
            "observation id,behavior,start (s),stop (s)\na,wave,1,2\nb,wave,1,2\n",
            "has 2 observations: 'a', 'b'",
        ),
    ],
)
def test_tables(tmp_path: Path, content: str, words: str) -> None:
    assert words in refusal(tmp_path / "x.csv", content)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("3,31", "up to frame 31, exclusive"),
        ("5,5", "from frame 5 up to frame 5"),
        ("-1,5", "start_frame is '-1'"),
        ("1.5,5", "start_frame is '1.5'"),
    ],
)
def test_frames_that_are_none(tmp_path: Path, row: str, words: str) -> None:
    path = tmp_path / "x.csv"
    path.write_text(f"label,start_frame,end_frame\nwave,{row}\n", encoding="utf-8")
    with pytest.raises(Sd2Error) as caught:
        read_labels(path, TIMEBASE)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("1.0\t2.0\twave\nfoo\n", "line 2 is 'foo'"),
        ("2.0\t1.0\twave\n", "ends before it has begun"),
        ("1.0\t1.0\twave\n", "Read the file together with its recording"),
        ("just words\n", "begins with 'just words'"),
        ("# shopping\n1,2,3\n", "begins with '# shopping'"),
        ("# MNE-Annotations\n1,2\n", "has 2 columns"),
        ("# onset, duration, description\n1,2,a,b\n", "has 4 columns"),
        ("# onset, duration, description\n2001-01-01,2,a\n", "onset is '2001-01-01'"),
    ],
)
def test_lines(tmp_path: Path, content: str, words: str) -> None:
    assert words in refusal(tmp_path / "x.txt", content)


HEAD = 'File type = "ooTextFile"\nObject class = "TextGrid"\n0 1 <exists> 1\n'


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ('File type = "ooTextFile"\nObject class = "Pitch"\n', "holds a 'Pitch'"),
        ("ooBinaryFile\x08TextGrid", "is a binary file of Praat"),
        ('"Praat chronological TextGrid text file"\n0 1\n', "chronological"),
        (HEAD + '"IntervalTier" "t" 0 1 1 0 1', "ends before the text of an interval"),
        (HEAD + '"PitchTier" "t" 0 1 0', "class 'PitchTier'"),
        (HEAD + '"IntervalTier" 5', "has '5' where the name of a tier should be"),
        (HEAD + '"IntervalTier" "t" 0 1 1 1 0 "x"', "ends before it has begun"),
        (HEAD + '"IntervalTier" "t" 0 1 1.5', "'1.5' intervals"),
        (HEAD + '"IntervalTier" "t" 0 1e999 1', "'1e999' for the xmax"),
    ],
)
def test_textgrids(tmp_path: Path, content: str, words: str) -> None:
    assert words in refusal(tmp_path / "x.TextGrid", content)


def project(events: object, **more: object) -> str:
    return json.dumps({"observations": {"one": {"events": events}, **more}})


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("[]", "JSON without observations"),
        (project([], two={}), "has 2 observations: 'one', 'two'"),
        (json.dumps({"observations": {}}), "has 0 observations: none"),
        (project(None), "has no events"),
        (project([[1, "", "wave", "", ""]]), "begins at 1 s and does not end"),
        (project([[1]]), "event 1 is '[1]'"),
        (project([["now", "", "wave", "", ""]]), "the time is 'now'"),
    ],
)
def test_boris(tmp_path: Path, content: str, words: str) -> None:
    assert words in refusal(tmp_path / "x.boris", content)


def test_names_of_files_and_formats(tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match=r"has the suffix '\.xls'.*Rename the file"):
        read_labels(tmp_path / "x.xls")
    with pytest.raises(Sd2Error, match="could be a file for Audacity or MNE"):
        write_labels(tmp_path / "x.txt", SOME, TIMEBASE)
    with pytest.raises(Sd2Error, match=r"'xml' is not known.*one of sd2, csv, audacity"):
        read_labels(tmp_path / "x", format="xml")


def test_elan_has_no_times_beyond_49_days(tmp_path: Path) -> None:
    late = Labels(spans=(Span(1, "Gestures", 0, 4_294_968, "wave"),))
    with pytest.raises(Sd2Error, match=r"up to 4,294,967 s"):
        write_labels(tmp_path / "x.eaf", late, TIMEBASE)
    assert not (tmp_path / "x.eaf").exists()
