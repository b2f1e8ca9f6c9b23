"""Folders of commands, also those that an earlier version made."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from sd2app.background.run_monitor import CommandRun
from sd2core.errors import Sd2Error
from sd2core.processes import ProcessId
from sd2core.runs.command_folder import CommandFolder


def of_yesterday(path: Path, code: int | None) -> CommandFolder:
    """As it was written when the state of a command was in two more files."""
    path.mkdir(parents=True)
    about = {"format": "sd2-command", "started_unix_s": 5.0, "arguments": ["info"], "what": "table"}
    (path / "about.json").write_text(json.dumps(about))
    if code is not None:
        (path / "end.json").write_text(json.dumps({"code": code, "pid": 1}))
    return CommandFolder(path)


@pytest.mark.parametrize(
    ("code", "state"), [(0, "finished"), (130, "stopped"), (1, "failed"), (None, "died")]
)
def test_one_of_yesterday_is_followed(qtbot, tmp_path, code, state) -> None:
    folder = of_yesterday(tmp_path / "runs" / "one", code)
    assert (folder.facts.get("code"), folder.state(), folder.facts["what"]) == (
        code,
        state,
        "table",
    )
    run = CommandRun(folder.path)
    qtbot.waitUntil(lambda: run.loaded, timeout=20_000)
    assert run.phase == state
    run.close()


def test_one_that_is_launched_is_under_way_before_it_has_its_folder(qtbot, tmp_path) -> None:
    waits = (sys.executable, "-c", "import time; time.sleep(60)")
    folder = CommandFolder(tmp_path / "one")
    process = folder.start([], {}, command=waits)
    assert (folder.live, folder.state()) == (False, "starting")
    process.terminate(at_once=True)
    qtbot.waitUntil(lambda: folder.state() == "died", timeout=20_000)


def test_one_of_yesterday_starts_again_in_its_folder(qtbot, tmp_path) -> None:
    folder = of_yesterday(tmp_path / "one", 130)
    run = CommandRun(folder.path, process=folder.start(["--version"], {"what": "table"}))
    qtbot.waitUntil(lambda: not run.under_way, timeout=60_000)
    assert run.phase == "finished"
    assert folder.facts.get("code") == 0
    run.close()


def test_a_damaged_description_is_said(tmp_path) -> None:
    folder = CommandFolder(tmp_path)
    (tmp_path / "about.json").write_text('{"format": "sd2-command", "version": 9, "state": "x"}')
    assert folder.facts == {}
    with pytest.raises(Sd2Error, match="does not describe"):
        folder.state()


def test_a_process_that_reuses_a_number_is_not_waited_for(qtbot, tmp_path) -> None:
    folder = CommandFolder(tmp_path / "one")
    folder.path.mkdir()
    folder._describe("starting", started_unix_s=1.0, arguments=[])
    this = ProcessId.current()
    run = CommandRun(folder.path, process=ProcessId(this.pid, this.started_unix_s - 3600.0))
    qtbot.waitUntil(lambda: run.loaded, timeout=20_000)
    assert run.phase == "failed"
    run.close()


def test_a_command_is_run_in_the_background() -> None:
    words = [sys.executable, "-m", "sd2core.cli.background", "--version"]
    told = os.environ | {"PYTHONIOENCODING": "utf-8"}
    made = subprocess.run(words, capture_output=True, check=True, encoding="utf-8", env=told)
    assert made.stdout.startswith("SD² Studio")
