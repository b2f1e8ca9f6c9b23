"""The Train panel in the whole window; the training itself is pretended."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import pytest
from answering import answer
from PySide6.QtCore import QCoreApplication, QEvent, Qt
from PySide6.QtWidgets import QToolButton
from training_pairs import write_pairs
from window_models import models_of

from sd2app.background import run_monitor
from sd2app.settings import Settings
from sd2app.shell.parts import Parts
from sd2app.shell.window import MainWindow
from sd2app.training.feature import TrainingSetupView
from sd2app.training.model import PairMaker
from sd2core.pairs.store import read_pairs
from sd2core.train.folder import TrainingFolder

FAKE = Path(__file__).resolve().parents[2] / "fake_train.py"


@pytest.fixture
def made(qtbot, compiled_kernels, fake, fake_models, monkeypatch):
    """Makes windows whose training is pretended; options are those of ``fake_train.py``."""
    monkeypatch.setattr(run_monitor, "POLL_MS", 40)
    windows: list[MainWindow] = []

    def make(*options: object, settings: Settings) -> MainWindow:
        command = [sys.executable, "-u", str(FAKE), *map(str, options)]
        window = MainWindow(
            settings,
            Parts(accuracy=fake.library, denoisers=fake_models.library, train_command=command),
        )
        windows.append(window)
        window.resize(1280, 800)
        window.show()
        window.populate()
        qtbot.waitUntil(lambda: window.settled, timeout=20_000)
        return window

    yield make
    for window in windows:
        run = models_of(window).training.run
        if run is not None and run.under_way and run.folder.exists:
            os.kill(run.folder.status().pid, signal.SIGKILL)
        if window.ready:
            models_of(window).training.set_closing("keep")
            models_of(window).document.undo_stack.clear()
        window.close()
        window.deleteLater()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


def click(window: MainWindow, qtbot, text: str) -> None:
    panel = window.findChild(TrainingSetupView).parentWidget()
    found = [b for b in panel.findChildren(QToolButton) if b.text() == text and b.isVisible()]
    assert len(found) == 1, text
    qtbot.mouseClick(found[0], Qt.MouseButton.LeftButton)


@pytest.mark.slow
def test_a_run_outlives_its_window_and_is_found_by_the_next(made, qtbot, tmp_path) -> None:
    settings = Settings.forgetful()
    window = made("--rest-at", 1, settings=settings)
    icon = window.side.button("Train")
    qtbot.keyClick(window, Qt.Key.Key_T, Qt.KeyboardModifier.ShiftModifier)
    assert window.side.shown == "Train"
    training = models_of(window).training
    training.setup.add(write_pairs(tmp_path / "campaign.zarr"))
    training.setup.set_value("epochs", 4)
    qtbot.waitUntil(lambda: not training.setup.problem)
    click(window, qtbot, "Start training")
    qtbot.waitUntil(lambda: icon.toolTip() == "Train · 25 %", timeout=15_000)
    path = training.run.folder.path
    # Beside it the window is used as ever.
    qtbot.keyClick(window, Qt.Key.Key_S)
    assert window.side.shown == "Sensor"
    answer(qtbot, "Don't close")
    window.close()
    assert window.isVisible()
    answer(qtbot, "Keep training in the background")
    window.close()
    assert not window.isVisible()
    assert TrainingFolder(path).live
    again = made(settings=settings)
    training = models_of(again).training
    qtbot.waitUntil(lambda: training.run is not None and training.run.phase == "running")
    assert training.run.folder.path == path
    assert again.messages.text == f"{path.name} is under way. The Train panel shows it."
    assert training.run.history.best.epoch == 1
    training.tell("stop")
    qtbot.waitUntil(lambda: training.run.phase == "stopped", timeout=15_000)
    assert again.side.button("Train").accessibleName() == "Train"


def test_a_trained_model_denoises_the_recording(
    made, qtbot, tmp_path, small_recording, fake_models, own_data
) -> None:
    window = made("--rest-at", 1, settings=Settings.forgetful())
    c = models_of(window)
    window.open_paths([small_recording])
    qtbot.waitUntil(lambda: window.settled and c.synthesis.complete, timeout=20_000)
    c.training.setup.add(write_pairs(tmp_path / "campaign.zarr"))
    qtbot.waitUntil(lambda: not c.training.setup.problem)
    c.training.start()
    qtbot.waitUntil(lambda: c.training.run.history.epoch == 1, timeout=60_000)
    c.training.tell("stop")
    qtbot.waitUntil(lambda: c.training.run.phase == "stopped", timeout=15_000)
    window.side.bring_up("Train")
    kept = own_data / "sd2-studio" / "models" / f"{c.training.run.folder.path.name}.safetensors"
    fake_models.add(kept, 1.0)
    click(window, qtbot, "Use this model")
    qtbot.waitUntil(lambda: c.training_use.gain is not None, timeout=20_000)
    assert c.denoise.path == kept
    assert c.training_use.gain.frames > 0
    assert c.training_use.gain.before_mps is None
    # It is an edit like any other.
    c.document.undo_stack.undo()
    qtbot.waitUntil(lambda: c.training_use.run is None)


@pytest.mark.slow
def test_pairs_are_made_of_a_recording(qtbot, small_recording, tmp_path) -> None:
    """With the command that there is."""
    maker = PairMaker(tmp_path / "pairs")
    with qtbot.waitSignal(maker.made, timeout=120_000) as made:
        maker.make(small_recording)
    pairs = read_pairs(made.args[0])
    assert (pairs.subjects, pairs.frames, pairs.kind) == (("ball",), 60, "simulated")
    assert pairs.labels == ("background", "back", "there")
    maker.close()
