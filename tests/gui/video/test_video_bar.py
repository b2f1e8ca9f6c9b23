"""The bar over the video, by mouse and keys."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QSlider, QToolButton
from whole_window import opened
from window_models import models_of

from sd2app.video.feature import VideoBar, VideoView
from sd2core.recording.recording import open_recording


def buttons(window):
    bar = window.findChild(VideoBar)
    return bar.findChild(QSlider), *bar.findChildren(QToolButton)


def test_mesh_dots_and_opacity(window, qtbot):
    slider, mesh, dots = buttons(window)
    overlay = models_of(window).overlay
    qtbot.mouseClick(mesh, Qt.MouseButton.LeftButton)
    assert not overlay.style.shown
    assert not slider.isEnabled()
    qtbot.keyClick(window, Qt.Key.Key_M)
    assert overlay.style.shown
    assert mesh.isChecked()
    qtbot.mouseClick(dots, Qt.MouseButton.LeftButton)
    assert overlay.style.as_dots
    qtbot.keyClick(window, Qt.Key.Key_M, Qt.KeyboardModifier.ShiftModifier)
    assert not overlay.style.as_dots
    before = overlay.style.opacity
    qtbot.mouseClick(
        slider, Qt.MouseButton.LeftButton, pos=QPoint(slider.width() - 3, slider.height() // 2)
    )
    assert overlay.style.opacity > before


@pytest.mark.slow
def test_the_video_shows_the_mesh_as_strongly_as_asked(window, qtbot):
    from sd2app.video.feature import VideoView

    view = window.findChild(VideoView)
    models_of(window).playback.seek_frame(0)
    qtbot.waitUntil(lambda: models_of(window).video.shown_frame == 0)

    def middle():
        colour = view.grab().toImage().pixelColor(view.width() // 2, view.height() // 2)
        return colour.red(), colour.green(), colour.blue()

    overlay = models_of(window).overlay
    overlay.set_style(shown=False)
    red, green, blue = middle()
    assert abs(red - 40) < 8
    assert abs(blue - red) < 8
    overlay.set_style(shown=True, opacity=1.0)
    tinted = middle()
    assert tinted[1] > green + 100  # the ball is at the centre, the tint is greenish
    overlay.set_style(opacity=0.5)
    assert green < middle()[1] < tinted[1]


def test_without_a_mesh_there_is_nothing_to_choose(empty_window):
    slider, mesh, dots = buttons(empty_window)
    assert not any(widget.isEnabled() for widget in (slider, mesh, dots))


def test_beyond_the_video_its_first_frame_is_not_shown(empty_window, qtbot, recording_copy):
    """The radar began a second before; the scene says likewise that there is no mesh."""
    recording = open_recording(recording_copy)
    recording.radar_offset_s = -1.0
    recording.save()
    opened(empty_window, qtbot, recording_copy)
    c, view = models_of(empty_window), empty_window.findChild(VideoView)

    def corner():
        return view.grab().toImage().pixelColor(view.width() // 2, view.height() // 3).name()

    for time_s in (-0.5, 0.0, 1.9, -0.1):
        c.playback.seek(time_s)
        qtbot.waitUntil(lambda: c.video.shown_frame == max(c.playback.frame - 30, 0))
        assert (corner() == QColor(c.display.palette.well).name()) == (time_s < 0)
