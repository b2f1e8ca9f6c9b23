"""The program in a folder of its own, made by PyInstaller and started."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.environments import REPOSITORY, assert_shows_a_window, call

RECIPE = REPOSITORY / "app" / "packaging" / "sd2-studio.spec"


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="run on Linux only so far")
def test_the_program_in_a_folder_starts_and_starts_its_own_processes(tmp_path: Path) -> None:
    where = ("--distpath", tmp_path, "--workpath", tmp_path / "build")
    call(sys.executable, "-m", "PyInstaller", "--noconfirm", *where, RECIPE, cwd=tmp_path)
    sd2, away = tmp_path / "sd2-studio" / "sd2", tmp_path / "away"
    away.mkdir()
    # Compiled kernels in a background process, models in another.
    call(sd2, "demo", "--screenshot", "window.png", cwd=away)
    assert_shows_a_window(away / "window.png")
    campaign = ("simulate", "campaign", "pairs.zarr", "--minutes", "0.5", "--processes", "2")
    call(sd2, *campaign, cwd=away)
    training = ("train", "pairs.zarr", "--epochs", "1", "--background", "--out", "run")
    call(sd2, *training, cwd=away)
    assert (away / "run" / "best.safetensors").is_file()
