"""Folders of runs that an earlier version made."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from sd2core.batch.folder import BatchFolder
from sd2core.errors import Sd2Error
from sd2core.processes import ProcessId
from sd2core.runs.folder import RunFolder
from sd2core.train.folder import TrainingFolder


@pytest.mark.parametrize(
    ("kind", "about"),
    [
        (TrainingFolder, {"format": "sd2-run", "model": "s4"}),
        (BatchFolder, {"format": "sd2-batch"}),
    ],
)
def test_a_folder_of_yesterday_opens(
    kind: type[RunFolder], about: dict[str, object], tmp_path: Path
) -> None:
    folder = kind(tmp_path / "run")
    folder.path.mkdir()
    # As it was written before processes were told apart by their start: a number alone.
    told = {"version": 1, "state": "running", "pid": os.getpid(), "started_unix_s": 1.0, **about}
    folder.description.write_text(json.dumps(told), encoding="utf-8")
    assert folder.state() == "died"
    assert folder.process is None
    with pytest.raises(Sd2Error, match="lost its process"):
        folder.tell("stop")
    lock = folder.lock()
    assert folder.state() == "running"
    folder.set_state("stopped")
    assert folder.process is not None
    assert folder.process.is_same(ProcessId.current())
    lock.release()
    assert folder.about()["started_unix_s"] == 1.0
