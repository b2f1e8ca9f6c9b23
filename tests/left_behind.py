"""What the end of a process leaves of a session of labels: nothing closed, nothing cleared."""

from __future__ import annotations

import shutil
from pathlib import Path

from sd2app.labels.autosave import LabelAutosave


def end_process(session: LabelAutosave, recoveries: Path) -> None:
    """End a session as the end of its process does: its locks are free, its journal is there."""
    aside = recoveries.with_name(f"{recoveries.name} of a process")
    shutil.copytree(recoveries, aside)
    session.close()
    shutil.copytree(aside, recoveries, dirs_exist_ok=True)
    shutil.rmtree(aside)
