"""``sd2 simulate`` and ``sd2 warm-up`` hand over what they are told."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from cli_outcome import Sd2

from sd2core.progress import Progress


def test_simulate_sample(sd2: Sd2, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Path] = []

    def make(out: Path, progress: Progress) -> Path:
        progress(0, 2)
        asked.append(out)
        return out

    monkeypatch.setattr("sd2core.simulate.sample.make_sample", make)
    outcome = sd2("simulate", "sample", tmp_path / "mine.sd2")
    assert outcome.code == 0
    assert asked == [tmp_path / "mine.sd2"]
    assert str(tmp_path / "mine.sd2") in outcome.out


def test_the_module_runs_the_librarys_commands() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "sd2core.cli", "simulate", "--help"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "campaign" in done.stdout


def test_an_existing_sample_is_not_replaced(sd2: Sd2, tmp_path: Path) -> None:
    (tmp_path / "a.sd2").mkdir()
    (tmp_path / "a.sd2" / "precious").touch()
    outcome = sd2("simulate", "sample", tmp_path / "a.sd2")
    assert outcome.code == 1
    assert [path.name for path in (tmp_path / "a.sd2").iterdir()] == ["precious"]


def test_warm_up(sd2: Sd2, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[Progress] = []
    monkeypatch.setattr("sd2core.numerics.compiled.warm_up", calls.append)
    assert sd2("warm-up").code == 0
    assert len(calls) == 1
