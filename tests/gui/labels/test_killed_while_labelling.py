"""A window is killed while somebody labels: the edit in progress is all that may be lost."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from sd2core.recording.recording import Recording

TESTS = Path(__file__).resolve().parents[2]


def killed(small_recording: Path, tmp_path: Path, kills: int) -> int:
    """Edits that were seen between so many kills."""
    made = Recording.create(tmp_path / "ball.sd2", mesh=small_recording / "mesh.npz")
    done = subprocess.run(
        [sys.executable, str(TESTS / "labelled_until_killed.py"), str(made.folder), str(kills)],
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": f"{TESTS.parent}{os.pathsep}{TESTS.parent / 'app'}"},
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    count, _, edits, *_ = done.stdout.split()
    assert int(count) == kills
    return int(edits)


@pytest.mark.skipif(sys.platform != "linux", reason="forks processes that open a window")
class TestKilled:
    @pytest.mark.slow
    def test_a_few_times(self, compiled_kernels, small_recording, tmp_path: Path) -> None:
        assert killed(small_recording, tmp_path, 4) > 4

    @pytest.mark.slow
    @pytest.mark.timeout(1200)
    def test_a_hundred_times(self, compiled_kernels, small_recording, tmp_path: Path) -> None:
        assert killed(small_recording, tmp_path, 100) > 200
