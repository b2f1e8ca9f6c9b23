"""Make the program in one folder from a checkout, on Linux, Windows or macOS, and start it once.

``python app/packaging/make_bundle.py`` with Python 3.11 or newer: installs what is pinned into an
environment of its own (a connection is needed), runs the recipe, and draws a window.
"""

from __future__ import annotations

import os
import subprocess
import sys
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = ROOT / "build" / "bundle-environment"
FOLDER = ROOT / "dist" / "sd2-studio"


def call(*command: object) -> None:
    """Run a program in the checkout; end with its exit code if it fails."""
    words = [str(part) for part in command]
    print(">", *words, flush=True)
    code = subprocess.run(words, cwd=ROOT, check=False).returncode
    if code:
        sys.exit(code)


def main() -> None:
    """Install, make, start."""
    venv.create(ENVIRONMENT, with_pip=True, clear=True)
    python = ENVIRONMENT / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    call(python, "-m", "pip", "install", "--constraint", "constraints.txt", ".", "pyinstaller")
    work = ("--noconfirm", "--workpath", "build/bundle")
    call(python, "-m", "PyInstaller", *work, "app/packaging/sd2-studio.spec")
    call(FOLDER / "sd2", "demo", "--screenshot", FOLDER.parent / "bundle.png")
    files = (path for path in FOLDER.rglob("*") if path.is_file() and not path.is_symlink())
    total = sum(path.stat().st_size for path in files)
    print(f"{FOLDER} holds {total / 1e9:.1f} GB; look at {FOLDER.parent / 'bundle.png'}")


if __name__ == "__main__":
    main()
