"""Nobody looks at empty boxes: the window says what is being read, and how far it is."""

from __future__ import annotations

import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from full_disk import full_disk
from PIL import Image
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel
from window_models import models_of

from sd2app.session import document
from sd2app.session.content import reference_of
from sd2app.session.tasks import Job
from sd2app.settings import Settings
from sd2app.shell import app
from sd2app.shell.loading import LoadingCover
from sd2app.shell.parts import Parts
from sd2app.shell.window import MainWindow
from sd2core.fmcw import processing
from sd2core.maps import DopplerMap


def words(cover: LoadingCover) -> str:
    return " ".join(one.text() for one in cover.findChildren(QLabel) if one.isVisible())


@pytest.fixture
def skeleton(qtbot, tmp_path):
    """The window before anything is imported."""
    window = MainWindow(Settings.forgetful(), Parts(recovery=tmp_path))
    window.show()
    yield window
    window.close()
    window.deleteLater()


def test_the_skeleton_says_that_it_starts(skeleton) -> None:
    cover = skeleton.findChild(LoadingCover)
    assert cover.isVisible()
    assert cover.size() == skeleton.centralWidget().size()
    assert "Starting" in words(cover)


def test_the_cover_goes_where_nothing_is_opened(empty_window) -> None:
    assert not empty_window.findChild(LoadingCover).isVisible()


def test_what_is_read_is_said_at_once_and_until_it_is_there(
    empty_window, qtbot, small_recording
) -> None:
    c, cover = models_of(empty_window), empty_window.findChild(LoadingCover)
    with qtbot.waitSignal(c.document.opened, timeout=20_000):
        empty_window.open_paths([small_recording])
        assert cover.isVisible()
        assert "Opening ball.sd2" in words(cover)
        empty_window.resize(1000, 700)
        assert cover.size() == empty_window.centralWidget().size()
    qtbot.waitUntil(lambda: not cover.isVisible(), timeout=5000)


def test_reading_that_takes_long_shows_how_far_it_is(
    empty_window, qtbot, small_recording, monkeypatch
) -> None:
    c, cover = models_of(empty_window), empty_window.findChild(LoadingCover)
    gate = threading.Event()
    monkeypatch.setattr(document, "recording_of", lambda *_: gate.wait(20))
    cover._patience.setInterval(0)
    empty_window.open_paths([small_recording])
    c.jobs.report(c.document.reading, 250, 300)
    qtbot.waitUntil(cover.bar.isVisible, timeout=5000)
    assert "Reading the radar" in words(cover)
    gate.set()
    assert cover.bar.maximum() == 300
    QTest.mouseClick(cover.cancel, Qt.MouseButton.LeftButton)
    assert not cover.isVisible()
    assert c.document.content is None


def test_a_failure_uncovers_the_window(empty_window, qtbot, tmp_path) -> None:
    cover = empty_window.findChild(LoadingCover)
    with qtbot.waitSignal(models_of(empty_window).document.failed, timeout=20_000):
        empty_window.open_paths([Path(tmp_path / "missing.mp4")])
    assert not cover.isVisible()
    assert "does not exist" in empty_window.messages.text


def test_an_open_recording_stays_in_view_while_another_is_read(window, qtbot, small_recording):
    cover, c = window.findChild(LoadingCover), models_of(window)
    with qtbot.waitSignal(c.document.opened, timeout=20_000):
        window.open_paths([small_recording])
        assert not cover.isVisible()


def test_the_window_fills_itself_once_its_skeleton_is_on_screen(
    qtbot, small_recording, capsys, monkeypatch
) -> None:
    picture, memory_set = small_recording.parent / "window.png", []
    monkeypatch.setattr(app, "keep_little_free_memory", lambda: memory_set.append(True))
    assert app.run([small_recording], screenshot=picture) == 0
    assert memory_set
    assert capsys.readouterr().out == f"Wrote {picture}\n"
    # An empty window has a few colours.
    assert len(np.unique(np.asarray(Image.open(picture)).reshape(-1, 4), axis=0)) > 500


class SlowMachine:
    """A clock on which a turn of the event loop takes a minute, and a compiler that goes on."""

    def __init__(self, kernels: int) -> None:
        self.now_s, self.kernels = 0.0, kernels
        self.job = Job("Compiling the numerical kernels", lambda: None, total=kernels)
        self.ready, self.session = True, SimpleNamespace(jobs=self)

    @property
    def jobs(self) -> tuple[Job, ...]:
        self.job.done = min(int(self.now_s / 60), self.kernels - 1)
        return () if self.settled else (self.job,)

    @property
    def settled(self) -> bool:
        return self.now_s >= 60 * self.kernels

    def monotonic(self) -> float:
        return self.now_s

    def sleep(self, _: float) -> None:
        self.now_s += 60


def test_a_picture_waits_as_long_as_something_is_reported(qtbot, monkeypatch, capsys) -> None:
    machine = SlowMachine(kernels=6)
    monkeypatch.setattr(app, "time", machine)
    assert app.wait_until_settled(QApplication.instance(), machine, limit_s=120)
    assert machine.now_s > 3 * 120
    assert "Waiting: Compiling the numerical kernels (2 of 6)\n" in capsys.readouterr().err


def test_a_picture_does_not_wait_for_what_reports_nothing(qtbot, monkeypatch) -> None:
    machine = SlowMachine(kernels=6)
    monkeypatch.setattr(app, "time", machine)
    monkeypatch.setattr(SlowMachine, "jobs", (Job("Reading", lambda: None),))
    assert not app.wait_until_settled(QApplication.instance(), machine, limit_s=120)
    assert machine.now_s <= 180


def test_a_screenshot_is_whole_or_not_there(qtbot, empty_window, tmp_path, capsys) -> None:
    picture = tmp_path / "window.png"
    picture.write_bytes(b"as before")
    with full_disk(), pytest.raises(OSError, match="too large") as caught:
        app._take_screenshot(QApplication.instance(), empty_window, picture, limit_s=60)
    assert caught.value.filename == str(picture)
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"as before"]
    assert not empty_window.isVisible()
    assert capsys.readouterr().out == ""


def test_a_picture_of_what_cannot_be_opened_is_a_failure(
    qtbot, empty_window, tmp_path, capsys
) -> None:
    note = tmp_path / "notes.txt"
    note.write_text("hello")
    empty_window.open_paths([note])
    application = QApplication.instance()
    assert app._take_screenshot(application, empty_window, tmp_path / "w.png", limit_s=60) == 1
    told = capsys.readouterr()
    assert told.err.startswith("sd2: ")
    assert "notes.txt" in told.err
    assert told.out == ""
    assert [*tmp_path.iterdir()] == [note]


def test_the_map_of_a_capture_comes_after_the_recording(
    empty_window, qtbot, small_recording, monkeypatch
) -> None:
    """A long capture takes minutes; its track is there meanwhile, under its own name."""
    c, gate, doppler_map = models_of(empty_window), threading.Event(), processing.doppler_map

    def slow(*args: Any, **options: Any) -> DopplerMap:
        gate.wait(20)
        return doppler_map(*args, **options)

    monkeypatch.setattr(processing, "doppler_map", slow)
    with qtbot.waitSignal(c.document.opened, timeout=20_000):
        empty_window.open_paths([small_recording])
    assert c.real.title == "Radar (simulated)"
    assert c.real.map is None
    gate.set()
    qtbot.waitUntil(lambda: c.real.map is not None, timeout=20_000)
    assert c.real.reference == reference_of(c.real.map.values, c.real.map.null_bins)
