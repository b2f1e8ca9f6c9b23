"""``python -m sd2core.cli`` and ``sd2 warm-up``."""

from __future__ import annotations

import subprocess
import sys

import pytest
from cli_outcome import Sd2

from sd2core.progress import Progress


def test_the_module_runs_the_librarys_commands() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "sd2core.cli", "simulate", "--help"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "campaign" in done.stdout


def test_warm_up(sd2: Sd2, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[Progress] = []
    monkeypatch.setattr("sd2core.numerics.compiled.warm_up", calls.append)
    assert sd2("warm-up").code == 0
    assert len(calls) == 1
