"""``sd2 train``, ``sd2 runs`` and ``sd2 eval``: what is told, refused and printed."""

from __future__ import annotations

import json
import os
import signal
import tomllib
from pathlib import Path
from typing import Any

import pytest
from cli_outcome import Sd2
from small_pairs import write_pairs

from sd2core.runs.progress import ProgressWriter, read_events
from sd2core.train.folder import TrainingFolder
from tests.damaged_files import lose

SMALL = ("--model", "gru", "--set", "channels=4", "--set", "depth=1", "--segment-frames", "30")
QUICK = (*SMALL, "--device", "cpu", "--threads", "1", "--epochs", "2")


@pytest.fixture(scope="module")
def pairs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_pairs(tmp_path_factory.mktemp("pairs") / "small.zarr", frames=90)


def shown(sd2: Sd2, *words: object) -> dict[str, Any]:
    outcome = sd2("train", *words, "--show-settings")
    assert outcome.code == 0, outcome.err
    return tomllib.loads(outcome.out)


class TestTrain:
    def test_from_pairs_to_an_evaluation(self, sd2: Sd2, pairs: Path, tmp_path: Path) -> None:
        for seed in (0, 1):
            run = tmp_path / f"run{seed}"
            outcome = sd2("train", pairs, *QUICK, "--seed", seed, "--out", run, "--json")
            assert outcome.code == 0, outcome.err
            summary = json.loads(outcome.out)
            assert (summary["outcome"], summary["best_epoch"]) == ("finished", 2)
            assert Path(summary["model"]).is_file()
        events = read_events(run / "progress.jsonl")
        assert [event["event"] for event in events if event["event"] != "step"] == [
            "start",
            "epoch",
            "epoch",
            "end",
        ]
        table, picture = tmp_path / "e.md", tmp_path / "e.png"
        asked = ("eval", tmp_path / "run0", tmp_path / "run1", "--data", pairs)
        outcome = sd2(*asked, "--markdown", table, "--figure", picture)
        assert outcome.code == 0, outcome.err
        content = json.loads(sd2(*asked, "--json").out)
        assert content["subjects"] == ["s3"]
        assert [(one["name"], len(one["models"])) for one in content["groups"]] == [
            ("none", 1),
            ("median", 1),
            ("wiener", 1),
            ("ridge", 1),
            ("gru (channels=4, depth=1)", 2),
        ]
        mean = content["groups"][-1]["peak_mae_mps"]["mean"]
        assert f"{mean:.3f} ± " in outcome.out
        assert f"{mean:.3f} ± " in table.read_text()
        assert picture.read_bytes().startswith(b"\x89PNG")

    def test_frames_of_a_damaged_chunk_are_left_out_and_told(
        self, sd2: Sd2, tmp_path: Path
    ) -> None:
        damaged, run = write_pairs(tmp_path / "pairs.zarr", takes=6), tmp_path / "run"
        lose(damaged / "radar" / "c" / "1" / "0")  # frames 2250 to 2699, the last ones of s3
        told = "450 frames are lost to damaged chunks"
        outcome = sd2("train", damaged, *QUICK, "--out", run)
        assert outcome.code == 0, outcome.err
        assert told in outcome.err
        (start, *_) = read_events(run / "progress.jsonl")
        assert start["frames_lost"] == 450
        assert '"frames_lost"' in sd2("info", run / "best.safetensors", "--json").out
        assert told in sd2("eval", run, "--data", damaged, "--json").err
        outcome = sd2("info", damaged, "--json")
        content = json.loads(outcome.out)
        assert (content["frames"], told in content["notes"][0]) == (2250, True)

    @pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 0), (signal.SIGINT, 130)])
    def test_a_signal_stops_it(
        self,
        sd2: Sd2,
        pairs: Path,
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
        number: int,
        code: int,
    ) -> None:
        from sd2core.runs.progress import ProgressWriter

        said = ProgressWriter.say

        def say(self: ProgressWriter, event: str, **content: Any) -> None:
            said(self, event, **content)
            if event == "step":
                os.kill(os.getpid(), number)

        monkeypatch.setattr(ProgressWriter, "say", say)
        outcome = sd2("train", pairs, *QUICK, "--out", tmp_path / "run")
        assert outcome.code == code
        assert f"sd2 train --resume {tmp_path / 'run'}" in outcome.out
        monkeypatch.undo()
        assert sd2("train", "--resume", tmp_path / "run").code == 0
        assert TrainingFolder(tmp_path / "run").state() == "finished"

    def test_options_go_before_the_file(self, sd2: Sd2, pairs: Path, tmp_path: Path) -> None:
        toml = tmp_path / "a.toml"
        toml.write_text(
            f'[data]\npairs = ["{pairs}"]\n[model]\nname = "gru"\n[model.options]\nchannels = 8\n'
            "[training]\nminutes = 5\nseed = 4\n"
        )
        content = shown(sd2, toml)
        assert content["training"]["minutes"] == 5.0
        content = shown(sd2, toml, "--epochs", "7", "--set", "depth=3")
        assert content["training"] | {"epochs": 7, "seed": 4} == content["training"]
        assert "minutes" not in content["training"]
        assert (
            content["model"] | {"name": "gru", "options": {"channels": 8, "depth": 3}}
            == (content["model"])
        )
        # What one architecture was told says nothing to another.
        other = shown(sd2, toml, "--model", "s4", "--inputs", "limbs")["model"]
        assert other == {"name": "s4", "inputs": "limbs", "frozen": False, "options": {}}

    def test_the_settings_shown_are_the_settings(
        self, sd2: Sd2, pairs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.chdir(tmp_path)
        words = (pairs, "--background", "--test-subjects", "none", "--range-factor", "1.5")
        content = shown(sd2, *words)
        assert (content["machine"]["threads"], content["machine"]["nice"]) == (1, 10)
        assert content["data"]["test_subjects"] == []
        (tmp_path / "again.toml").write_text(sd2("train", *words, "--show-settings").out)
        assert shown(sd2, "again.toml") == content

    @pytest.mark.parametrize(
        ("words", "said"),
        [
            ((), "Nothing to learn from is given"),
            (("no.zarr", "--out", "run"), "no.zarr does not exist"),
            (("PAIRS",), "No folder for the run is given"),
            (("PAIRS", "--model", "s5", "--out", "run"), "model.name is 's5'. Expected: one of s4"),
            (("PAIRS", "--set", "width=4", "--out", "run"), "no option 'width'"),
            (("PAIRS", "--out", "a.toml/run"), "a.toml is a file"),
            (("a.toml", "b.toml", "--out", "run"), "one file with settings"),
            (("--resume", "run", "PAIRS"), "--resume is given with"),
            (("--resume", "run", "--epochs", "3"), "--resume is given with --epochs"),
            (("--resume", "run"), "run is no run"),
        ],
    )
    def test_refused(
        self,
        sd2: Sd2,
        pairs: Path,
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
        words: tuple[str, ...],
        said: str,
    ) -> None:
        monkeypatch.chdir(tmp_path)
        (tmp_path / "a.toml").touch()
        outcome = sd2("train", *(pairs if word == "PAIRS" else word for word in words))
        assert (outcome.code, outcome.out) == (1, "")
        assert said in outcome.err
        assert not (tmp_path / "run").exists()

    def test_what_is_no_option(self, sd2: Sd2, pairs: Path) -> None:
        assert sd2("train", pairs, "--set", "channels").code == 2


class TestRuns:
    @pytest.fixture
    def runs(self, tmp_path: Path) -> Path:
        """One that ended, one under way, one whose process is gone."""
        for name, state in (("a", "finished"), ("b", "running"), ("c", "running")):
            run = TrainingFolder(tmp_path / name)
            run.create("gru")
            with ProgressWriter(run.progress) as writer:
                writer.say("start", epochs=10, resumed=False, steps_done=0)
                writer.say(
                    "epoch", epoch=4, step=8, validation_rmse=0.5, validation_mae_mps=0.25,
                    best=True, elapsed_s=90.0, left_s=4000.0,
                )  # fmt: skip
            run.set_state(state)  # type: ignore[arg-type]
        return tmp_path

    def test_the_list(self, sd2: Sd2, runs: Path) -> None:
        lock = TrainingFolder(runs / "b").lock()
        try:
            rows = [line.split() for line in sd2("runs", runs).out.splitlines()]
            content = json.loads(sd2("runs", runs, "--json").out)["runs"]
        finally:
            lock.release()
        assert [row[:2] for row in rows[1:]] == [["a", "finished"], ["b", "running"], ["c", "died"]]
        shown = " ".join(rows[2][3:])
        assert shown == "4 of 10 epochs 2 min, 1 h 07 min left 0.5000, 0.250 m/s"
        assert [one["state"] for one in content] == ["finished", "running", "died"]
        assert content[0]["validation_mae_mps"] == 0.25

    def test_one_of_them(self, sd2: Sd2, runs: Path) -> None:
        (runs / "c" / "last.safetensors").touch()
        out = sd2("runs", runs / "c").out
        assert "died" in out
        assert f"sd2 train --resume {runs / 'c'}" in out

    def test_steering(self, sd2: Sd2, runs: Path) -> None:
        run = TrainingFolder(runs / "b")
        lock = run.lock()
        try:
            for word, written in (("pause", "pause"), ("resume", "run"), ("stop", "stop")):
                told = json.loads(sd2("runs", run.path, f"--{word}", "--json").out)
                assert told == {"path": str(run.path), "told": word}
                assert run.control.read_text() == f"{written}\n"
        finally:
            lock.release()
        outcome = sd2("runs", runs / "a", "--stop")
        assert outcome.code == 1
        assert "has finished" in outcome.err

    def test_cancelling_what_has_died_deletes_it(self, sd2: Sd2, runs: Path) -> None:
        assert sd2("runs", runs / "c", "--cancel").code == 0
        assert not (runs / "c").exists()
        assert sd2("runs", runs / "a", "--cancel").code == 1
        assert (runs / "a").exists()

    def test_no_runs(self, sd2: Sd2, tmp_path: Path) -> None:
        assert "no runs here" in sd2("runs", tmp_path).out
        assert "does not exist" in sd2("runs", tmp_path / "x").err


class TestEval:
    def test_refused(self, sd2: Sd2, pairs: Path, tmp_path: Path) -> None:
        TrainingFolder(tmp_path / "run").create("gru")
        outcome = sd2("eval", tmp_path / "run", "--data", pairs)
        assert outcome.code == 1
        assert "has no model yet" in outcome.err
        outcome = sd2("eval", "no-such-model", "--data", pairs)
        assert "no model called 'no-such-model'" in outcome.err
        outcome = sd2("eval", tmp_path / "run", "--data", pairs, "--figure", tmp_path / "e.bmp")
        assert "ends in .png" in outcome.err
