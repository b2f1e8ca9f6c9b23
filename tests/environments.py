"""Virtual environments of their own, and programs called without what leads to the checkout."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np

REPOSITORY = Path(__file__).resolve().parent.parent
MANUAL_PAGES = """
from PySide6.QtGui import QGuiApplication, QImageReader
from sd2app.command_line import full_parser
from sd2app.manual.pages import Manual, manual_folder
manual = Manual(manual_folder(), full_parser)
application = QGuiApplication(["sd2", "-platform", "offscreen"])
assert QImageReader(str(manual_folder() / "images/concepts/aliasing.svg")).canRead()
print(manual_folder(), sum(bool(manual.text(name)) for name in manual.titles))
"""
"""Program that prints where the pages of the manual are, and how many of them it can read."""


def build_wheel(project: Path, into: Path) -> Path:
    """Build the wheel of a project, and return its path."""
    build = (sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", into)
    call(*build, project, cwd=into)
    (built,) = into.glob("*.whl")
    return built


def call(*command: object, cwd: Path) -> str:
    """Run a program without anything that leads to the checkout; return its output."""
    done = _run(*command, cwd=cwd)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def _run(*command: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "SD2_"))
    }
    environment["QT_QPA_PLATFORM"] = ""
    return subprocess.run(
        [str(part) for part in command],
        capture_output=True,
        text=True,
        cwd=cwd,
        env=environment,
        stdin=subprocess.DEVNULL,
        check=False,
    )


def refused(*command: object, cwd: Path) -> str:
    """Run a program that refuses to do something, with code 1; return what it says."""
    done = _run(*command, cwd=cwd)
    assert done.returncode == 1, done.stdout + done.stderr
    return done.stderr


def install(environment: Path, *arguments: object) -> None:
    """Let pip install into an environment."""
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--no-input"]
    python = scripts(environment) / "python"
    call(*pip, "--python", python, "install", "--quiet", *arguments, cwd=environment)


def scripts(environment: Path) -> Path:
    """Folder of an environment's programs."""
    return environment / ("Scripts" if os.name == "nt" else "bin")


def site_packages(environment: Path) -> Path:
    """Folder of an environment's packages."""
    variables = {"base": str(environment), "platbase": str(environment)}
    return Path(sysconfig.get_path("purelib", "venv", variables))


def assert_shows_a_window(picture: Path) -> None:
    """Check that a picture is that of a window with something in it."""
    import av

    with av.open(str(picture)) as container:
        pixels = next(container.decode(video=0)).to_ndarray(format="rgb24")
    height, width, _ = pixels.shape
    assert width >= 800
    assert height >= 600
    # Heatmap, video and scene are full of colours; an empty window has a few.
    assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 500
