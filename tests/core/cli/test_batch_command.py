"""``sd2 batch``, as somebody types it."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from cli_outcome import Sd2

from sd2core.batch import pool
from sd2core.batch.estimate import pace_kind
from sd2core.batch.folder import BatchFolder
from sd2core.batch.plan_file import read_plan
from sd2core.runs.pace import keep_pace

PLAN = """
out = "made"
[recordings]
files = ["meshes/*.npz"]
[placements]
kind = "positions"
positions_m = [[0, 0, 0], [1, 0, 0]]
[synthesise]
visibility = "facing"
"""


@pytest.fixture
def plan(plate: Path, tmp_path: Path) -> Path:
    (tmp_path / "meshes").mkdir()
    shutil.copy(plate, tmp_path / "meshes" / "plate.npz")
    path = tmp_path / "plan.toml"
    path.write_text(PLAN)
    return path


@pytest.mark.slow
def test_a_plan_is_done_on_processes_of_its_own(sd2: Sd2, plan: Path, tmp_path: Path) -> None:
    (tmp_path / "meshes" / "broken.npz").write_bytes(b"nothing")
    made = sd2("batch", plan, "--workers", 1, "--progress-json")
    assert made.code == 1, made.err
    lines = [json.loads(line) for line in made.out.splitlines()]
    assert [lines[0]["event"], lines[-1]["event"]] == ["start", "end"]
    assert lines[0] | {"unix_s": 0} == {
        "event": "start",
        "format": "sd2-batch-progress",
        "version": 1,
        "out": str(tmp_path / "made"),
        "plan": str(plan),
        "recordings": 2,
        "placements": 2,
        "steps": ["inspect", "synthesise"],
        "scheduler": None,
        "unix_s": 0,
    }
    written = BatchFolder(tmp_path / "made").progress.read_text().splitlines()
    assert [json.loads(line) for line in written] == lines
    end = lines[-1]
    assert (end["outcome"], end["failed"], end["waiting"]) == ("finished", 1, 2)
    assert end["done"] == {"inspect": 1, "synthesise": 2}
    assert {"event": "workers", "workers": 1} in lines
    assert read_plan(tmp_path / "made" / "plan.toml") == read_plan(plan)

    # Mended, and once more in words. Nothing has to be started for what is there.
    (tmp_path / "meshes" / "broken.npz").unlink()
    again = sd2("batch", plan)
    assert again.code == 0
    assert "finished" in again.out
    assert "0 done, 2 there already, of 2" in again.out
    status = sd2("batch", "--status", tmp_path / "made", "--json")
    assert json.loads(status.out)["state"] == "finished"
    assert json.loads(status.out)["there"] == {"inspect": 1, "synthesise": 2}
    assert "2 there already" in sd2("batch", "--status", tmp_path / "made").out
    refused = sd2("batch", "--stop", tmp_path / "made")
    assert refused.code == 1
    assert "No process is at work" in refused.err


def test_a_dry_run_counts_and_writes_nothing(sd2: Sd2, plan: Path, tmp_path: Path) -> None:
    before = sorted(tmp_path.rglob("*"))
    told = sd2("batch", plan, "--dry-run", "--json")
    assert told.code == 0, told.err
    content = json.loads(told.out)
    assert (content["recordings"], content["estimate"]) == (1, True)
    steps = content["steps"]
    assert {step: one["to_do"] for step, one in steps.items()} == {"inspect": 1, "synthesise": 2}
    assert steps["synthesise"]["frames"] == 24
    assert steps["synthesise"]["seconds"] is content["hours"] is None
    assert content["bytes"] > 0
    assert "the first tasks tell" in sd2("batch", plan, "--dry-run").out
    for step, one in steps.items():
        keep_pace(pace_kind(read_plan(plan), step), 10.0, one["work"])
    content = json.loads(sd2("batch", plan, "--dry-run", "--json").out)
    assert content["hours"] == pytest.approx(20.0 / content["workers"] / 3600, rel=1e-3)
    assert sorted(tmp_path.rglob("*")) == before
    assert "Estimated:" in sd2("batch", plan, "--dry-run").out


def test_bad_requests_are_explained(
    sd2: Sd2, plan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pool, "_CONNECT_S", 0.5)
    for arguments, words in (
        ((), "No plan is given"),
        ((tmp_path / "none.toml",), "does not exist"),
        (("--status", tmp_path), "is no folder of a batch"),
        ((plan, "--status", tmp_path), "one of them"),
        ((plan, "--scheduler", "tcp://127.0.0.1:9"), "No scheduler answers"),
    ):
        refused = sd2("batch", *arguments)
        assert refused.code == 1
        assert words in refused.err
    assert sd2("batch", plan, "--workers", "0").code == 2
