"""A process that holds a lock until it is killed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent


def held(path: Path) -> subprocess.Popen[str]:
    """A process that holds a lock until it is killed."""
    code = (
        "import sys, time; from pathlib import Path; from sd2core.files.lock import FileLock;"
        " lock = FileLock(Path(sys.argv[1])); print(lock.take(), flush=True); time.sleep(60)"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code, str(path)],
        stdout=subprocess.PIPE,
        text=True,
        cwd=REPOSITORY,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "True\n"
    return process
