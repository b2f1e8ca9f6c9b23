"""Labels on pairs that are there: by take, by time, by pattern; and nothing by half."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from small_pairs import write_pairs

from sd2core.classify.data import clips_of_pairs
from sd2core.cli import build_parser, run
from sd2core.errors import Sd2Error
from sd2core.pairs.labelling import TakeLabel, label_pairs, read_take_labels
from sd2core.pairs.store import read_pairs


@pytest.fixture
def pairs(tmp_path: Path) -> Path:
    return write_pairs(tmp_path / "pairs.zarr")


def test_whole_takes_and_parts_of_them(pairs: Path) -> None:
    before = read_pairs(pairs)
    first = before.takes[0]
    halfway_s = float(first.times_s[len(first.times_s) // 2])
    rows = [
        TakeLabel("*", "*", "walk"),
        TakeLabel(first.subject, first.name, "turn", start_s=halfway_s),
    ]
    counts = label_pairs(pairs, rows)
    after = read_pairs(pairs)
    assert after.labels == (*before.labels, "walk", "turn")
    for take in after.takes:
        turned = (take.times_s >= halfway_s) & (take.key[:2] == first.key[:2])
        named = np.array(after.labels)[take.label]
        assert (named == np.where(turned, "turn", "walk")).all()
        np.testing.assert_array_equal(take.radar, next(
            one.radar for one in before.takes if one.key == take.key
        ))  # fmt: skip
    assert sum(counts.values()) == before.frames
    assert set(clips_of_pairs(after, after.kind).classes) >= {"walk", "turn"}
    assert label_pairs(pairs, [TakeLabel("*", "*", "walk")]) == {"walk": before.frames}


def test_what_two_persons_do_at_once_is_neither(pairs: Path) -> None:
    rows = [
        TakeLabel("*", "*", "walk", end_s=1.0, person="anna"),
        TakeLabel("*", "*", "turn", start_s=0.5, end_s=1.5, person="ben"),
        TakeLabel("*", "*", "stop", start_s=1.25),
    ]
    counts = label_pairs(pairs, rows)
    after = read_pairs(pairs)
    assert sum(counts.values()) == sum(int((take.label >= 0).sum()) for take in after.takes)
    for take in after.takes:
        named = np.array([*after.labels, "neither"])[take.label]
        edges = np.searchsorted([0.5, 1.0, 1.25], take.times_s, side="right")
        np.testing.assert_array_equal(named, np.array(["walk", "neither", "turn", "stop"])[edges])


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_a_table_is_read_with_its_gaps(tmp_path: Path, separator: str) -> None:
    table = tmp_path / "table.csv"
    heading, rows = "Subject, take, label, start_s, end_s\n", "1,*-01,squat,,\n1,*-02,lunge,1.5,2\n"
    table.write_text((heading + rows).replace(",", separator))
    assert read_take_labels(table) == [
        TakeLabel("1", "*-01", "squat"),
        TakeLabel("1", "*-02", "lunge", 1.5, 2.0),
    ]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("subject,label\n1,a\n", "no column take"),
        ("subject,take,label\n", "no row"),
        ("subject,take,label,start_s\n1,a,b,soon\n", "line 2"),
        ("subject,take,label,start_s,end_s\n1,a,b,2,1\n", "line 2.*start before the end"),
        ("subject,take,label\n1,a,\n", "line 2"),
        ("subject,take,label\n1,a,b,c\n", "line 2"),
        ("subject,take,label,label\n1,a,b,c\n", "each column once"),
        ("subject,take,label\n1,a," + 200_000 * "b" + "\n", "cannot be read .*limit"),
        (
            "subject,take,label,start,end\n1,a,b,1,2\n",
            "has the columns .*start, end.*start_s and end_s",
        ),
        ("subject,take,label,start_ms,end_ms\n1,a,b,1,2\n", "has the columns .*start_ms"),
    ],
)
def test_a_table_that_cannot_be_is_named(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "table.csv").write_text(text)
    with pytest.raises(Sd2Error, match=said):
        read_take_labels(tmp_path / "table.csv")


def test_a_row_of_no_take_changes_nothing(pairs: Path) -> None:
    before = read_pairs(pairs)
    with pytest.raises(Sd2Error, match="no take nobody"):
        label_pairs(pairs, [TakeLabel("*", "*", "walk"), TakeLabel("nobody", "x", "turn")])
    after = read_pairs(pairs)
    assert after.labels == before.labels
    for one, other in zip(before.takes, after.takes, strict=True):
        np.testing.assert_array_equal(one.label, other.label)


def test_label_files_are_of_the_clock_of_their_take(
    pairs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    take = read_pairs(pairs).takes[0]
    (tmp_path / "a.csv").write_text("label,start_s,end_s\nwave,0.1,0.3\n")
    words = f"{take.subject}/{take.name}={tmp_path / 'a.csv'}"
    assert run(build_parser()[0], ["pairs", "label", str(pairs), "--take", words]) == 0
    found = read_pairs(pairs)
    waved = found.takes[0].label == found.labels.index("wave")
    assert (waved == ((take.times_s >= 0.1) & (take.times_s < 0.3))).all()
    assert "wave" in capsys.readouterr().out
    assert run(build_parser()[0], ["pairs", "label", str(pairs)]) == 1
    assert "no labels" in capsys.readouterr().err
