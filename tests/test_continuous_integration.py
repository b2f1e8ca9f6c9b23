"""``.ci/run`` says how long each part took, and fails as the part that fails."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """The scripts with a make that does nothing."""
    for name in (".ci", "scripts"):
        shutil.copytree(ROOT / name, tmp_path / name)
    make = tmp_path / "bin" / "make"
    make.parent.mkdir()
    make.write_text('#!/usr/bin/env bash\n[ "$*" != "$FAILING" ] || exit 3\n')
    make.chmod(0o755)
    return tmp_path


@pytest.mark.parametrize(
    ("failing", "code", "parts"),
    [
        ("", 0, ["setup", "pins", "guide", "tests", "lint"]),
        ("setup", 3, ["setup failed (3)"]),
        ("pins", 3, ["setup", "pins failed (3)"]),
        ("docs", 3, ["setup", "pins", "guide failed (3)"]),
        ("test", 3, ["setup", "pins", "guide", "tests failed (3)"]),
        ("lint", 3, ["setup", "pins", "guide", "tests", "lint failed (3)"]),
    ],
)
def test_the_parts_are_timed_and_a_failure_is_one(
    checkout: Path, failing: str, code: int, parts: list[str]
) -> None:
    environment = os.environ | {
        "PATH": f"{checkout / 'bin'}{os.pathsep}{os.environ['PATH']}", "FAILING": failing
    }  # fmt: skip
    done = subprocess.run(
        [checkout / ".ci" / "run"], env=environment, capture_output=True, text=True
    )
    assert done.returncode == code, done.stderr
    _, summary = done.stdout.split("== Times\n")
    found = re.findall(r"^(.*?) +\d+ min \d\d s(?: +(.*))?$", summary, re.MULTILINE)
    assert [" ".join(filter(None, one)) for one in found] == parts
