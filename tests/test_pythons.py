"""The window opens with every Python that is found here and that the program claims to support."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
THIS = f"{sys.version_info[0]}.{sys.version_info[1]}"
CLAIMED = [
    name.rpartition(" ")[2] for name in PROJECT["classifiers"] if "Python :: 3." in name
]  # fmt: skip


def python_of(version: str) -> Path | None:
    """An interpreter of this version that starts."""
    kept = sorted(Path.home().glob(f".pyenv/versions/{version}.*/bin/python{version}"))
    on_path = shutil.which(f"python{version}")
    for path in [*map(Path, [on_path] if on_path else []), *kept]:
        if not subprocess.run([path, "-c", ""], capture_output=True, check=False).returncode:
            return path
    return None


def test_what_is_claimed_is_one_range() -> None:
    assert [f"3.{minor}" for minor in range(11, 11 + len(CLAIMED))] == CLAIMED
    assert PROJECT["requires-python"] == f">={CLAIMED[0]},<3.{11 + len(CLAIMED)}"


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("version", [one for one in CLAIMED if one != THIS])
def test_the_window_opens_on_it(version: str, tmp_path: Path) -> None:
    python = python_of(version)
    if python is None:
        pytest.skip(f"there is no Python {version} here")
    uv = Path(sys.executable).with_name("uv")
    # The window starts without torch, which would be gigabytes here.
    (tmp_path / "without.txt").write_text("torch ; sys_platform == 'none'\n")
    environment = tmp_path / "environment"
    install = ["pip", "install", "--quiet", "--python", environment / "bin" / "python"]
    install += ["--overrides", tmp_path / "without.txt", "--constraints", "constraints.txt", "."]
    for command in (["venv", "--quiet", "--python", python, environment], install):
        subprocess.run([uv, *command], cwd=ROOT, check=True)
    home = os.environ | {"HOME": str(tmp_path), "QT_QPA_PLATFORM": "offscreen"}
    picture = tmp_path / "window.png"
    demo = [environment / "bin" / "sd2", "demo", "--screenshot", picture]
    done = subprocess.run(demo, env=home, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    pixels = np.asarray(Image.open(picture).convert("RGB")).reshape(-1, 3)
    assert len(np.unique(pixels, axis=0)) > 1000  # a map, a video and a body are drawn
