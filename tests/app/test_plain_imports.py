"""Python's own imports beside Qt's, each in a fresh interpreter."""

from __future__ import annotations

import subprocess
import sys

PLAIN = """
from sd2app.plain_imports import plain_imports
import builtins
own = builtins.__import__
with plain_imports():
    import PySide6.QtCore
assert builtins.__import__ is own
"""


def test_qt_leaves_pythons_own_import_in_place() -> None:
    subprocess.run([sys.executable, "-c", PLAIN], check=True)
