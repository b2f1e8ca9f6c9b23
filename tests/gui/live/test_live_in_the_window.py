"""Listening by real clicks and keys in the whole window; asserted on the models."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from answering import answer, once_asked
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QDialogButtonBox, QFileDialog, QToolButton
from window_models import models_of

from sd2app.live.dialog import ListenDialog
from sd2app.live.feature import LiveBar
from sd2app.live.process import ListenRequest
from sd2app.video.feature import VideoView
from sd2app.widgets.inputs import Choice
from sd2core.io.radar.infineon import write_capture
from sd2core.recording.recording import open_recording
from tests.core.live.fast_captures import fast_swipes

LEFT = Qt.MouseButton.LeftButton
LIMIT_MS = 60_000


@pytest.fixture
def capture(tmp_path: Path) -> Path:
    """Swipes that last three seconds."""
    found = fast_swipes(frames=90, faster=1.0)
    folder = tmp_path / "swipes"
    samples = np.asarray(found.samples[:90])
    write_capture(folder, samples, found.config, found.timebase.times_s, simulated=True)
    return folder


def listen(window, monkeypatch, capture: Path, folder: Path) -> None:
    """Choose a capture that is replayed, and the recording, in the dialog."""
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (str(capture / "radar.npy"), ""))
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: (str(folder), ""))

    def fill(dialog: ListenDialog) -> None:
        begin = next(
            one for one in dialog.findChild(QDialogButtonBox).buttons() if one.text() == "Record"
        )
        assert not begin.isEnabled()
        QTest.keyClick(dialog.findChild(Choice), Qt.Key.Key_Down)
        file_button, folder_button = (
            one for one in dialog.findChildren(QToolButton) if one.text() == "Choose…"
        )
        QTest.mouseClick(file_button, LEFT)
        QTest.mouseClick(folder_button, LEFT)
        QTest.mouseClick(begin, LEFT)

    once_asked(ListenDialog, fill)
    window.action("listen").trigger()


def button(window, text: str) -> QToolButton:
    """Button of the bar, which is to be seen."""
    bar = window.findChild(LiveBar)
    found = next(one for one in bar.findChildren(QToolButton) if one.text() == text)
    assert found.isVisible()
    return found


@pytest.mark.slow
def test_a_radar_is_listened_to_labelled_stopped_and_continued(
    empty_window, qtbot, monkeypatch, capture, tmp_path
):
    window, folder = empty_window, tmp_path / "walk.sd2"
    models, live = models_of(window), window.features.live.model
    listen(window, monkeypatch, capture, folder)
    assert not window.action("listen").isEnabled()
    qtbot.waitUntil(lambda: len(models.playback.timebase) > 5, timeout=LIMIT_MS)
    view = window.maps.real
    assert view.isVisible()
    window.activateWindow()  # no window manager does it after the dialog
    qtbot.waitUntil(window.isActiveWindow, timeout=LIMIT_MS)
    # Keys mark gestures at the newest frame, while they are made.
    begun_s = models.playback.time_s
    QTest.keyClick(window, Qt.Key.Key_1)
    qtbot.waitUntil(lambda: models.playback.time_s > begun_s + 0.2, timeout=LIMIT_MS)
    QTest.keyClick(window, Qt.Key.Key_1)
    (span,) = models.labels.labels.spans
    assert span.start_s >= begun_s
    assert span.end_s - span.start_s > 0.15
    QTest.mouseClick(button(window, "Stop"), LEFT)
    qtbot.waitUntil(lambda: live.state == "stopped", timeout=LIMIT_MS)
    (kept,) = models.labels.labels.spans
    assert kept == span
    qtbot.waitUntil(lambda: window.settled, timeout=LIMIT_MS)
    assert models.document.modified
    before = len(models.playback.timebase)
    QTest.mouseClick(button(window, "Continue"), LEFT)
    qtbot.waitUntil(lambda: len(models.playback.timebase) > before + 3, timeout=LIMIT_MS)
    assert models.playback.frame == len(models.playback.timebase) - 1
    QTest.mouseClick(button(window, "Stop"), LEFT)
    qtbot.waitUntil(lambda: live.state == "stopped", timeout=LIMIT_MS)
    assert window.features.files.save()
    there = open_recording(folder)
    assert there.load_capture().frame_count == len(models.playback.timebase)
    assert [(one.start_s, one.end_s) for one in there.labelled.spans] == [
        (span.start_s, span.end_s)
    ]
    QTest.mouseClick(button(window, "✕"), LEFT)
    assert not window.findChild(LiveBar).isVisible()


def test_a_window_that_closes_asks_and_stores(empty_window, qtbot, monkeypatch, capture, tmp_path):
    window, folder = empty_window, tmp_path / "walk.sd2"
    models = models_of(window)
    listen(window, monkeypatch, capture, folder)
    qtbot.waitUntil(lambda: len(models.playback.timebase) > 3, timeout=LIMIT_MS)
    asked: list[str] = []
    answer(qtbot, "Cancel", asked)
    assert not window.close()
    assert "walk.sd2" in asked[0]
    shown = len(models.playback.timebase)
    answer(qtbot, "Close")
    assert window.close()
    assert open_recording(folder).load_capture().frame_count >= shown


@pytest.mark.slow
def test_a_radar_alone_has_no_empty_pane_and_its_message_leaves_with_it(
    empty_window, qtbot, monkeypatch, capture, tmp_path, small_recording
):
    window, folder = empty_window, tmp_path / "walk.sd2"
    models, live = models_of(window), window.features.live.model
    video = window.findChild(VideoView)
    assert not window.start.isHidden()  # nothing is open
    listen(window, monkeypatch, capture, folder)
    qtbot.waitUntil(lambda: live.state == "stopped", timeout=LIMIT_MS)
    assert not video.isVisible()
    alone_px = window.maps.width()
    assert window.findChild(LiveBar).isVisible()
    models.document.open([small_recording])
    qtbot.waitUntil(lambda: not live.on_screen and window.settled, timeout=LIMIT_MS)
    assert not window.findChild(LiveBar).isVisible()
    assert video.isVisible()
    assert window.maps.width() < alone_px - 200


@pytest.mark.slow
def test_a_camera_that_is_filmed_has_its_pane(empty_window, qtbot, tmp_path):
    window, folder = empty_window, tmp_path / "walk.sd2"
    live, video = window.features.live.model, window.findChild(VideoView)
    live.start(ListenRequest(folder, way="test", camera="test"))
    qtbot.waitUntil(lambda: live.on_screen and live.pictures > 30, timeout=LIMIT_MS)
    qtbot.waitUntil(video.isVisible, timeout=LIMIT_MS)
    live.stop()
    qtbot.waitUntil(lambda: live.state == "stopped" and window.settled, timeout=LIMIT_MS)
    assert live.on_screen
    assert video.isVisible()
    assert window.findChild(LiveBar).isVisible()
