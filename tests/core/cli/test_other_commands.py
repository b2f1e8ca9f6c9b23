"""``python -m sd2core.cli`` and ``sd2 doctor --warm-up``."""

from __future__ import annotations

import subprocess
import sys

import pytest
from cli_outcome import Sd2

from sd2core.cli.parser import build_parser
from sd2core.progress import Progress


def test_the_module_runs_the_librarys_commands() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "sd2core.cli", "simulate", "--help"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "campaign" in done.stdout


def test_kernels_are_compiled(sd2: Sd2, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[Progress] = []
    monkeypatch.setattr("sd2core.numerics.compiled.warm_up", calls.append)
    done = sd2("doctor", "--warm-up")
    assert (done.code, done.out, done.err) == (0, "", "")
    older = sd2("warm-up")
    assert (older.code, older.out, older.err.count("\n")) == (0, "", 1)
    assert "`sd2 doctor --warm-up`" in older.err
    assert "`sd2 doctor --warm-up`" in sd2("warm-up", "--help").out
    assert len(calls) == 2


def test_a_command_that_is_typed_is_loaded_alone() -> None:
    _, commands = build_parser()
    for name in commands.choices:
        _, alone = build_parser(typed=[name, "--help"])
        assert name in alone.choices
        assert len(alone.choices) < 4
    for words in ([], ["--help"], ["synht"]):
        assert build_parser(typed=words)[1].choices.keys() == commands.choices.keys()
