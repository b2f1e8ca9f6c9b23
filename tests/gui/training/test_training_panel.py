"""The Train panel by real mouse and key events; the training itself is pretended."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest
from answering import answer
from finding import button_of
from PySide6.QtCore import QCoreApplication, QEvent, QObject, QRect, Qt, QTimer, Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import (
    QApplication,
    QFileDialog,
    QLabel,
    QProgressBar,
    QToolButton,
    QToolTip,
)
from training_pairs import write_pairs
from window_models import NoShell

from sd2app.background import run_monitor
from sd2app.session.display import DisplayModel
from sd2app.session.maps import MapModel
from sd2app.session.session import Maps
from sd2app.settings import Settings
from sd2app.shell.side_panel import SidePanel
from sd2app.training.feature import TrainingRunView, TrainingSetupView, may_leave, open_run
from sd2app.training.model import TrainingModel
from sd2app.training.result import ModelAdoption
from sd2app.widgets.chart import ChartView
from sd2app.widgets.inputs import Choice, NumberBox
from sd2app.widgets.run_panel import RunPanel
from sd2app.widgets.theme import apply_theme
from sd2core.errors import Sd2Error
from sd2core.recording.recording import open_recording
from sd2core.runs.pace import keep_pace

FAKE = Path(__file__).resolve().parents[2] / "fake_train.py"


@pytest.fixture(autouse=True)
def quick(monkeypatch) -> None:
    """Look more often than a person would."""
    monkeypatch.setattr(run_monitor, "POLL_MS", 40)


class FakeDenoising(QObject):
    """Remembers what it was told."""

    changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.path: Path | None = None
        self.busy = self.comparing = False

    def use(self, path: Path | None) -> None:
        self.path = path
        self.changed.emit()

    def set_comparing(self, comparing: bool) -> None:
        self.comparing = comparing
        self.changed.emit()


class SayingShell(NoShell):
    """Keeps the sentences of what went wrong."""

    def __init__(self, said: list[str]) -> None:
        self._said = said

    def warn(self, text: str) -> None:
        self._said.append(text)

    def attempt(self, work: Callable[[], object]) -> object:
        try:
            return work()
        except (Sd2Error, OSError) as error:
            self.warn(str(error))
            return None


class Window:
    """A panel with all that is behind it."""

    def __init__(self, folder: Path, options: tuple[object, ...], settings: Settings) -> None:
        command = [sys.executable, "-u", str(FAKE), *map(str, options)]
        self.training = TrainingModel(settings, None, command, folder / "runs")
        self.denoise = FakeDenoising()
        maps = Maps(*map(MapModel, ("Synthetic", "Denoised", "Before", "Real")))
        self.use = ModelAdoption(self.training, self.denoise, maps, lambda: folder / "models")
        self.said: list[str] = []
        self.display = DisplayModel()
        self.document = SimpleNamespace(recording=None, modified=False)
        shell = SayingShell(self.said)
        setup = TrainingSetupView(self.training, self.document, shell)
        run = TrainingRunView(self.training, self.use, self.display, shell)
        other = "Open a run…", partial(open_run, self.training, shell)
        self.panel = RunPanel(self.training, setup, run, "Runs", other)
        self.side = SidePanel({"Train": self.panel}, QAction("Over maps"))
        self.side.resize(300, 520)
        self.side.show()

    def close(self) -> None:
        run = self.training.run
        if run is not None and run.under_way and run.folder.exists:
            os.kill(run.folder.status().pid, signal.SIGKILL)
        self.training.close()
        self.side.close()
        self.side.deleteLater()


@pytest.fixture
def made(qtbot, tmp_path):
    windows: list[Window] = []

    def make(*options: object, settings: Settings | None = None) -> Window:
        window = Window(tmp_path, options, settings or Settings.forgetful())
        windows.append(window)
        qtbot.waitExposed(window.side)
        return window

    yield make
    for window in windows:
        window.close()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


@pytest.fixture
def pairs(tmp_path) -> Path:
    return write_pairs(tmp_path / "campaign.zarr")


def texts(window) -> str:
    return "\n".join(one.text() for one in window.panel.findChildren(QLabel) if one.isVisible())


def buttons(window) -> list[QToolButton]:
    return [b for b in window.panel.findChildren(QToolButton) if b.isVisible()]


def button(window, text: str) -> QToolButton:
    found = [one for one in buttons(window) if one.text() == text]
    assert len(found) == 1, text
    return found[0]


def click(window, qtbot, text: str) -> None:
    qtbot.mouseClick(button(window, text), Qt.MouseButton.LeftButton)


def box(window, tip: str) -> NumberBox:
    return next(b for b in window.panel.findChildren(NumberBox) if b.toolTip().startswith(tip))


def type_number(qtbot, number_box: NumberBox, text: str) -> None:
    number_box.setFocus()
    number_box.selectAll()
    qtbot.keyClicks(number_box, text)
    qtbot.keyClick(number_box, Qt.Key.Key_Return)


def ready(window, qtbot, pairs, epochs: int = 3) -> None:
    window.training.setup.add(pairs)
    window.training.setup.set_value("epochs", epochs)
    qtbot.waitUntil(lambda: not window.training.setup.problem)


def begun(window, qtbot, pairs, phase: str, epochs: int = 3) -> None:
    ready(window, qtbot, pairs, epochs)
    click(window, qtbot, "Start training")
    qtbot.waitUntil(lambda: window.training.run.phase == phase, timeout=15_000)


def test_without_pairs_the_panel_says_where_they_come_from(made) -> None:
    window = made()
    assert "sd2 simulate campaign" in texts(window)
    assert not button(window, "Start training").isEnabled()
    assert not button(window, "Copy command").isEnabled()


def test_what_is_set_up_is_what_is_started(made, qtbot, pairs) -> None:
    window = made()
    setup = window.training.setup
    setup.add(pairs)
    qtbot.waitUntil(lambda: "6 people" in texts(window))
    assert "Learns from 4 people; the best model is chosen by s4; s5 kept for" in texts(window)
    # 300 frames are 5 segments, and four people learn from: 20 in one step of 64.
    assert setup.segments == 20
    assert "Time: not known yet" in texts(window)
    assert "20 segments, 500 steps. The first ones tell how long it takes." in texts(window)
    keep_pace(setup.config.pace_kind, 10.0, 40)
    setup.changed.emit()
    assert "Takes about 2 min" in texts(window)  # 500 × 0.25 s
    assert "20 segments, 500 steps of about 250 ms, as measured here before." in texts(window)
    type_number(qtbot, box(window, "Passes"), "3")
    type_number(qtbot, box(window, "Segments of a batch"), "8")
    model = next(c for c in window.panel.findChildren(Choice) if c.toolTip() == "Kind of model")
    model.setFocus()
    qtbot.keyClick(model, Qt.Key.Key_End)
    assert setup.value("model") == "s4-serial"
    qtbot.keyClick(model, Qt.Key.Key_Home)
    click(window, qtbot, "More settings")
    type_number(qtbot, box(window, "End after"), "7")
    assert setup.config.training.early_stopping_epochs == 7
    click(window, qtbot, "Copy command")
    command = QApplication.clipboard().text()
    assert command.startswith(f"sd2 train {pairs} --out ")
    for words in ("--model s4", "--background", "--batch-size 8", "--epochs 3"):
        assert words in command
    assert "--early-stopping 7" in command
    click(window, qtbot, "Reset")
    assert (setup.value("epochs"), setup.value("batch_size")) == (500, 64)


def test_it_learns_from_joints_or_goes_on_from_a_model(made, qtbot, pairs, tmp_path) -> None:
    window = made()
    setup = window.training.setup
    setup.add(pairs)
    qtbot.waitUntil(lambda: "6 people" in texts(window))
    choices = {c.toolTip(): c for c in window.panel.findChildren(Choice)}
    kind = choices["Kind of model"]
    (inputs,) = (c for tip, c in choices.items() if tip.startswith("What it learns from"))
    (start,) = (c for tip, c in choices.items() if tip.startswith("Go on from"))
    inputs.setFocus()
    qtbot.keyClick(inputs, Qt.Key.Key_End)
    assert setup.value("inputs") == "kinematics"
    assert "not split by the parts of the body" in texts(window)
    assert not button(window, "Start training").isEnabled()
    qtbot.keyClick(inputs, Qt.Key.Key_Home)
    assert button(window, "Start training").isEnabled()
    # The bundled models, by their titles.
    assert start.count() >= 3
    start.setFocus()
    while setup.value("start") != "denoiser":  # the bundled one that takes the map
        before = start.currentIndex()
        qtbot.keyClick(start, Qt.Key.Key_Down)
        assert start.currentIndex() > before
    assert not kind.isEnabled()
    assert not inputs.isEnabled()
    assert "Goes on from" in texts(window)
    click(window, qtbot, "Copy command")
    command = QApplication.clipboard().text()
    assert f"--from {setup.start.path}" in command
    assert "--model" not in command
    qtbot.keyClick(start, Qt.Key.Key_Home)
    assert setup.start is None
    assert kind.isEnabled()


def test_the_open_recording_is_made_into_pairs(made, qtbot, small_recording) -> None:
    window = made()
    menu = button(window, "Add pairs").menu()

    def this() -> QAction:
        menu.aboutToShow.emit()
        return next(one for one in menu.actions() if one.text() == "Make of this recording")

    assert not this().isEnabled()
    assert "mesh and a radar" in this().toolTip()
    window.document.recording = open_recording(small_recording)
    window.document.modified = True
    assert this().toolTip() == "Save the recording first"
    window.document.modified = False
    maker = window.training.pair_maker
    maker._command = (sys.executable, "-c", "import time; time.sleep(3600)")
    this().trigger()
    assert maker.out is not None
    assert maker.out.name == "ball.zarr"
    assert this().toolTip() == "Pairs are being made"
    maker.tell("stop")
    qtbot.waitUntil(lambda: maker.out is None, timeout=10_000)


def test_a_store_that_is_none_is_named_and_can_be_taken_out(made, qtbot, tmp_path) -> None:
    window = made()
    (tmp_path / "empty").mkdir()
    window.training.setup.add(tmp_path / "empty")
    qtbot.waitUntil(lambda: "holds no pairs" in texts(window))
    assert not button(window, "Start training").isEnabled()
    click(window, qtbot, "✕")
    assert window.training.setup.data == ()
    assert window.training.setup.known == [tmp_path / "empty"]


def test_a_run_that_lies_elsewhere_is_opened(made, qtbot, pairs, tmp_path, monkeypatch) -> None:
    place = tmp_path / "elsewhere"
    place.mkdir()
    words = ["train", str(pairs), "--out", str(place / "mine"), "--epochs", "2"]
    subprocess.run([sys.executable, str(FAKE), *words], check=True)
    window = made()
    runs = next(c for c in window.panel.findChildren(Choice) if c.toolTip().startswith("Runs"))
    chosen = [tmp_path, place / "mine"]
    monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *a: str(chosen.pop(0)))
    runs.setFocus()
    qtbot.keyClick(runs, Qt.Key.Key_End)
    assert "is no run" in window.said[-1]
    assert runs.currentText() == "New training"
    qtbot.keyClick(runs, Qt.Key.Key_End)
    qtbot.waitUntil(lambda: "Finished after 2 epochs" in texts(window), timeout=5_000)
    assert runs.currentText() == "mine"
    qtbot.keyClick(runs, Qt.Key.Key_Home)
    assert window.training.run is None


def make_of_recordings(window) -> None:
    """Choose that in the menu of data."""
    menu = button(window, "Add pairs").menu()
    menu.aboutToShow.emit()
    next(one for one in menu.actions() if one.text() == "Make of recordings…").trigger()


def test_recordings_are_made_into_pairs(made, qtbot, tmp_path, small_recording, monkeypatch):
    """Of the panel; that the command makes pairs is tested where it is."""
    window = made()
    maker = window.training.pair_maker
    script = "import sys, time; time.sleep(0.5); sys.exit('sd2: There is no room.')"
    maker._command = (sys.executable, "-c", script)
    asked: list[object] = []
    monkeypatch.setattr(
        QFileDialog,
        "getExistingDirectory",
        lambda *a: asked.append(a) or str(small_recording),
    )

    def choose() -> None:
        menu = QApplication.activePopupWidget()
        if menu is None:
            QTimer.singleShot(20, choose)
            return
        action = next(one for one in menu.actions() if one.text() == "Make of recordings…")
        qtbot.mouseClick(menu, Qt.MouseButton.LeftButton, pos=menu.actionGeometry(action).center())

    QTimer.singleShot(20, choose)
    click(window, qtbot, "Add pairs")
    assert len(asked) == 1
    assert "Making ball.zarr" in texts(window)
    said: list[str] = []
    window.training.failed.connect(said.append)
    qtbot.waitUntil(lambda: said == ["There is no room."], timeout=10_000)
    qtbot.waitUntil(lambda: "Making" not in texts(window))
    maker._command = (sys.executable, "-c", "import time; time.sleep(3600)")
    make_of_recordings(window)
    click(window, qtbot, "Cancel")
    assert "Cancelling… ball.zarr" in texts(window)
    qtbot.waitUntil(lambda: maker.out is None, timeout=10_000)
    # What was made is learnt from; where there are no recordings that is said.
    maker.made.emit(write_pairs(tmp_path / "made.zarr"))
    qtbot.waitUntil(lambda: "made.zarr" in texts(window))
    monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *a: str(tmp_path))
    make_of_recordings(window)
    assert "no recording with a mesh and a radar capture" in window.said[-1]


def test_a_run_is_watched_paused_and_stopped(made, qtbot, pairs) -> None:
    window = made("--step-s", 0.05)
    begun(window, qtbot, pairs, "running", epochs=200)
    qtbot.waitUntil(lambda: window.training.run.history.best is not None, timeout=15_000)
    qtbot.waitUntil(lambda: "Training · epoch" in texts(window))
    assert "about" in texts(window)
    assert "Peak velocity, MAE" in texts(window)
    assert "123,456 parameters" in texts(window)
    assert window.panel.findChild(ChartView).isVisible()
    assert any(bar.isVisible() for bar in window.panel.findChildren(QProgressBar))
    click(window, qtbot, "Pause")
    assert "Pausing…" in texts(window)
    qtbot.waitUntil(lambda: "Paused" in texts(window), timeout=10_000)
    click(window, qtbot, "Continue")
    qtbot.waitUntil(lambda: window.training.run.phase == "running", timeout=10_000)
    click(window, qtbot, "Stop")
    assert "Stopping, the best model is kept" in texts(window)
    qtbot.waitUntil(lambda: "Stopped after" in texts(window), timeout=10_000)
    assert button(window, "Use this model").isEnabled()
    assert button(window, "Resume").isEnabled()
    click(window, qtbot, "New")
    assert button(window, "Start training").isVisible()


def test_what_deletes_never_comes_to_where_another_button_was(made, qtbot, pairs) -> None:
    window = made("--step-s", 0.05)
    view = window.panel.findChild(TrainingRunView)
    harmless, deleting = [], []

    def look() -> None:
        for one in view.findChildren(QToolButton):
            if one.isVisible():
                deletes = one.text() == "Delete…"
                (deleting if deletes else harmless).append(QRect(one.geometry()))

    begun(window, qtbot, pairs, "running", epochs=200)
    qtbot.waitUntil(lambda: window.training.run.history.best is not None, timeout=15_000)
    for text, phase, then in (
        (None, "running", "Pause"),
        ("Pause", "paused", "Continue"),
        ("Stop", "stopped", "Use this model"),
    ):  # fmt: skip
        if text:
            click(window, qtbot, text)
        qtbot.waitUntil(lambda phase=phase: window.training.run.phase == phase, timeout=15_000)
        qtbot.waitUntil(button_of(view, then).isVisible, timeout=5_000)
        for widget in (window.panel, view):
            widget.layout().activate()
        look()
    assert len(deleting) == 3
    assert not [(a, b) for a in deleting for b in harmless if a.intersects(b)]


def test_cancelling_is_said_at_once(made, qtbot, pairs) -> None:
    window = made("--rest-at", 1)
    begun(window, qtbot, pairs, "running")
    asked: list[str] = []
    answer(qtbot, "Cancel", asked)
    click(window, qtbot, "Delete…")
    run = window.training.run
    assert run.phase == "running", "the question was answered with no"
    assert run.path.name in asked[0]
    assert "deleted" in asked[0]
    answer(qtbot, "Discard")
    click(window, qtbot, "Delete…")
    assert "Cancelling…" in texts(window)
    assert not button(window, "Stop").isEnabled()
    # What becomes of it is decided.
    assert may_leave(window.training, None)
    qtbot.waitUntil(lambda: window.training.run is None, timeout=15_000)
    assert button(window, "Start training").isVisible()


def test_a_failure_is_shown_in_words(made, qtbot, pairs) -> None:
    window = made("--fail-at", 2)
    begun(window, qtbot, pairs, "failed")
    assert "Failed after 1 epoch" in texts(window)
    assert "The loss is not a number. Expected: finite errors." in texts(window)
    assert "The best model up to then is kept." in texts(window)


@pytest.mark.skipif(sys.platform == "win32", reason="the pretended run kills itself as Unix does")
def test_a_killed_run_says_what_to_do(made, qtbot, pairs) -> None:
    window = made("--die-at", 2)
    begun(window, qtbot, pairs, "died")
    assert "Ended unexpectedly after 2 epochs" in texts(window)
    assert "Resume goes on from the last checkpoint" in texts(window)
    click(window, qtbot, "Resume")
    qtbot.waitUntil(lambda: "Finished after 3 epochs" in texts(window), timeout=15_000)


def test_one_click_uses_the_model_and_one_goes_back(made, qtbot, pairs, tmp_path) -> None:
    window = made()
    before = tmp_path / "denoiser.safetensors"
    window.denoise.path = before
    begun(window, qtbot, pairs, "finished")
    click(window, qtbot, "Use this model")
    kept = window.denoise.path
    assert kept.parent == tmp_path / "models"
    assert kept.read_bytes() == window.training.run.folder.best.read_bytes()
    assert window.denoise.comparing
    assert "Open a recording with a radar capture" in texts(window)
    assert "Use this model" not in [b.text() for b in buttons(window)]
    click(window, qtbot, "Go back")
    assert window.denoise.path == before
    assert not window.denoise.comparing
    # What was put to use stays when its run is deleted.
    folder = window.training.run.folder.path
    answer(qtbot, "Discard")
    click(window, qtbot, "Delete…")
    assert not folder.exists()
    assert kept.exists()


def test_curves_are_read_by_mouse_and_keys(made, qtbot, pairs) -> None:
    window = made()
    begun(window, qtbot, pairs, "finished")
    curves = window.panel.findChild(ChartView)
    points = window.training.run.history.epoch_points
    places = [curves.place_of(point.epoch, point.validation_rmse) for point in points]
    # Later is further right, and better is lower.
    assert [place.x() for place in places] == sorted(place.x() for place in places)
    assert [place.y() for place in places] == sorted(place.y() for place in places)
    assert all(curves.plot_rect().adjusted(-1, -1, 1, 1).contains(place) for place in places)
    qtbot.mouseMove(curves, places[1].toPoint())
    assert curves.pointed.x == 2
    assert "Epoch 2, better than all before" in QToolTip.text()
    assert "Peak velocity off by 0.2 m/s on average" in QToolTip.text()
    curves.setFocus(Qt.FocusReason.TabFocusReason)
    assert curves.pointed.x == 3
    qtbot.keyClick(curves, Qt.Key.Key_Left)
    qtbot.keyClick(curves, Qt.Key.Key_Left)
    qtbot.keyClick(curves, Qt.Key.Key_Left)
    assert curves.pointed.x == 1
    assert "Training RMSE 1" in curves.accessibleDescription()
    qtbot.keyClick(curves, Qt.Key.Key_Escape)
    assert not curves.hasFocus()


@pytest.mark.slow
def test_everything_is_painted_in_both_themes(made, qtbot, pairs) -> None:
    """Every state is painted without a word from Qt."""
    window = made()
    begun(window, qtbot, pairs, "finished")
    application = QApplication.instance()
    pictures = set()
    for dark in (False, True):
        window.display.set_dark(dark)
        apply_theme(application, dark)
        curves = window.panel.findChild(ChartView)
        picture = curves.grab().toImage()
        pictures.add(picture.pixelColor(1, picture.height() - 1).name())
        window.side.grab()
    apply_theme(application, False)
    assert len(pictures) == 2


@pytest.mark.parametrize(
    ("text", "closes", "phase"),
    [
        ("Keep training in the background", True, "running"),
        ("Stop and keep the best", True, "stopped"),
        ("Cancel and discard", True, None),
        ("Don't close", False, "running"),
    ],
)
def test_closing_asks_what_becomes_of_it(made, qtbot, pairs, text, closes, phase) -> None:
    window = made("--rest-at", 1)
    begun(window, qtbot, pairs, "running")
    answer(qtbot, text)
    assert may_leave(window.training, None) is closes
    run = window.training.run
    if phase is None:
        qtbot.waitUntil(lambda: window.training.run is None, timeout=15_000)
    else:
        qtbot.waitUntil(lambda: run.phase == phase, timeout=15_000)
    assert window.training.closing == "ask"


def test_what_is_always_done_is_not_asked(made, qtbot, pairs) -> None:
    window = made("--rest-at", 1)
    begun(window, qtbot, pairs, "running")
    choice = next(c for c in window.panel.findChildren(Choice) if "closed" in c.toolTip())
    choice.setFocus()
    qtbot.keyClick(choice, Qt.Key.Key_Down)
    assert window.training.closing == "keep"
    assert may_leave(window.training, None)
    qtbot.keyClick(choice, Qt.Key.Key_Down)
    assert may_leave(window.training, None)
    qtbot.waitUntil(lambda: window.training.run.phase == "stopped", timeout=15_000)
    # Nothing is under way any more.
    assert may_leave(window.training, None)
