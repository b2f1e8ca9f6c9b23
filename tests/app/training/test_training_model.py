"""Training from the window without a window; the training itself is pretended."""

from __future__ import annotations

import os
import re
import shlex
import signal
import sys
from pathlib import Path
from shutil import copytree

import pytest
from training_pairs import write_pairs

from sd2app.background import run_monitor
from sd2app.command_line import full_parser
from sd2app.settings import Settings
from sd2app.training.model import TrainingModel
from sd2app.training.run import division_text
from sd2core.cli.command_parser import record_of
from sd2core.cli.train import _config
from sd2core.errors import Sd2Error
from sd2core.runs.command_folder import last_output, launch
from sd2core.runs.control import read_control
from sd2core.runs.pace import keep_pace
from sd2core.train.data import prepare, read_mixed
from sd2core.train.folder import TrainingFolder

FAKE = Path(__file__).resolve().parents[2] / "fake_train.py"


@pytest.fixture(autouse=True)
def quick(monkeypatch) -> None:
    """Look more often than a person would."""
    monkeypatch.setattr(run_monitor, "POLL_MS", 40)


@pytest.fixture
def pairs(tmp_path) -> Path:
    """300 frames of each of six people: 5 segments each, four of them learnt from."""
    return write_pairs(tmp_path / "campaign.zarr")


@pytest.fixture
def made(qtbot, tmp_path, pairs):
    """Makes models; options are those of ``fake_train.py``."""
    models: list[TrainingModel] = []

    def make(*options: object, settings: Settings | None = None, epochs: int = 3) -> TrainingModel:
        command = [sys.executable, "-u", str(FAKE), *map(str, options)]
        model = TrainingModel(settings or Settings.forgetful(), None, command, tmp_path / "runs")
        models.append(model)
        if not model.setup.data:
            model.setup.add(pairs)
            model.setup.set_value("epochs", epochs)
        qtbot.waitUntil(lambda: not model.setup.problem, timeout=5_000)
        return model

    yield make
    for model in models:
        if model.run is not None and model.run.under_way:
            pid = model.run.folder.status().pid if model.run.folder.exists else None
            if pid:
                os.kill(pid, signal.SIGKILL)
        model.close()


def wait_for(qtbot, model, *phases: str) -> None:
    qtbot.waitUntil(lambda: model.run is not None and model.run.phase in phases, timeout=15_000)


def test_a_run_from_start_to_end(made, qtbot) -> None:
    model = made()
    said = []
    model.noted.connect(said.append)
    model.start()
    assert model.run.phase == "starting"
    wait_for(qtbot, model, "finished")
    run = model.run
    assert said == [f"{run.folder.path.name} is done. The Train panel shows what came of it."]
    assert [point.epoch for point in run.history.epoch_points] == [1, 2, 3]
    assert run.history.best.validation_rmse == pytest.approx(0.4)
    assert run.history.share == 1.0
    assert run.folder.best.exists()
    assert run.config.data.pairs == (model.setup.data[0].path,)
    assert not list(run.folder.path.parent.glob(".*"))


def test_one_at_a_time(made, qtbot) -> None:
    model = made("--rest-at", 1)
    model.start()
    wait_for(qtbot, model, "running")
    qtbot.waitUntil(lambda: any(one.live for one in model.known))
    assert "is under way" in model.why_not_start
    with pytest.raises(Sd2Error, match="is under way"):
        model.start()
    model.tell("stop")
    wait_for(qtbot, model, "stopped")
    qtbot.waitUntil(lambda: not model.why_not_start)


def test_pausing_and_going_on(made, qtbot) -> None:
    model = made("--step-s", 0.05, epochs=50)
    model.start()
    wait_for(qtbot, model, "running")
    model.tell("pause")
    assert model.run.phase == "pausing"
    assert read_control(model.run.folder.control) == "pause"
    wait_for(qtbot, model, "paused")
    model.tell("run")
    assert model.run.phase == "resuming"
    wait_for(qtbot, model, "running")


def test_stopping_keeps_the_best(made, qtbot) -> None:
    model = made("--rest-at", 2)
    model.start()
    qtbot.waitUntil(lambda: model.run.history.epoch == 2, timeout=15_000)
    model.tell("stop")
    assert model.run.phase == "stopping"
    # What was said last does not count after that, unless it is to be discarded.
    model.tell("pause")
    assert model.run.phase == "stopping"
    wait_for(qtbot, model, "stopped")
    assert model.run.folder.best.exists()
    assert len(model.run.history.epoch_points) == 2
    # At once: that the process has let go of the folder is what "stopped" means.
    model.resume()
    wait_for(qtbot, model, "starting", "running")
    # It continues after the second epoch and, this time, has nothing to rest at.
    wait_for(qtbot, model, "finished")
    assert [point.epoch for point in model.run.history.epoch_points] == [1, 2, 3]


def test_cancelling_is_said_at_once_and_leaves_nothing(made, qtbot) -> None:
    model = made("--rest-at", 1)
    model.start()
    wait_for(qtbot, model, "running")
    folder = model.run.folder
    model.tell("cancel")
    assert model.run.phase == "cancelling"
    qtbot.waitUntil(lambda: model.run is None, timeout=15_000)
    qtbot.waitUntil(lambda: not list(folder.path.parent.iterdir()))


def test_cancelling_before_there_is_a_folder(made, qtbot) -> None:
    model = made("--slow-start-s", 30)
    model.start()
    path = model.run.folder.path
    model.tell("cancel")
    assert model.run.phase == "cancelling"
    qtbot.waitUntil(lambda: model.run is None, timeout=15_000)
    assert not path.exists()


@pytest.mark.skipif(sys.platform == "win32", reason="nothing can refuse there")
def test_one_that_does_not_hear_is_ended(made, qtbot) -> None:
    model = made("--rest-at", 1, "--deaf")
    model.start()
    wait_for(qtbot, model, "running")
    folder, run = model.run.folder, model.run
    model.tell("cancel")
    real = run._clock_s
    run._clock_s = lambda: real() + 31.0
    qtbot.waitUntil(lambda: model.run is None, timeout=15_000)
    qtbot.waitUntil(lambda: not folder.path.exists())


def test_a_refusal_is_told_in_its_words(made, qtbot) -> None:
    model = made("--refuse", "The disk is full. Make room.")
    model.start()
    wait_for(qtbot, model, "failed")
    assert model.run.text == "The disk is full. Make room."


def test_a_failure_is_told_in_its_words(made, qtbot) -> None:
    model = made("--fail-at", 2)
    model.start()
    wait_for(qtbot, model, "failed")
    assert model.run.text == (
        "The loss is not a number. Expected: finite errors. Choose a lower learning rate."
    )
    assert model.run.history.best.epoch == 1


@pytest.mark.skipif(sys.platform == "win32", reason="the pretended run kills itself as Unix does")
def test_a_killed_run_has_died_and_goes_on(made, qtbot) -> None:
    model = made("--die-at", 1)
    model.start()
    wait_for(qtbot, model, "died")
    qtbot.waitUntil(lambda: not model.why_not_start)
    model.resume()
    wait_for(qtbot, model, "finished")
    assert [point.epoch for point in model.run.history.epoch_points] == [1, 2, 3]


def test_the_next_window_finds_the_run(made, qtbot) -> None:
    first = made("--rest-at", 1)
    first.start()
    wait_for(qtbot, first, "running")
    path = first.run.folder.path
    first.close()
    assert TrainingFolder(path).live
    second = made()
    with qtbot.waitSignal(second.noted, timeout=5_000) as said:
        second.look_for_runs()
    assert said.args == [f"{path.name} is under way. The Train panel shows it."]
    assert second.run.folder.path == path
    wait_for(qtbot, second, "running")
    assert second.run.history.best.epoch == 1
    second.tell("stop")
    wait_for(qtbot, second, "stopped")


def test_the_next_window_shows_what_ended_meanwhile(made, qtbot) -> None:
    settings = Settings.forgetful()
    first = made(settings=settings)
    first.start()
    path = first.run.folder.path
    qtbot.waitUntil(lambda: TrainingFolder(path).exists, timeout=15_000)
    first.close()
    qtbot.waitUntil(lambda: not TrainingFolder(path).live, timeout=15_000)
    second = made(settings=settings)
    second.look_for_runs()
    wait_for(qtbot, second, "finished")
    assert second.run.folder.path == path
    # Not shown again once it was put away.
    second.select(None)
    third = made(settings=settings)
    with qtbot.waitSignal(third._lister.finished):
        third.look_for_runs()
    assert third.run is None
    assert [run.path for run in third.known] == [path]
    third.select(path)
    wait_for(qtbot, third, "finished")
    third.delete()
    assert third.run is None
    assert not path.exists()


def test_a_torn_line_waits_and_a_damaged_one_is_left_out(made, qtbot, tmp_path) -> None:
    model = made("--rest-at", 1)
    model.start()
    qtbot.waitUntil(lambda: model.run and len(model.run.history.epoch_points) == 1, timeout=15_000)
    line = (
        '{"event": "epoch", "epoch": 2, "step": 8, "train_rmse": 0.3, "validation_rmse": 0.2,'
        ' "validation_mae_mps": 0.1, "best": true, "elapsed_s": 9, "left_s": 1}\n'
    )
    with model.run.folder.progress.open("a") as progress:
        progress.write('{"event": "epoch", "epoch": "many"}\n[1]\nnonsense\n' + line[:40])
        progress.flush()
        with qtbot.waitSignal(model.run._looker.finished):
            model.run.poll()
        assert len(model.run.history.epoch_points) == 1
        progress.write(line[40:])
    qtbot.waitUntil(lambda: len(model.run.history.epoch_points) == 2)
    assert model.run.history.best.validation_rmse == 0.2
    model.tell("cancel")
    qtbot.waitUntil(lambda: model.run is None, timeout=15_000)


def test_a_run_deleted_by_somebody_else_is_put_away(made, qtbot) -> None:
    model = made()
    model.start()
    wait_for(qtbot, model, "finished")
    TrainingFolder(model.run.folder.path).discard()
    qtbot.waitUntil(lambda: model.run is None, timeout=5_000)


@pytest.mark.parametrize("same_people", [False, True])
def test_stores_are_learnt_from_as_the_library_does(
    made, qtbot, pairs, tmp_path, same_people
) -> None:
    """Who is learnt from, and how many segments that gives, is what the library finds."""
    write_pairs(tmp_path / "more.zarr", subjects=3, frames=200)
    first = tmp_path / "first.zarr"
    copytree(pairs, first)
    for store in (first, tmp_path / "more.zarr") if same_people else ():
        header = (store / "zarr.json").read_text()
        made_by = '"provenance": {"made_by": "sd2 pairs mars"}'
        (store / "zarr.json").write_text(re.sub(r'"provenance": \{[^}]*\}', made_by, header))
    model = made()
    model.setup.remove(model.setup.data[0].path)
    model.setup.add(first)
    model.setup.add(tmp_path / "more.zarr" / "zarr.json")
    qtbot.waitUntil(lambda: not model.setup.problem)
    config = model.setup.config
    data = prepare(read_mixed(config.data.pairs), config.data)
    assert model.setup.division == data.split
    assert model.setup.segments == len(data.training)
    write_pairs(tmp_path / "other.zarr", subjects=3, bins=16)
    model.setup.add(tmp_path / "other.zarr")
    qtbot.waitUntil(lambda: "differ in their velocity axis" in model.setup.problem)
    with pytest.raises(Sd2Error, match="differ in their velocity axis"):
        model.start()


def test_one_person_is_divided_by_takes_and_that_is_said(made, qtbot, tmp_path) -> None:
    model = made()
    model.setup.remove(model.setup.data[0].path)
    assert model.setup.problem == "Add pairs to learn from."
    model.setup.add(write_pairs(tmp_path / "take.zarr", subjects=1))
    qtbot.waitUntil(lambda: not model.setup.problem)
    assert model.setup.division.by_take
    model.setup.remove(tmp_path / "take.zarr")
    model.setup.add(write_pairs(tmp_path / "one.zarr", subjects=1, takes=5))
    qtbot.waitUntil(lambda: not model.setup.problem)
    assert model.setup.division.by_take
    assert "stays unknown" in division_text(model.setup.division)
    config = model.setup.config
    learnt = prepare(read_mixed(config.data.pairs), config.data).training
    assert model.setup.segments == len(learnt)


def test_the_command_is_one_that_sd2_takes(made) -> None:
    """What the panel copies is parsed into the settings that it shows."""
    settings = Settings.forgetful()
    model = made(settings=settings)
    chosen = {
        "model": "gru", "batch_size": 8, "learning_rate": 0.001, "range_factor": 1.5,
        "early_stopping_epochs": 9, "seed": 4,
    }  # fmt: skip
    for name, value in chosen.items():
        model.setup.set_value(name, value)
    words = shlex.split(model.command)
    assert words[0] == "sd2"
    typed = record_of(full_parser().parse_args(words[1:]))
    assert _config(typed) == model.setup.config
    # And what is kept is there at the next start.
    again = made(settings=settings)
    assert {name: again.setup.value(name) for name in chosen} == chosen
    assert [store.path for store in again.setup.data] == list(model.setup.config.data.pairs)


def test_the_time_is_known_once_a_run_has_measured_its_steps(made) -> None:
    model = made()
    setup = model.setup
    assert (setup.segments, setup.steps, setup.step_s) == (20, 3, None)
    keep_pace(model.setup.config.pace_kind, 10.0, 40)
    assert model.setup.step_s == 0.25
    model.setup.set_value("epochs", 9)
    assert (model.setup.steps, model.setup.step_s) == (9, 0.25)
    # Other steps are another matter.
    model.setup.set_value("batch_size", 8)
    assert (model.setup.steps, model.setup.step_s) == (27, None)


def test_a_process_outlives_who_started_it_and_is_seen_to_end(qtbot, tmp_path) -> None:
    script = "import time; print('here', flush=True); time.sleep(0.3); raise SystemExit('gone')"
    process = launch([sys.executable, "-c", script], tmp_path / "out", {"A": "1"})
    assert process.is_alive
    qtbot.waitUntil(lambda: last_output(tmp_path / "out") == "here", timeout=10_000)
    if sys.platform != "win32":
        assert os.getsid(process.pid) == process.pid
    qtbot.waitUntil(lambda: not process.is_alive, timeout=10_000)
    assert last_output(tmp_path / "out") == "here\ngone"
    with pytest.raises(Sd2Error, match="cannot be started"):
        launch(["/no/such/program"], tmp_path / "out")
    assert last_output(tmp_path / "nothing") == ""
