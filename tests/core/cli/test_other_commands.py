"""``sd2 simulate`` and ``sd2 warm-up`` hand over what they are told."""

from __future__ import annotations

from pathlib import Path

import pytest
from cli_outcome import Sd2

from sd2core.progress import Progress


@pytest.mark.parametrize(
    ("command", "function", "name"),
    [
        ("sample", "sd2core.simulate.sample.make_sample", "mine.sd2"),
        ("export-body", "sd2core.simulate.export_body.export_body", "body.npz"),
    ],
)
def test_simulate(
    sd2: Sd2,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    command: str,
    function: str,
    name: str,
) -> None:
    asked: list[Path] = []

    def make(out: Path, progress: Progress) -> Path:
        progress(0, 2)
        asked.append(out)
        return out

    monkeypatch.setattr(function, make)
    outcome = sd2("simulate", command, tmp_path / name)
    assert outcome.code == 0
    assert asked == [tmp_path / name]
    assert str(tmp_path / name) in outcome.out


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
