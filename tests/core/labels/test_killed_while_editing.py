"""A process that edits is killed, a hundred times: the edit in progress is all that may be lost."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parents[2]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="forks, so that a hundred starts take seconds")
def test_a_hundred_kills(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(TESTS / "edited_until_killed.py"), str(tmp_path), "100"],
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": str(TESTS.parent)},
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    kills, _, edits, _ = done.stdout.split()
    assert int(kills) == 100
    assert int(edits) > 60
