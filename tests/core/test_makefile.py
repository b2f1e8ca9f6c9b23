"""What ``make`` compiles again is what holds kernels."""

from __future__ import annotations

import re
from pathlib import Path

from sd2core.numerics.compiled import KERNEL_MODULES

REPOSITORY = Path(__file__).resolve().parents[2]


def test_a_change_of_any_kernel_is_noticed() -> None:
    makefile = (REPOSITORY / "Makefile").read_text(encoding="utf-8")
    line = re.search(r"^KERNELS := \$\(wildcard (.*)\)$", makefile, re.MULTILINE)
    assert line is not None
    watched = {file for pattern in line[1].split() for file in REPOSITORY.glob(pattern)}
    for module in KERNEL_MODULES:
        assert REPOSITORY / f"{module.replace('.', '/')}.py" in watched, module
