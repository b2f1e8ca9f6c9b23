"""A recording with frames in which there is no person."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QPoint
from window_models import models_of

from sd2app.maps.heatmap import HeatmapView
from sd2app.maps.heatmap_image import Overview
from sd2app.maps.readout import reading_lines
from sd2app.maps.spectrum import SpectrumView
from sd2app.video.feature import VideoView
from sd2core.io.mesh import load_mesh, save_mesh

GONE = (25, 40)


@pytest.fixture
def window(empty_window, recording_copy, qtbot):
    """The window on the ball, which is not there for half a second."""
    ball = load_mesh(recording_copy / "mesh.npz")
    present = np.ones(ball.frame_count, bool)
    present[slice(*GONE)] = False
    save_mesh(replace(ball, present=present), recording_copy / "mesh.npz")
    with qtbot.waitSignal(models_of(empty_window).document.opened, timeout=20_000):
        empty_window.open_paths([recording_copy])
    qtbot.waitUntil(lambda: empty_window.settled, timeout=20_000)
    qtbot.waitUntil(lambda: models_of(empty_window).synthesis.complete, timeout=20_000)
    return empty_window


def show(window, qtbot, frame):
    models_of(window).playback.seek_frame(frame)
    qtbot.waitUntil(lambda: window.settled, timeout=20_000)


def colours(widget, area=None):
    """How many pixels there are of every colour."""
    image = widget.grab(area) if area is not None else widget.grab()
    image = image.toImage()
    pixels = [image.pixel(x, y) for x in range(image.width()) for y in range(image.height())]
    return set(pixels)


def test_the_map_is_empty_there_and_says_so_under_the_pointer(window, qtbot):
    view, real = window.maps.synthetic, window.maps.real
    c = models_of(window)
    assert not c.synthetic.map.values[:, slice(*GONE)].any()
    assert c.synthetic.map.values[:, : GONE[0]].any()
    middle = QPoint(round(view.scale.x_of(32 / 30)), round(view.y_of(1.0)))
    qtbot.mouseMove(view, middle)
    assert c.pointer.reading.note == "no person"
    assert "no person" in reading_lines(c.pointer.reading)[1]
    qtbot.mouseMove(view, QPoint(round(view.scale.x_of(10 / 30)), middle.y()))
    assert c.pointer.reading.note == ""
    assert real.isVisible()
    assert "no person in 0.50 s" in view.status()


@pytest.mark.slow
def test_what_is_unknown_does_not_have_the_colour_of_nothing(window):
    view = window.findChildren(HeatmapView)[0]
    for dark in (False, True):
        window.features.program.set_dark(dark)
        assert_hatched(window, view)


def assert_hatched(window, view):
    nothing = view.grab().toImage().pixel(round(view.scale.x_of(0.25)), round(view.y_of(-1.8)))
    for widget in (view, window.findChild(Overview)):
        left, right = (round(widget.scale.x_of(frame / 30)) for frame in (26, 39))
        gap = widget.grab().toImage()
        row = round(0.8 * widget.height())
        assert all(gap.pixel(x, row) != nothing for x in range(left, right))


def lines_drawn(window):
    """Pixels of the synthetic curve in the spectrum of the frame."""
    view = window.findChild(SpectrumView)
    blue, image = models_of(window).display.palette.synthetic, view.grab().toImage()
    rows = range(56, image.height() - 44)  # between legend and axis
    return sum(image.pixelColor(x, y).name() == blue for y in rows for x in range(48, view.width()))


def test_nothing_shows_the_pose_that_was_held(window, qtbot):
    video, c = window.findChild(VideoView), models_of(window)
    c.overlay.set_style(opacity=1.0)
    show(window, qtbot, 20)
    assert lines_drawn(window) > 10
    assert window.action("aim_sensor").isEnabled()
    assert len(colours(video)) > 20  # a shaded ball
    assert window.features.scene.view.overlay.message == ""
    show(window, qtbot, 30)
    assert lines_drawn(window) == 0
    assert len(colours(video)) < 10  # a grey picture
    window.features.scene.view._prepare((400.0, 300.0), 1.0)
    assert window.features.scene.view.overlay.message == "No person at this time"
    assert c.synthesis.readout() is None
    assert not window.action("aim_sensor").isEnabled()


@pytest.mark.slow
def test_another_place_has_the_same_gap(window, qtbot):
    before = models_of(window).synthetic.map
    models_of(window).sensor.set_sensor(
        replace(models_of(window).sensor.sensor, position_m=(0.3, 0.0, 0.0))
    )
    qtbot.waitUntil(lambda: models_of(window).synthesis.complete, timeout=20_000)
    after = models_of(window).synthetic.map
    assert after is not before
    assert not after.values[:, slice(*GONE)].any()
    assert after.present is not None
    assert not after.present[slice(*GONE)].any()
