"""The window of batches, by real mouse and key events; the work itself is pretended."""

from __future__ import annotations

import os
import shutil
import signal
import sys
from pathlib import Path

import pytest
from answering import answer
from copied import copied_record
from finding import named
from PySide6.QtCore import QCoreApplication, QEvent, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QCheckBox,
    QFileDialog,
    QLabel,
    QListWidget,
    QPlainTextEdit,
    QTextBrowser,
    QToolButton,
)
from window_models import models_of

from sd2app.background import run_monitor
from sd2app.batch import questions
from sd2app.batch.feature import BatchWindow
from sd2app.batch.model import BatchModel
from sd2app.settings import Settings
from sd2app.shell.parts import Parts
from sd2app.shell.window import MainWindow
from sd2app.widgets.inputs import Choice
from sd2app.widgets.table import RecordTable
from sd2core.batch.plan_file import read_plan
from sd2core.cli.batch import Batch
from sd2core.mesh.vertex_parts import KINEMATICS
from sd2core.placements.placements import PlacementGrid, write_placements
from sd2core.recording.recording import open_recording
from sd2core.sensor import VirtualSensor

FAKE = Path(__file__).resolve().parents[2] / "fake_batch.py"


@pytest.fixture(autouse=True)
def quick(monkeypatch) -> None:
    """Look more often than a person would."""
    monkeypatch.setattr(run_monitor, "POLL_MS", 40)


@pytest.fixture
def opened(qtbot, compiled_kernels, fake, fake_models, recording_copy):
    """A window on a copy of the small recording, whose batches are pretended."""
    windows: list[MainWindow] = []

    def make(*options: object) -> MainWindow:
        command = [sys.executable, "-u", str(FAKE), *map(str, options)]
        window = MainWindow(
            Settings.forgetful(),
            Parts(accuracy=fake.library, denoisers=fake_models.library, batch_command=command),
        )
        windows.append(window)
        window.show()
        window.populate()
        qtbot.waitUntil(lambda: window.settled, timeout=20_000)
        window.open_paths([recording_copy])
        qtbot.waitUntil(
            lambda: window.settled and models_of(window).synthesis.complete, timeout=20_000
        )
        return window

    yield make
    for window in windows:
        run = models_of(window).batch.run
        if run is not None and run.folder.live:
            os.kill(run.process.pid, signal.SIGKILL)
        models_of(window).document.undo_stack.clear()
        window.close()
        window.deleteLater()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


def begin(window: MainWindow) -> BatchWindow:
    window.action("batch").trigger()
    return window.findChild(BatchWindow)


def button(dialog: BatchWindow, text: str) -> QToolButton:
    return next(b for b in dialog.findChildren(QToolButton) if b.text() == text and b.isVisible())


def click(dialog: BatchWindow, text: str) -> None:
    QTest.mouseClick(button(dialog, text), Qt.MouseButton.LeftButton)


def words(dialog: BatchWindow) -> str:
    return "\n".join(one.text() for one in dialog.findChildren(QLabel) if one.isVisible())


def text_of(dialog: BatchWindow, name: str) -> str:
    """What a page of the window says."""
    return named(dialog, name, QPlainTextEdit).toPlainText()


def ready(qtbot, batch: BatchModel) -> None:
    qtbot.waitUntil(lambda: not batch.why_not_start, timeout=20_000)


def until(qtbot, batch: BatchModel, phase: str) -> None:
    qtbot.waitUntil(
        lambda: batch.run is not None and batch.run.loaded and batch.run.phase == phase,
        timeout=20_000,
    )


def test_a_batch_is_set_up_started_and_its_results_opened(
    opened, qtbot, recording_copy, tmp_path, monkeypatch
):
    window = opened("--fail", 0)
    batch = models_of(window).batch
    dialog = begin(window)
    # What is open is taken along.
    assert batch.setup.data[0].path == recording_copy
    another = shutil.copytree(recording_copy, tmp_path / "more" / "other.sd2")
    monkeypatch.setattr(
        QFileDialog,
        "getOpenFileNames",
        lambda *_: ([str(another / "recording.json")], ""),
    )
    click(dialog, "Add files…")
    paths = dialog.findChild(QListWidget)
    assert paths.count() == 2
    export = next(b for b in dialog.findChildren(QCheckBox) if b.text() == "Export as")
    QTest.mouseClick(export, Qt.MouseButton.LeftButton, pos=export.rect().center() / 4)
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: (str(tmp_path / "made"), ""))
    click(dialog, "Choose…")
    ready(qtbot, batch)
    with monkeypatch.context() as asked:
        plan = tmp_path / "plan of mine.toml"
        asked.setattr(QFileDialog, "getSaveFileName", lambda *_: (str(plan), ""))
        click(dialog, "Copy command…")
    assert copied_record() == Batch(plan=plan, workers=batch.setup.workers)
    assert read_plan(plan).recordings == batch.setup.plan().recordings
    click(dialog, "Start")
    until(qtbot, batch, "finished")
    plan = read_plan(tmp_path / "made" / "plan.toml")
    assert plan.recordings.files == (str(recording_copy), str(another))
    assert (plan.export is None) == (not export.isChecked())
    assert "Finished" in words(dialog)
    assert "2 of 2" in words(dialog)
    qtbot.waitUntil(lambda: bool(batch.results.rows), timeout=20_000)
    shown: list[Path] = []
    monkeypatch.setattr(questions, "show_in_files", shown.append)
    click(dialog, "Open folder")
    assert shown == [tmp_path / "made"]
    click(dialog, "Data set")
    assert "A data set" in named(dialog, "What the data set holds", QTextBrowser).toPlainText()
    click(dialog, "Results")
    table = dialog.findChild(RecordTable)
    table.selectRow(3)
    with qtbot.waitSignal(models_of(window).document.opened, timeout=20_000):
        click(dialog, "Open in the window")
    qtbot.waitUntil(lambda: window.settled, timeout=20_000)
    assert models_of(window).document.recording.folder == another
    assert models_of(window).sensor.sensor.position_m == (1.0, 0.0, 0.25)
    assert open_recording(another).sensor.position_m != (1.0, 0.0, 0.25)
    click(dialog, "New")
    assert button(dialog, "Start")


@pytest.mark.slow
def test_delete_takes_a_recording_from_the_list_and_says_what_is_missing(opened, qtbot):
    window = opened()
    dialog = begin(window)
    ready(qtbot, models_of(window).batch)
    paths = dialog.findChild(QListWidget)
    paths.setCurrentRow(0)
    paths.item(0).setSelected(True)
    QTest.keyClick(paths, Qt.Key.Key_Delete)
    assert paths.count() == 0
    assert "Add recordings to work on." in words(dialog)
    assert not button(dialog, "Start").isEnabled()


@pytest.mark.slow
def test_failures_and_their_reasons_are_shown_and_a_batch_is_stopped(opened, qtbot, recording_copy):
    window = opened("--fail", 1, "--step-s", 30)
    batch = models_of(window).batch
    dialog = begin(window)
    ready(qtbot, batch)
    assert "1 recording: the first tasks tell how long it takes" in words(dialog)
    click(dialog, "Start")
    qtbot.waitUntil(
        lambda: batch.run is not None and bool(batch.run.history.failures), timeout=20_000
    )
    assert "At work" in words(dialog)
    assert "1:00 so far" in words(dialog)
    failures = text_of(dialog, "What could not be done")
    assert "synthesise from place 2: It is damaged" in failures
    click(dialog, "Failures (1)")
    click(dialog, "Log")
    qtbot.waitUntil(lambda: "looked at" in text_of(dialog, "Log"), timeout=20_000)
    click(dialog, "Stop")
    assert "Stopping" in words(dialog)
    assert not button(dialog, "Stop").isEnabled()


@pytest.mark.slow
def test_placements_of_the_recording_or_of_a_file_are_taken(opened, qtbot, tmp_path, monkeypatch):
    window = opened()
    context = models_of(window)
    setup = context.batch.setup
    context.edits.plan_placements(PlacementGrid((1.0, 2.0, 3.0)))
    window.bring_up("Sensor", "Placements")
    window.features.batch.show_with_placements()
    dialog = window.findChild(BatchWindow)
    qtbot.waitUntil(lambda: not setup.problem, timeout=20_000)
    assert setup.plan().placement_count == 3
    choice = named(dialog, "Where sensors are put", Choice)
    assert "3 placements" in choice.currentText()
    # The plan is followed, as long as its recording is open.
    context.edits.plan_placements(PlacementGrid((1.0,)))
    assert setup.placements == PlacementGrid((1.0,))
    assert "1 placement)" in choice.currentText()
    context.edits.plan_placements(None)
    assert setup.placements == PlacementGrid((1.0,))
    assert "what was planned before (1 placement)" in choice.currentText()
    file = tmp_path / "two.json"
    write_placements(file, PlacementGrid((1.0, 2.0)))
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (str(file), ""))
    dialog.activateWindow()
    qtbot.waitUntil(dialog.isActiveWindow)
    choice.setFocus()
    QTest.keyClick(choice, Qt.Key.Key_Home)
    QTest.keyClick(choice, Qt.Key.Key_Down)
    assert "plans no placements" in words(dialog)
    assert setup.placements is None
    QTest.keyClick(choice, Qt.Key.Key_End)
    assert "plans no placements" not in words(dialog)
    assert setup.placements == PlacementGrid((1.0, 2.0))
    assert "two.json (2 placements)" in choice.currentText()
    QTest.keyClick(choice, Qt.Key.Key_Home)
    assert setup.placements is None
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: (str(tmp_path / "plan"), ""))
    qtbot.waitUntil(lambda: not setup.problem, timeout=20_000)
    click(dialog, "Save plan…")
    assert read_plan(tmp_path / "plan.toml") == setup.plan()


@pytest.mark.parametrize("part", ["trunk", pytest.param(KINEMATICS, marks=pytest.mark.slow)])
def test_a_batch_begins_with_planned_places_and_the_model_in_use(
    opened, qtbot, fake_models, tmp_path, part
):
    own = tmp_path / "hall.safetensors"
    own.write_bytes(b"weights")
    fake_models.add(own, 3.0)
    fake_models.add(Path("/models/limbs.safetensors"), 3.0, parts=(part,))
    window = opened()
    c = models_of(window)
    c.denoise.use(own)
    c.edits.plan_placements(PlacementGrid((1.0, 2.0)))
    qtbot.waitUntil(lambda: c.denoise.card is not None, timeout=20_000)
    QTest.keyClick(window, Qt.Key.Key_B, Qt.KeyboardModifier.ControlModifier)
    plan = c.batch.setup
    qtbot.waitUntil(lambda: not plan.problem, timeout=20_000)
    assert plan.placements == PlacementGrid((1.0, 2.0))
    assert plan.plan().denoise.model == next(
        name for name, card in c.denoise.by_name().items() if card.path == own
    )
    choice = named(window.findChild(BatchWindow), "Model to denoise with", Choice)
    assert choice.currentText() == plan.value("model")
    assert not plan.plan().synthesise.limbs
    # One that takes the map of each part of the body has them made.
    QTest.keyClick(choice, Qt.Key.Key_Home)
    while "limbs" not in choice.currentText():
        before = choice.currentIndex()
        QTest.keyClick(choice, Qt.Key.Key_Down)
        assert choice.currentIndex() > before
    assert plan.plan().synthesise.limbs


def test_unsaved_edits_are_asked_about_before_they_would_be_left_out(
    opened, qtbot, recording_copy
) -> None:
    window = opened()
    models = models_of(window)
    dialog = begin(window)
    ready(qtbot, models.batch)
    models.edits.place_sensor(VirtualSensor(position_m=(0.5, 0.0, 0.0)))
    asked: list[str] = []
    answer(qtbot, "Cancel", asked)
    click(dialog, "Start")
    assert models.batch.run is None
    answer(qtbot, "Save", asked)
    click(dialog, "Start")
    assert all("not saved" in one for one in asked)
    assert len(asked) == 2
    qtbot.waitUntil(lambda: models.batch.run is not None, timeout=20_000)
    assert open_recording(recording_copy).sensor.position_m == (0.5, 0.0, 0.0)


@pytest.mark.slow
def test_the_window_closes_and_the_batch_goes_on(opened, qtbot):
    window = opened("--step-s", 20)
    batch = models_of(window).batch
    dialog = begin(window)
    ready(qtbot, batch)
    click(dialog, "Start")
    qtbot.waitUntil(lambda: batch.run is not None and batch.run.folder.live)
    folder = batch.run.folder
    models_of(window).document.undo_stack.clear()
    window.close()
    assert not dialog.isVisible()
    assert folder.live
