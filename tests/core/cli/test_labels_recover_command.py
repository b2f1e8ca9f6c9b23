"""``sd2 labels recover``: listed, and written to a file."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli_outcome import Sd2
from labelled import even, imported

from sd2core.labels.files import read_labels
from sd2core.labels.recovery import RecoveryPlace, recovery_folder

LABELS = imported(even(), 7)


@pytest.fixture(autouse=True)
def own_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("platformdirs.user_data_dir", lambda *_, **__: str(tmp_path / "data"))


@pytest.fixture
def crashed(tmp_path: Path) -> Path:
    """A recording of which three edits were not saved."""
    path = tmp_path / "walk.sd2"
    place = RecoveryPlace(recovery_folder(), path)
    assert place.take()
    journal = place.begin(LABELS)
    for count in (1, 2, 3):
        journal.write("Delete span", LABELS.with_spans(without=range(1, count + 1)))
    place.release()
    return path


def test_nothing_is_said_to_be_nothing(sd2: Sd2) -> None:
    assert sd2("labels", "recover").out == "There is nothing to recover.\n"


def test_what_is_there_is_listed(sd2: Sd2, crashed: Path) -> None:
    heading, row = sd2("labels", "recover").out.splitlines()
    assert heading.split() == ["until", "edits", "last", "edit", "spans", "recording"]
    assert row.split()[2:] == ["3", "Delete", "span", "9", str(crashed)]
    (known,) = json.loads(sd2("labels", "recover", "--json").out)["recoveries"]
    assert (known["recording"], known["edits"], known["spans"]) == (str(crashed), 3, 9)


def test_it_is_written_and_stays(sd2: Sd2, crashed: Path, tmp_path: Path) -> None:
    out = tmp_path / "found.json"
    for _ in range(2):
        done = sd2("labels", "recover", crashed, "--out", out, "--replace")
        assert done.out == f"Wrote {out} with 9 spans\n"
    assert read_labels(out).labels == LABELS.with_spans(without=(1, 2, 3))
    assert read_labels(out).recording == crashed


def test_what_cannot_be_done_is_said(sd2: Sd2, crashed: Path, tmp_path: Path) -> None:
    for arguments, said in (
        ((tmp_path / "run.sd2", "--out", tmp_path / "a.json"), "nothing to recover of"),
        (("--out", tmp_path / "a.json"), "without REC"),
        ((crashed, "--out", tmp_path / "a.eaf"), "`sd2 labels convert`"),
    ):
        refused = sd2("labels", "recover", *arguments)
        assert refused.code == 1
        assert said in refused.err
    (path,) = recovery_folder().rglob("*.journal")
    path.write_bytes(b"no journal")
    done = sd2("labels", "recover")
    assert "is kept" in done.err
    assert "nothing to recover" in done.out
