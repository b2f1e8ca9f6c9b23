"""A window in use for minutes takes no more of the machine than at first."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from tools.documentation.measured import REPOSITORY


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_five_minutes_of_use() -> None:
    soak = [sys.executable, "-m", "tools.documentation.soak", "--minutes", "5", "--json"]
    command = ["scripts/on_display.sh", *soak]
    done = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, check=False)
    print(done.stdout)
    assert done.returncode == 0, done.stderr
    rows = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    first, *later = [row for row in rows if row["minute"] >= 2]
    assert later
    assert max(row["most"] for row in rows) <= 40
    for count in ("threads", "descriptors", "windows"):
        assert max(row[count] for row in later) <= first[count]
    assert max(row["RSS, MB"] for row in later) <= 1.1 * first["RSS, MB"]
