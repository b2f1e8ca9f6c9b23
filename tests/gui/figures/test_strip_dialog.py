"""A strip of frames exported from the window, by mouse and keys."""

from __future__ import annotations

import json

import numpy as np
import pytest
from answering import once_asked
from copied import copied_record
from finding import button_of, named
from PIL import Image
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QCheckBox, QFileDialog, QPushButton
from window_models import models_of

from sd2app.figures.feature import StripDialog
from sd2app.figures.model import StripModel


@pytest.fixture
def model(window, qtbot):
    models_of(window).playback.seek_frame(30)
    model = StripModel(models_of(window).document.content, models_of(window).playback.time_s)
    yield model
    model.close()


def settle(model, qtbot):
    qtbot.waitUntil(lambda: not model.busy, timeout=20_000)


def test_frames_as_they_are_chosen(model):
    assert model.frames()[0] == 0
    assert model.frames()[-1] == 59
    assert len(model.frames()) == 8
    model.choose(way="around", count=5, step=10)
    assert model.frames() == [10, 20, 30, 40, 50]
    model.choose(way="list", text="3,7:12:2")
    assert model.frames() == [3, 7, 9, 11]
    model.choose(text="3,")
    assert "3," in model.problem
    model.choose(count=0)
    assert model.choice.count == 1


def test_the_command_draws_the_same_strip(model, window, qtbot):
    dialog = StripDialog(model, models_of(window).display.palette, "strip", window)
    model.choose(count=5)
    model.set_options(as_dots=True, columns=3)
    qtbot.mouseClick(button_of(dialog, "Copy command"), Qt.MouseButton.LeftButton)
    strip = copied_record()
    assert strip.paths == (models_of(window).document.recording.folder,)
    assert (strip.count, strip.frames, strip.columns, strip.dots) == (5, None, 3, True)
    model.choose(way="around", count=2, step=10)
    qtbot.mouseClick(button_of(dialog, "Copy command"), Qt.MouseButton.LeftButton)
    assert copied_record().frames == ",".join(map(str, model.frames()))


@pytest.mark.slow
def test_the_preview_follows_what_is_chosen(model, qtbot):
    model.choose(count=2)
    settle(model, qtbot)
    two = model.picture.shape
    model.choose(count=4)
    settle(model, qtbot)
    assert model.picture.shape[1] > 1.5 * two[1]
    model.set_row("overlay", True)
    assert model.options.rows == ("video", "mesh", "overlay")
    settle(model, qtbot)
    assert model.picture.shape[0] > 1.3 * two[0]
    for row in ("video", "mesh", "overlay"):
        model.set_row(row, False)
    assert model.options.rows == ("overlay",)  # the last one stays


def test_what_is_chosen_while_a_file_is_written_does_not_end_that(model, qtbot, tmp_path):
    settle(model, qtbot)
    with qtbot.waitSignal(model.written, timeout=20_000):
        model.export(tmp_path / "strip.png")
        model.choose(count=3)
    assert (tmp_path / "strip.png").exists()
    assert not model.exporting


def test_what_is_not_there_is_not_offered(empty_window, small_recording, qtbot):
    with qtbot.waitSignal(models_of(empty_window).document.opened, timeout=20_000):
        empty_window.open_paths([small_recording / "video.mp4"])
    model = StripModel(models_of(empty_window).document.content, 0.0)
    assert model.available == ("video",)
    assert model.options.rows == ("video",)
    settle(model, qtbot)
    assert np.ptp(model.picture[..., 0]) > 100
    model.close()


@pytest.mark.slow
def test_exported_by_hand(window, qtbot, tmp_path, monkeypatch):
    path = tmp_path / "strip.png"
    monkeypatch.setattr(
        QFileDialog, "getSaveFileName", lambda *a, **k: (str(path.with_suffix("")), "PNG (*.png)")
    )

    def choose(dialog: StripDialog) -> None:
        model = dialog._model
        model.choose(way="list")
        field = named(dialog, "Frames such as")
        field.clear()
        qtbot.keyClicks(field, "4,8")
        overlay = next(b for b in dialog.findChildren(QCheckBox) if b.text() == "mesh over video")
        qtbot.mouseClick(overlay, Qt.MouseButton.LeftButton, pos=QPoint(8, overlay.height() // 2))
        assert model.options.rows == ("video", "mesh", "overlay")
        button = next(b for b in dialog.findChildren(QPushButton) if b.text() == "Export…")
        qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
        assert not button.isEnabled()

    once_asked(StripDialog, choose)
    qtbot.keyClick(
        window,
        Qt.Key.Key_E,
        Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier,
    )
    said = json.loads(Image.open(path).text["Description"])
    assert said["frames"] == [4, 8]
    assert said["simulated"] is True
    assert said["source"] == str(models_of(window).document.recording.folder)
