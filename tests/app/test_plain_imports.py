"""Python's own imports beside Qt's, each in a fresh interpreter."""

from __future__ import annotations

import subprocess
import sys

import pytest

PLAIN = """
from sd2app.plain_imports import imports_of_qt, plain_imports
import builtins
own = builtins.__import__
with plain_imports():
    import PySide6.QtCore
assert builtins.__import__ is own
"""


@pytest.mark.parametrize("module", ["PySide6.QtCore", "qtpy.QtCore"])
def test_all_of_qts_names_are_there_for_who_takes_them_at_once(module: str) -> None:
    star = f"with imports_of_qt():\n    from {module} import *\nassert QEventLoop and QObject\n"
    after = "assert builtins.__import__ is own\n"
    subprocess.run([sys.executable, "-c", PLAIN + star + after], check=True)
