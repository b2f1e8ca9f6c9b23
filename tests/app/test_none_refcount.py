"""PySide6 6.12.0 on Python 3.11 loses a reference to ``None`` per call; see pyproject.toml."""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import version

import pytest

CALLS = 200

SCRIPT = f"""
import sys
from PySide6.QtWidgets import QApplication, QWidget

application = QApplication([])
parent = QWidget()
widget = QWidget(parent)
counts = []
for _ in range(3):
    for _ in range({CALLS}):
        widget.update()
        widget.parent()
    counts.append(sys.getrefcount(None))
print(*counts)
"""


def test_pyside_is_older_than_the_leak() -> None:
    major, minor = version("PySide6-Essentials").split(".")[:2]
    assert (int(major), int(minor)) < (6, 12)


@pytest.mark.skipif(sys.version_info >= (3, 12), reason="None is immortal from Python 3.12 on")
def test_calls_lose_no_reference_to_none() -> None:
    # In a process of its own: a count that falls to zero would end this one.
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        env={"QT_QPA_PLATFORM": "offscreen"},
        capture_output=True,
        text=True,
        check=True,
    )
    _, second, third = map(int, done.stdout.split())
    assert abs(third - second) < CALLS // 10
