"""The folder of a run: progress that is followed, control, and processes that are gone."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lock_holders import held

from sd2core.errors import Sd2Error
from sd2core.runs.control import Control, read_control, write_control
from sd2core.runs.progress import (
    ProgressTail,
    ProgressWriter,
    effective,
    read_events,
)
from sd2core.train.folder import TrainingFolder, runs_in


class TestProgress:
    def test_lines_come_whole_and_once(self, tmp_path: Path) -> None:
        path = tmp_path / "progress.jsonl"
        tail = ProgressTail(path)
        assert tail.new() == []
        with ProgressWriter(path) as writer:
            writer.say("start", model="s4", loss=float("nan"), rate=1 / 3)
        assert tail.new() == [{"event": "start", "model": "s4", "loss": None, "rate": 0.3333333}]
        with path.open("a") as stream:
            stream.write('{"event": "ep')
            stream.flush()
            assert tail.new() == []
            stream.write('och"}\n')
        assert tail.new() == [{"event": "epoch"}]
        assert tail.new() == []

    @given(st.integers(0, 40))
    def test_a_torn_line_harms_no_other(self, cut: int) -> None:
        import tempfile

        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "progress.jsonl"
            line = json.dumps({"event": "step", "step": 1, "train_rmse": 0.25})
            path.write_text('{"event": "start"}\n' + line[:cut])
            with ProgressWriter(path) as writer:
                writer.say("start", resumed=True, steps_done=0)
            events = [event["event"] for event in read_events(path)]
            assert events == ["start", *(["step"] if cut == len(line) else []), "start"]

    def test_what_is_no_line_is_left_out(self, tmp_path: Path) -> None:
        path = tmp_path / "progress.jsonl"
        good = b'{"event": "start"}\n'
        for bad in (b"[" * 100_000, b'{"event": ' + b"9" * 5000, b"\xff", b" " * 3_000_000):
            path.write_bytes(good + bad + b"\n" + good)
            tail = ProgressTail(path)
            assert [event["event"] for event in tail.new()] == ["start", "start"]
            assert tail.new() == []
        path.unlink()
        os.mkfifo(path)
        assert read_events(path) == []

    def test_what_is_done_again_counts_once(self) -> None:
        step = [{"event": "step", "step": n, "first": True} for n in range(1, 6)]
        again = [{"event": "step", "step": n, "first": False} for n in range(4, 7)]
        start = {"event": "start", "resumed": False}
        resumed = {"event": "start", "resumed": True, "steps_done": 3}
        kept = effective(
            [start, *step, {"event": "epoch", "step": 5}, {"event": "end"}, resumed, *again]
        )
        assert [one["step"] for one in kept if one["event"] == "step"] == [1, 2, 3, 4, 5, 6]
        assert [one["first"] for one in kept if one["event"] == "step"] == [True] * 3 + [False] * 3
        assert not [one for one in kept if one["event"] in ("epoch", "end")]


class TestControl:
    def test_words(self, tmp_path: Path) -> None:
        path = tmp_path / "control"
        assert read_control(path) == "run"
        for word in ("pause", "stop", "cancel", "run"):
            write_control(path, word)  # type: ignore[arg-type]
            assert read_control(path) == word
        path.write_bytes(b"\xff\xfe what")
        assert read_control(path) == "run"

    def test_waits_while_paused(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        path = tmp_path / "control"
        write_control(path, "pause")
        naps = []

        def nap(seconds: float) -> None:
            naps.append(seconds)
            if len(naps) == 3:
                write_control(path, "cancel")

        monkeypatch.setattr("sd2core.runs.control.time.sleep", nap)
        assert Control(path).wait_while_paused()[0] == "cancel"
        assert len(naps) == 3


class TestFolder:
    def test_a_run_without_its_process_has_died(self, tmp_path: Path) -> None:
        run = TrainingFolder(tmp_path / "run")
        run.create("gru")
        run.set_state("running")
        lock = run.lock()
        assert run.state() == "running"
        lock.release()
        assert run.state() == "died"
        assert not run.status().resumable
        run.last.touch()
        assert run.status().resumable
        with pytest.raises(Sd2Error, match=r"lost its process.*sd2 train --resume"):
            run.tell("pause")

    @pytest.mark.slow
    def test_one_process_per_run(self, tmp_path: Path) -> None:
        run = TrainingFolder(tmp_path / "run")
        run.create("gru")
        process = held(run.path / "lock")
        try:
            with pytest.raises(Sd2Error, match=r"training in .* already"):
                run.lock()
            run.tell("pause")
            assert read_control(run.control) == "pause"
        finally:
            process.kill()
            process.communicate()

    def test_nothing_is_overwritten(self, tmp_path: Path) -> None:
        run = TrainingFolder(tmp_path / "run")
        run.create("gru")
        with pytest.raises(Sd2Error, match=r"is a run already.*--resume"):
            run.create("gru")
        (tmp_path / "full").mkdir()
        (tmp_path / "full" / "a").touch()
        with pytest.raises(Sd2Error, match="not an empty folder"):
            TrainingFolder(tmp_path / "full").create("gru")
        with pytest.raises(Sd2Error, match=r"full.a is a file"):
            TrainingFolder(tmp_path / "full" / "a" / "runs" / "run").create("gru")

    def test_the_folders_above_are_made_too(self, tmp_path: Path) -> None:
        run = TrainingFolder(tmp_path / "runs" / "today" / "run")
        run.create("gru")
        assert run.exists

    def test_the_status_is_that_of_the_lines(self, tmp_path: Path) -> None:
        run = TrainingFolder(tmp_path / "run")
        run.create("gru")
        with ProgressWriter(run.progress) as writer:
            writer.say("start", epochs=9, resumed=False)
            writer.say("epoch", epoch=1, step=5, validation_rmse=0.5, best=True, elapsed_s=2.0)
            writer.say("epoch", epoch=2, step=9, validation_rmse=0.7, best=False, elapsed_s=4.0)
            error = {"found": "No", "expected": "", "remedy": ""}
            writer.say("end", outcome="failed", error=error)
        run.set_state("failed")
        status = run.status()
        assert (status.state, status.model, status.epoch, status.epochs) == ("failed", "gru", 2, 9)
        assert (status.validation_rmse, status.elapsed_s, status.error) == (0.5, 4.0, "No.")

    def test_discarding_takes_only_what_the_run_made(self, tmp_path: Path) -> None:
        run = TrainingFolder(tmp_path / "run")
        run.create("gru")
        write_control(run.control, "run")
        (run.path / "notes.txt").write_text("mine")
        run.discard()
        assert [path.name for path in run.path.iterdir()] == ["notes.txt"]
        (run.path / "notes.txt").unlink()
        run.create("gru")
        run.discard()
        assert not run.path.exists()

    def test_runs_in_a_folder(self, tmp_path: Path) -> None:
        for name in ("b", "a"):
            TrainingFolder(tmp_path / name).create("gru")
        (tmp_path / "c").mkdir()
        assert [run.path.name for run in runs_in(tmp_path)] == ["a", "b"]
        assert [run.path.name for run in runs_in(tmp_path / "a")] == ["a"]
        with pytest.raises(Sd2Error, match="does not exist"):
            runs_in(tmp_path / "d")

    @pytest.mark.parametrize("text", ["{", "[]", '{"format": "x"}'])
    def test_a_damaged_description(self, tmp_path: Path, text: str) -> None:
        run = TrainingFolder(tmp_path)
        (tmp_path / "run.json").write_text(text)
        with pytest.raises(Sd2Error, match=r"run\.json"):
            run.state()
