"""The program in a folder of its own, made by PyInstaller and started."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from sd2app.command_line import full_parser
from tests.environments import MANUAL_PAGES, REPOSITORY, assert_shows_a_window, call

RECIPE = REPOSITORY / "app" / "packaging" / "sd2-studio.spec"
PICTURE = ("demo", "--screenshot", "window.png")
CAMPAIGN = (
    *("simulate", "campaign", "--out", "pairs.zarr"),
    *("--minutes", "0.5", "--take-seconds", "5", "--workers", "2"),
)
TRAINING = ("train", "pairs.zarr", "--epochs", "1", "--background", "--out", "run")


@pytest.mark.parametrize("words", [PICTURE, CAMPAIGN, TRAINING])
def test_what_the_bundle_is_asked_to_do_is_understood(words: tuple[str, ...]) -> None:
    full_parser().parse_args(words)


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="run on Linux only so far")
def test_the_program_in_a_folder_starts_and_starts_its_own_processes(tmp_path: Path) -> None:
    where = ("--distpath", tmp_path, "--workpath", tmp_path / "build")
    call(sys.executable, "-m", "PyInstaller", "--noconfirm", *where, RECIPE, cwd=tmp_path)
    licences = (tmp_path / "sd2-studio" / "LICENCES.txt").read_text("utf-8")
    assert "x264 (in av" in licences
    assert "Qt 6 (in PySide6" in licences
    sd2, away = tmp_path / "sd2-studio" / "sd2", tmp_path / "away"
    away.mkdir()
    # Compiled kernels in a background process, models in another.
    call(sd2, *PICTURE, cwd=away)
    assert_shows_a_window(away / "window.png")
    folder, pages = call(sd2, "-c", MANUAL_PAGES, cwd=away).split()
    assert Path(folder).is_relative_to(tmp_path)
    assert int(pages) > 80
    call(sd2, *CAMPAIGN, cwd=away)
    call(sd2, *TRAINING, cwd=away)
    assert (away / "run" / "best.safetensors").is_file()
