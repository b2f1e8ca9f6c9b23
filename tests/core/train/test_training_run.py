"""A run learns, and whatever interrupts it, it ends with the same weights."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors.torch import load_file
from small_pairs import write_pairs

from sd2core.denoise.files import describe_model, load_model
from sd2core.errors import Sd2Error
from sd2core.mesh.vertex_parts import KINEMATICS
from sd2core.options.training import (
    DataConfig,
    MachineConfig,
    ModelConfig,
    TrainConfig,
    TrainingConfig,
)
from sd2core.pairs.store import read_pairs
from sd2core.runs import pace
from sd2core.runs.control import write_control
from sd2core.runs.progress import Event, ProgressTail, effective, last_of, read_events
from sd2core.train.config import config_text
from sd2core.train.evaluation import learnt_from
from sd2core.train.folder import TrainingFolder
from sd2core.train.start import Ending, begin, go_on
from sd2core.train.validate import Validation, Validator

REPOSITORY = Path(__file__).resolve().parents[3]
SMALL: dict[str, dict[str, Any]] = {
    "gru": {"channels": 12, "depth": 1},
    "s4": {"channels": 8, "depth": 2, "state_size": 8, "dropout": 0.2},
}


@pytest.fixture(scope="module")
def pairs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_pairs(tmp_path_factory.mktemp("pairs") / "small.zarr", null_bins=(3,))


def settings(pairs: Path, model: str = "gru", **training: Any) -> TrainConfig:
    return TrainConfig(
        DataConfig(pairs=(pairs,), segment_frames=24, overlap_frames=4, range_factor=1.3),
        ModelConfig(name=model, options=SMALL[model]),
        TrainingConfig(**{"batch_size": 5, "epochs": 6, "seed": 3, **training}),
        MachineConfig(device="cpu", threads=1, deterministic=True),
    )


def weights(run: Path, name: str) -> dict[str, torch.Tensor]:
    return load_file(run / name)


def same(one: Path, other: Path) -> bool:
    """All tensors of the last checkpoint and of the best model, bit by bit."""
    for name in ("last.safetensors", "best.safetensors"):
        mine, theirs = weights(one, name), weights(other, name)
        if mine.keys() != theirs.keys():
            return False
        if not all(torch.equal(mine[key], theirs[key]) for key in mine):
            return False
    return True


def curve(run: Path) -> list[tuple[Any, ...]]:
    """What is to be drawn, without the times."""
    return [
        (event["epoch"], event["train_rmse"], event["validation_rmse"], event["best"])
        for event in effective(read_events(run / "progress.jsonl"))
        if event["event"] == "epoch"
    ]


def at(step: int, action: Callable[[], None]) -> Callable[[Event], None]:
    """Do something once, when the run has said that it is at a step."""
    done = []

    def watch(event: Event) -> None:
        if event["event"] in ("step", "epoch") and event["step"] >= step and not done:
            done.append(True)
            action()

    return watch


@pytest.fixture(scope="module")
def learnt(pairs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    run = tmp_path_factory.mktemp("start") / "run"
    return begin(settings(pairs, "s4", epochs=3), run).model or run


class TestGoingOn:
    """From a model that is there."""

    def test_it_begins_where_the_other_ended(
        self, pairs: Path, learnt: Path, tmp_path: Path
    ) -> None:
        config = settings(pairs, epochs=1, learning_rate=1e-7)
        config = replace(config, model=ModelConfig(start=learnt))
        ending = begin(config, tmp_path / "run")
        before, after = (
            describe_model(learnt),
            describe_model(tmp_path / "run" / "best.safetensors"),
        )
        assert (after.model, after.options) == (before.model, before.options)
        assert after.scaling.input == before.scaling.input
        assert after.about["start"] == learnt.name
        # Who chose the first model is no stranger to the second.
        assert learnt_from(after, "training") == learnt_from(before, "training", "validation")
        assert ending.validation_rmse == pytest.approx(
            before.about["metrics"]["validation_rmse"], rel=1e-3
        )
        assert "live_validation_rmse" in after.about["metrics"]
        # Resumed, or looked at: the run says what it is.
        assert (
            f'start = "{os.path.relpath(learnt, tmp_path / "run")}"'
            in (tmp_path / "run" / "config.toml").read_text()
        )

    def test_frozen_layers_stay(self, pairs: Path, learnt: Path, tmp_path: Path) -> None:
        config = replace(settings(pairs, epochs=2), model=ModelConfig(start=learnt, frozen=True))
        begin(config, tmp_path / "run")
        before, after = load_file(learnt), weights(tmp_path / "run", "best.safetensors")
        changed = {name for name in before if not torch.equal(before[name], after[name])}
        assert changed
        assert all({"head", "skip"} & {*name.split(".")} for name in changed)

    @pytest.mark.parametrize(
        ("model", "words"),
        [
            ({"name": "gru"}, "The name of .* is 's4', and 'gru' is asked for"),
            ({"inputs": "limbs"}, "The inputs of .* is 'map', and 'limbs'"),
            ({"options": {"channels": 4}}, "The options of"),
        ],
    )
    def test_another_kind_is_refused(
        self, pairs: Path, learnt: Path, tmp_path: Path, model: dict[str, Any], words: str
    ) -> None:
        config = replace(settings(pairs), model=ModelConfig(start=learnt, **model))
        with pytest.raises(Sd2Error, match=words):
            begin(config, tmp_path / "run")
        with pytest.raises(Sd2Error, match=r"model\.frozen is true, and no model"):
            begin(replace(config, model=ModelConfig(frozen=True)), tmp_path / "run")

    def test_other_pairs_are_refused(self, learnt: Path, tmp_path: Path) -> None:
        other = write_pairs(tmp_path / "other.zarr", null_bins=(4,))
        config = replace(settings(other), model=ModelConfig(start=learnt))
        with pytest.raises(Sd2Error, match="null bins"):
            begin(config, tmp_path / "run")


class TestLearning:
    def test_it_beats_what_it_is_given(self, pairs: Path, tmp_path: Path) -> None:
        config = settings(pairs, epochs=30, learning_rate=0.03)
        ending = begin(config, tmp_path / "run", command="sd2 train")
        epochs = curve(tmp_path / "run")
        assert ending.outcome == "finished"
        assert len(epochs) == 30
        best = min(one[2] for one in epochs)
        assert ending.validation_rmse == pytest.approx(best, rel=1e-6)
        assert best < 0.5 * epochs[0][2]
        # What a step took is what the next estimate is made of.
        events = read_events(tmp_path / "run" / "progress.jsonl")
        last = last_of(events, "epoch")
        step_s = pace.known_pace_s(config.pace_kind)
        assert last is not None
        assert step_s is not None
        assert 0 < step_s < 2 * last["elapsed_s"] / last["step"]
        assert last["left_s"] == 0.0
        # Lines of single steps are few: of the ends of epochs, and two a second.
        steps = [event for event in events if event["event"] == "step"]
        assert len(steps) <= 30 + 1 + last["elapsed_s"] / 0.5
        assert ending.model is not None
        card = describe_model(ending.model)
        assert (card.model, card.trained_on, card.null_bins) == ("gru", "simulated", (3,))
        assert card.about["subjects"] == {
            "training": ["s1"],
            "validation": ["s2"],
            "test": ["s3"],
        }
        assert card.about["metrics"]["validation_rmse"] == ending.validation_rmse
        assert "simulated" in card.about["limits"]
        assert load_model(ending.model).denoise_values(torch.rand(10, 8).numpy()).shape == (10, 8)

    def test_seeds_differ_and_repeat(self, pairs: Path, tmp_path: Path) -> None:
        for name, seed in (("a", 1), ("b", 1), ("c", 2)):
            begin(settings(pairs, epochs=2, seed=seed), tmp_path / name)
        begin(settings(pairs, epochs=2, seed=1, balanced=True), tmp_path / "balanced")
        assert same(tmp_path / "a", tmp_path / "b")
        assert not same(tmp_path / "a", tmp_path / "c")
        assert not same(tmp_path / "a", tmp_path / "balanced")

    @pytest.mark.slow
    def test_kinematics_are_learnt_from(self, tmp_path: Path) -> None:
        """Half of the segments are mirrored, by the seed; the mean velocity counts if asked to."""
        pairs = write_pairs(tmp_path / "split.zarr", limbs=True, null_bins=(3,))
        values = {"model": {"inputs": "kinematics"}}
        for name, weight in (("a", 0.0), ("b", 0.0), ("c", 1.0)):
            config = settings(pairs, epochs=2, velocity_weight=weight).with_values(values)
            ending = begin(config, tmp_path / name)
        assert same(tmp_path / "a", tmp_path / "b")
        assert not same(tmp_path / "a", tmp_path / "c")
        assert ending.model is not None
        model = load_model(ending.model)
        assert (model.card.inputs, model.card.maps, model.card.features) == ("kinematics", 1, 101)
        take = read_pairs(pairs).takes[0]
        assert model.denoise_values(take.inputs(model.card.parts)).shape == take.radar.shape
        taken = [take.inputs((KINEMATICS,)) for take in read_pairs(pairs).of(["s1"]).takes]
        lift = model.network.get_submodule("network.lift.0")
        torch.testing.assert_close(
            lift.get_buffer("mean"), torch.from_numpy(np.concatenate(taken)[:, 8:]).mean(dim=0)
        )

    @pytest.mark.parametrize("model", ["gru", pytest.param("s4", marks=pytest.mark.slow)])
    def test_mixed_precision(self, pairs: Path, tmp_path: Path, model: str) -> None:
        config = settings(pairs, model, epochs=4)
        for precision in ("32", "bf16"):
            machine = {"machine": {"precision": precision}}
            begin(config.with_values(machine), tmp_path / precision)
        whole, mixed = curve(tmp_path / "32"), curve(tmp_path / "bf16")
        # Eight bits of mantissa: nearly the same course, and not the same.
        assert mixed != whole
        assert [one[2] for one in mixed] == pytest.approx([one[2] for one in whole], rel=0.02)

    def test_gradients_are_clipped(
        self, pairs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        norms = []
        clip = torch.nn.utils.clip_grad_norm_

        def noted(parameters: Any, norm: float) -> torch.Tensor:
            tensors = list(parameters)
            clip(tensors, norm)
            norms.append(float(torch.cat([one.grad.ravel() for one in tensors]).norm()))
            return torch.tensor(0.0)

        monkeypatch.setattr(torch.nn.utils, "clip_grad_norm_", noted)
        begin(settings(pairs, epochs=1, clip_norm=1e-3), tmp_path / "run")
        assert norms == pytest.approx([1e-3] * len(norms), rel=1e-3)
        assert norms

    def test_early_stopping(
        self, pairs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        errors = iter([0.5, 0.4, 0.6, 0.4, 0.5, 0.1])

        def told(model: object, validator: Validator, *_: object) -> Validation:
            return Validation(
                next(errors), 1.0, np.zeros(tuple(validator.targets.shape), np.float32)
            )

        monkeypatch.setattr("sd2core.train.denoiser_loop.validate", told)
        ending = begin(settings(pairs, early_stopping_epochs=3, epochs=6), tmp_path / "run")
        assert (ending.outcome, ending.best_epoch) == ("finished", 2)
        assert ending.early_after == 3
        assert [one[3] for one in curve(tmp_path / "run")] == [True, True, False, False, False]

    def test_time_limits(self, pairs: Path, tmp_path: Path) -> None:
        ending = begin(settings(pairs, minutes=0.01), tmp_path / "run")
        events = read_events(tmp_path / "run" / "progress.jsonl")
        assert (ending.outcome, ending.early_after) == ("finished", None)
        assert (events[0]["epochs"], events[0]["minutes"]) == (None, 0.01)
        kept = json.loads((tmp_path / "run" / "last.json").read_text())
        assert kept["position"]["elapsed_s"] >= 0.6
        rates = [event["learning_rate"] for event in events if event["event"] == "step"]
        # The cosine comes down with the clock.
        assert rates[-1] < 0.5 * max(rates)


class TestSteering:
    @pytest.mark.parametrize(
        ("model", "balanced"),
        [("gru", True), pytest.param("s4", False, marks=pytest.mark.slow)],
    )
    def test_stopped_and_gone_on_with(
        self, pairs: Path, tmp_path: Path, model: str, balanced: bool
    ) -> None:
        config = settings(pairs, model, balanced=balanced)
        whole = begin(config, tmp_path / "whole")
        run = TrainingFolder(tmp_path / "run")
        stop = at(4, lambda: run.tell("stop"))
        stopped = begin(config, run.path, watch=stop)
        assert stopped.outcome == "stopped"
        assert stopped.model is not None
        assert run.status().state == "stopped"
        assert run.status().resumable
        assert not same(tmp_path / "whole", run.path)
        again = go_on(run.path)
        assert again == replace(whole, model=again.model)
        assert same(tmp_path / "whole", run.path)
        assert curve(tmp_path / "whole") == curve(run.path)

    @pytest.mark.slow
    def test_paused(self, pairs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        config = settings(pairs)
        begin(config, tmp_path / "whole")
        run = TrainingFolder(tmp_path / "run")
        states = []

        def nap(seconds: float) -> None:
            states.append(run.state())
            run.tell("run")

        monkeypatch.setattr("sd2core.runs.control.time.sleep", nap)
        pause = at(5, lambda: run.tell("pause"))
        assert begin(config, run.path, watch=pause).outcome == "finished"
        assert states == ["paused"]
        assert same(tmp_path / "whole", run.path)
        said = [event["event"] for event in read_events(run.progress)]
        assert said.index("paused") < said.index("resumed") < said.index("end")

    def test_cancelled(self, pairs: Path, tmp_path: Path) -> None:
        run = TrainingFolder(tmp_path / "run")
        said: list[Event] = []
        cancel = at(4, lambda: run.tell("cancel"))

        def watch(event: Event) -> None:
            said.append(event)
            cancel(event)

        assert begin(settings(pairs), run.path, watch=watch).outcome == "cancelled"
        assert not run.path.exists()
        assert [event["event"] for event in said][-2:] == ["cancelling", "end"]
        assert said[-1]["outcome"] == "cancelled"

    def test_a_signal_stops_and_handlers_come_back(self, pairs: Path, tmp_path: Path) -> None:
        before = [signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)]
        interrupt = at(3, lambda: os.kill(os.getpid(), signal.SIGINT))
        ending = begin(settings(pairs), tmp_path / "run", watch=interrupt)
        assert (ending.outcome, ending.interrupted) == ("stopped", True)
        assert before == [signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)]

    def test_stopped_before_the_first_epoch_ends(self, pairs: Path, tmp_path: Path) -> None:
        run = TrainingFolder(tmp_path / "run")
        ending = begin(settings(pairs), run.path, watch=at(1, lambda: run.tell("stop")))
        assert ending.outcome == "stopped"
        assert ending.best_epoch is None
        assert load_model(run.best).card.model == "gru"


def process(*words: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-W", "error", "-m", "sd2core.cli", "train", *words],
        env=os.environ | {"PYTHONPATH": str(REPOSITORY), "OMP_NUM_THREADS": "1"},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )


def wait_for(tail: ProgressTail, step: int, training: subprocess.Popen[bytes]) -> None:
    """Until the process has said that it is at that step or later."""
    while True:
        if any(event.get("step", 0) >= step for event in tail.new()):
            return
        if training.poll() is not None:
            assert training.stderr is not None
            pytest.fail(f"ended too early: {training.stderr.read().decode()}")
        time.sleep(0.02)


@pytest.mark.slow
def test_terminated_and_killed(pairs: Path, tmp_path: Path) -> None:
    """As a user's machine may do it: first a polite end, then a power cut."""
    config = settings(pairs, epochs=24, checkpoint_s=0.2)
    run = TrainingFolder(tmp_path / "run")
    terminate = at(12, lambda: os.kill(os.getpid(), signal.SIGTERM))
    ending = begin(config, run.path, watch=terminate)
    assert (ending.outcome, ending.interrupted) == ("stopped", False)
    assert run.status().resumable

    tail = ProgressTail(run.progress)
    tail.new()
    second = process("--resume", str(run.path))
    wait_for(tail, 48, second)
    assert run.state() == "running"
    second.kill()
    second.communicate()
    assert run.status().state == "died"

    begin(config, tmp_path / "whole")
    ending = go_on(run.path)
    assert ending.outcome == "finished"
    assert same(tmp_path / "whole", run.path)
    assert curve(tmp_path / "whole") == curve(run.path)


@pytest.mark.slow
def test_two_processes(pairs: Path, tmp_path: Path) -> None:
    config = settings(pairs, epochs=20, learning_rate=0.03)
    config = config.with_values({"machine": {"devices": 2, "deterministic": False}})
    toml = tmp_path / "settings.toml"
    toml.write_text(config_text(config, tmp_path))
    words = ["train", str(toml), "--out", str(tmp_path / "run"), "--json"]
    done = subprocess.run(
        [sys.executable, "-W", "error", "-m", "sd2core.cli", *words],
        env=os.environ | {"PYTHONPATH": str(REPOSITORY), "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    # Lines of progress are no warnings.
    said = [line for line in done.stderr.splitlines() if not line.startswith("Training run: ")]
    assert (done.returncode, said) == (0, [])
    # One of them speaks.
    assert json.loads(done.stdout)["outcome"] == "finished"
    epochs = curve(tmp_path / "run")
    assert [epoch[0] for epoch in epochs] == list(range(1, 21))
    assert epochs[-1][2] < 0.7 * epochs[0][2]


class TestFailure:
    def failing(self, config: TrainConfig, run: Path) -> tuple[Sd2Error, Event]:
        with pytest.raises(Sd2Error) as raised:
            begin(config, run)
        return raised.value, read_events(run / "progress.jsonl")[-1]

    def test_it_says_why(self, pairs: Path, tmp_path: Path) -> None:
        config = settings(pairs, learning_rate=1.0, clip_norm=0.0, epochs=300)
        config = replace(config, data=replace(config.data, segment_frames=400))
        error, end = self.failing(config, tmp_path / "run")
        assert end["outcome"] == "failed"
        assert end["error"]["found"] == error.found
        assert "400 frames long" in error.found
        status = TrainingFolder(tmp_path / "run").status()
        assert (status.state, status.resumable, status.error) == ("failed", False, str(error))
        assert "Traceback" in (tmp_path / "run" / "log.txt").read_text()

    def test_nothing_learnt_makes_way(self, pairs: Path, tmp_path: Path) -> None:
        config = settings(pairs, epochs=1)
        long = replace(config, data=replace(config.data, segment_frames=400))
        self.failing(long, tmp_path / "run")
        assert begin(config, tmp_path / "run").outcome == "finished"
        with pytest.raises(Sd2Error, match="is a run already"):
            begin(config, tmp_path / "run")
        with pytest.raises(Sd2Error, match="has finished"):
            go_on(tmp_path / "run")

    def test_what_diverges_is_said(
        self, pairs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        from sd2core.denoise.causal_models import GruDenoiser

        monkeypatch.setattr(
            GruDenoiser,
            "forward",
            lambda self, values: values * self.head.weight.sum() * float("inf"),
        )
        error, end = self.failing(settings(pairs), tmp_path / "run")
        assert "no finite number" in error.found
        assert end["error"]["remedy"].startswith("Choose a lower learning rate")
        assert not (tmp_path / "run" / "last.safetensors").exists()

    def test_other_pairs(self, pairs: Path, tmp_path: Path) -> None:
        own = write_pairs(tmp_path / "own.zarr")
        run = TrainingFolder(tmp_path / "run")
        begin(settings(own), run.path, watch=at(3, lambda: run.tell("stop")))
        for path in sorted(own.rglob("*"), reverse=True):
            path.unlink() if path.is_file() else path.rmdir()
        own.rmdir()
        write_pairs(own, frames=160)
        with pytest.raises(Sd2Error, match="pairs have changed"):
            go_on(run.path)
        # What was there to go on with is there still.
        assert run.status().state == "failed"
        assert run.status().resumable

    @pytest.mark.parametrize(
        ("changed", "said"),
        [
            ({"name": "s5"}, r"model\.name is 's5'. Expected: one of s4, s4d"),
            ({"options": {"width": 3}}, "The model gru has no option 'width'. Expected: one of ch"),
        ],
    )
    def test_at_once(self, pairs: Path, tmp_path: Path, changed: dict[str, Any], said: str) -> None:
        config = settings(pairs).with_values({"model": changed})
        with pytest.raises(Sd2Error, match=said):
            begin(config, tmp_path / "run")
        assert not (tmp_path / "run").exists()

    def test_no_gpu(self, pairs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
        config = settings(pairs).with_values({"machine": {"device": "cuda"}})
        with pytest.raises(Sd2Error, match="finds 0 GPUs"):
            begin(config, tmp_path / "run")


def test_control_of_a_run_that_is_over(pairs: Path, tmp_path: Path) -> None:
    ending: Ending = begin(settings(pairs, epochs=1), tmp_path / "run")
    assert ending.outcome == "finished"
    write_control(tmp_path / "run" / "control", "stop")
    with pytest.raises(Sd2Error, match="has finished"):
        TrainingFolder(tmp_path / "run").tell("stop")
