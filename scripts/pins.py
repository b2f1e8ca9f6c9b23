"""Check that what constraints.txt pins is there for every Python and system, or pin anew.

usage: python scripts/pins.py [--update]

Nothing is installed: uv reads what the packages say of themselves. ``--update`` writes
constraints.txt with the newest versions that fit all Pythons at once.
"""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

from install import CONSTRAINTS, ROOT, find_uv, pip_places

PYTHONS = ("3.11.0", "3.12.0", "3.13.0", "3.14.0")
SYSTEMS = ("x86_64-manylinux_2_34", "x86_64-pc-windows-msvc", "aarch64-apple-darwin")
"""Of Linux those with glibc 2.34 or newer: Qt's packages ask for it."""

MACOS = "14.0"
HEADER = """\
# The exact versions that are developed and tested against, for every supported Python and system;
# `make` uses them, `make pins` checks them, `make pins UPDATE=1` writes this file. Users of the
# library are free within the ranges of pyproject.toml.
"""


def main() -> int:
    """Check each Python on each system; 1 if a pinned package is not there for one."""
    uv = find_uv()
    if uv is None:
        print("uv could not be fetched; see build/install.log")
        return 1
    places, cert = pip_places()
    environment = os.environ | {"MACOSX_DEPLOYMENT_TARGET": MACOS}
    environment |= {"SSL_CERT_FILE": cert} if cert else {}
    compile_ = [uv, "pip", "compile", "--quiet", "--no-header", "--no-annotate"]
    compile_ += ["--index-strategy", "unsafe-best-match", *places]
    if "--update" in sys.argv:
        whole = ["--all-extras", "--universal", "--fork-strategy", "fewest", "--upgrade"]
        done = subprocess.run(
            [*compile_, *whole, "--python-version", PYTHONS[0], "pyproject.toml"],
            cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True, check=False,
        )  # fmt: skip
        if not done.returncode:
            pinned = done.stdout.replace("+cpu", "")  # of torch any build
            (ROOT / CONSTRAINTS).write_text(HEADER + pinned, "utf-8")
        return done.returncode

    def check(system: str, python: str) -> str:
        """What uv says against the pinned packages, if anything."""
        asked = ["--python-version", python, "--python-platform", system, "--extra", "dev"]
        asked += ["--only-binary", ":all:", "--constraints", CONSTRAINTS, "pyproject.toml"]
        done = subprocess.run(
            [*compile_, *asked], cwd=ROOT, env=environment, capture_output=True, text=True,
            check=False,
        )  # fmt: skip
        return done.stderr if done.returncode else ""

    cases = [(system, python) for system in SYSTEMS for python in PYTHONS]
    with ThreadPoolExecutor(len(cases)) as pool:
        answers = list(pool.map(lambda case: check(*case), cases))
    for (system, python), against in zip(cases, answers, strict=True):
        print(f"Python {python} on {system}: {against or 'all there'}")
    failed = any(answers)
    if failed:
        print("Pin versions that are there (make pins UPDATE=1), or claim less in pyproject.toml.")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
