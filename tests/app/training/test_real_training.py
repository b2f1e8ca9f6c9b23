"""The window's models and ``sd2 train`` itself, on a small set of pairs."""

from __future__ import annotations

import os
import signal
import sys

import pytest
from training_pairs import write_pairs

from sd2app.settings import Settings
from sd2app.training.model import TrainingModel
from sd2core.denoise.files import describe_model

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]

PATIENCE_MS = 600_000
"""Until a wait is given up: trainings give way to whatever else the machine does."""


@pytest.fixture
def model(qtbot, tmp_path):
    model = TrainingModel(Settings.forgetful(), folder=tmp_path / "runs")
    model.setup.add(write_pairs(tmp_path / "campaign.zarr"))
    for name, value in (("model", "gru"), ("epochs", 4), ("batch_size", 8)):
        model.setup.set_value(name, value)
    qtbot.waitUntil(lambda: not model.setup.problem, timeout=20_000)
    yield model
    if model.under_way and model.run.folder.exists:
        os.kill(model.run.folder.status().pid, signal.SIGKILL)
    model.close()


def wait_for(qtbot, model, phase: str) -> None:
    qtbot.waitUntil(lambda: model.run is not None and model.run.phase == phase, timeout=PATIENCE_MS)


def test_it_trains_a_model(model, qtbot) -> None:
    model.start()
    qtbot.waitUntil(lambda: model.run.folder.live and model.run.folder.exists, timeout=PATIENCE_MS)
    if sys.platform != "win32":
        pid = model.run.folder.status().pid
        assert os.getpriority(os.PRIO_PROCESS, pid) == min(os.nice(0) + 10, 19)
    wait_for(qtbot, model, "finished")
    history = model.run.history
    assert [point.epoch for point in history.epoch_points] == [1, 2, 3, 4]
    # 20 segments in steps of 8.
    assert (history.segments, history.steps_per_epoch, history.share) == (20, 3, 1.0)
    assert history.epoch_points[-1].train_rmse < history.epoch_points[0].train_rmse
    card = describe_model(model.run.folder.best)
    assert (card.model, card.trained_on, card.axis.bins) == ("gru", "simulated", 32)
    assert model.run.config == model.setup.config


def test_killed_it_goes_on_and_cancelled_it_leaves_nothing(model, qtbot) -> None:
    model.setup.set_value("epochs", 400)
    model.start()
    qtbot.waitUntil(lambda: model.run.history.epoch >= 2, timeout=PATIENCE_MS)
    model.tell("pause")
    wait_for(qtbot, model, "paused")
    model.tell("run")
    wait_for(qtbot, model, "running")
    model.tell("stop")
    wait_for(qtbot, model, "stopped")
    done = len(model.run.history.epoch_points)
    assert done >= 1
    assert model.run.has_model
    model.resume()
    wait_for(qtbot, model, "running")
    qtbot.waitUntil(lambda: len(model.run.history.epoch_points) > done, timeout=PATIENCE_MS)
    os.kill(model.run.folder.status().pid, signal.SIGKILL)
    wait_for(qtbot, model, "died")
    assert model.run.resumable
    model.resume()
    wait_for(qtbot, model, "running")
    folder = model.run.folder
    model.tell("cancel")
    qtbot.waitUntil(lambda: model.run is None, timeout=PATIENCE_MS)
    qtbot.waitUntil(lambda: not list(folder.path.parent.iterdir()), timeout=20_000)


def test_what_sd2_refuses_is_told_in_its_words(model, qtbot, tmp_path) -> None:
    """The pairs were spoilt after they were looked at."""
    (tmp_path / "campaign.zarr" / "radar").rename(tmp_path / "radar")
    model.start()
    wait_for(qtbot, model, "failed")
    assert "radar is missing" in model.run.text
    assert "Traceback" not in model.run.text
