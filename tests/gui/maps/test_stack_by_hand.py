"""The stack of maps, arranged with mouse and keys."""

from __future__ import annotations

import math
from xml.etree import ElementTree

import numpy as np
import pytest
from answering import menu_at, pick
from full_disk import full_disk
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QCursor, QGuiApplication, QImage, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QScrollBar
from window_models import models_of

from sd2app.maps.arrangement import HEADER_PX, MIN_PX
from sd2app.maps.feature import RadarPlaceBadge
from sd2app.maps.spectrum import SpectrumView
from sd2app.video.feature import VideoView
from sd2app.widgets.picture import copy_drawing, pixmap_of, write_picture
from sd2core.errors import Sd2Error
from sd2core.sensor import VirtualSensor

HANDLE, TITLE = QPoint(10, HEADER_PX // 2), QPoint(120, HEADER_PX // 2)
LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def stack(window, qtbot):
    yield window.maps
    for name in ("synthetic", "real"):
        window.maps.arrangement.fold(name, False)
        window.maps.arrangement.set_height(name, None)
    window.maps.arrangement.move("real", "before", below=True)
    window.maps.arrangement.enlarge(None)


def as_array(view) -> np.ndarray:
    """Picture of a widget, (H, W, 4)."""
    image = view.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
    pixels = np.frombuffer(image.constBits(), np.uint8)
    return pixels.reshape(image.height(), image.width(), 4).copy()


def drag(qtbot, view, start, end):
    qtbot.mousePress(view, LEFT, pos=start)
    for step in range(1, 6):
        qtbot.mouseMove(view, start + (end - start) * step / 5)
        QApplication.processEvents()
    qtbot.mouseRelease(view, LEFT, pos=end)


def turn_wheel(view, place, notches):
    event = QWheelEvent(
        QPointF(place),
        QPointF(view.mapToGlobal(place)),
        QPoint(),
        QPoint(0, 120 * notches),
        Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier,
        Qt.ScrollPhase.NoScrollPhase,
        False,
    )
    QApplication.sendEvent(view, event)


def test_maps_are_of_use_at_any_size(window, stack, qtbot):
    for size in ((1280, 720), (1600, 1000), (2560, 1440), (960, 640)):
        window.resize(*size)
        QApplication.processEvents()
        for view in (stack.synthetic, stack.real):
            assert view.plot_rect().height() >= 72
            # All time axes of the window lie below each other.
            assert view.width() == stack.overview.width()
    window.resize(1280, 800)


def test_most_of_the_extra_height_goes_to_the_maps(window, stack):
    window.resize(1280, 800)
    QApplication.processEvents()
    before = window.height(), stack.height()
    window.resize(1280, 1400)
    QApplication.processEvents()
    assert stack.height() - before[1] > 0.6 * (window.height() - before[0])
    window.resize(1280, 800)


def test_the_handle_folds_and_opens(stack, qtbot):
    view = stack.real
    qtbot.mouseClick(view, LEFT, pos=HANDLE)
    assert view.height() == HEADER_PX
    assert stack.arrangement.row("real").folded
    qtbot.mouseClick(view, LEFT, pos=HANDLE)
    assert view.height() >= MIN_PX


def test_a_double_click_on_the_title_enlarges_and_escape_goes_back(window, stack, qtbot):
    for view, other in ((stack.synthetic, stack.real), (stack.real, stack.synthetic)):
        # Wherever the keyboard is meanwhile.
        for elsewhere in (view, window.findChild(VideoView), window.side.button("Labels")):
            qtbot.mouseDClick(view, LEFT, pos=TITLE)
            assert view.height() == stack.viewport().height()
            assert other.isHidden()
            elsewhere.setFocus()
            qtbot.keyClick(elsewhere, Qt.Key.Key_Escape)
            assert stack.arrangement.enlarged is None
            assert other.isVisible()


def test_the_border_is_dragged(stack, qtbot):
    view = stack.synthetic
    before = view.height()
    border = QPoint(200, before - 2)
    drag(qtbot, view, border, border + QPoint(0, 90))
    assert abs(view.height() - before - 90) <= 4
    assert stack.arrangement.row("synthetic").wanted_px == view.height()
    qtbot.mouseDClick(view, LEFT, pos=QPoint(200, view.height() - 2))
    assert stack.arrangement.row("synthetic").wanted_px is None


def test_what_does_not_fit_is_scrolled_by_bar_and_by_wheel(window, stack, qtbot):
    view, below = stack.synthetic, stack.real
    turn_wheel(view, TITLE, -1)
    assert not stack.verticalScrollBar().value(), "all is in view"
    stack.arrangement.set_height("synthetic", stack.viewport().height())
    (bar,) = stack.findChildren(QScrollBar, options=Qt.FindChildOption.FindDirectChildrenOnly)
    span = models_of(window).span
    assert bar.isVisible()
    span_s = (span.start_s, span.end_s)
    turn_wheel(view, TITLE, -1)
    by_wheel = bar.value()
    assert by_wheel > 0
    turn_wheel(view, TITLE, 1)
    assert bar.value() == 0
    assert (span.start_s, span.end_s) == span_s
    drag(qtbot, bar, QPoint(4, 20), QPoint(4, bar.height() - 4))
    assert bar.value() == bar.maximum() == stack.verticalScrollBar().value()
    bottom = below.mapTo(stack.viewport(), QPoint(0, below.height())).y()
    assert bottom <= stack.viewport().height()
    # Over the map itself it zooms, as ever.
    turn_wheel(below, QPoint(300, HEADER_PX + 20), 1)
    assert span.duration_s < span_s[1] - span_s[0]
    span.fit()


def test_a_title_is_dragged_to_another_place(window, stack, qtbot):
    window.resize(1280, 1000)
    QApplication.processEvents()
    view, below = stack.synthetic, stack.real
    assert view.y() < below.y()
    deep = QPoint(TITLE.x(), below.y() + below.height() - 10)
    drag(qtbot, view, TITLE, deep)
    assert below.y() < view.y()
    order = stack.arrangement.order
    assert order.index("real") < order.index("synthetic")
    window.resize(1280, 800)


def test_this_frame_stands_beside_the_leading_map(window, stack, qtbot):
    spectrum = window.findChild(SpectrumView)
    for name in ("synthetic", "real"):
        stack.toggle_enlarged(name)
        QApplication.processEvents()
        view = stack.view(name)
        for velocity_mps in (-1.0, 0.0, 1.5):
            y = view.mapToGlobal(QPointF(0, view.y_of(velocity_mps))).y()
            plot = spectrum.plot_rect()
            v_max = view.track.map.axis.v_max_mps
            share = (v_max - velocity_mps) / (2 * v_max)
            beside = spectrum.mapToGlobal(QPointF(0, plot.top() + share * plot.height())).y()
            assert abs(y - beside) <= 1
        stack.toggle_enlarged(name)


def test_this_frame_stays_below_its_title_while_maps_are_scrolled(window, stack, qtbot):
    spectrum = window.findChild(SpectrumView)
    for name in ("synthetic", "real"):
        stack.arrangement.set_height(name, round(0.7 * stack.viewport().height()))
    bar = stack.verticalScrollBar()
    assert bar.maximum() > 0
    for value in np.linspace(0, bar.maximum(), 9):
        bar.setValue(round(float(value)))
        QApplication.processEvents()
        assert spectrum.plot_rect().top() >= 24
    bar.setValue(0)


def test_the_context_menu_reads_sets_and_plays(window, stack, qtbot):
    c, view = models_of(window), stack.synthetic
    values = c.synthetic.map.values
    bin_, frame = divmod(int(values.argmax()), values.shape[1])
    time_s = c.synthetic.map.timebase.time_of(frame) + 0.5 / 30  # the middle of the frame
    velocity_mps = c.synthetic.map.axis.centres_mps[bin_]
    # A pixel that begins within the frame, however wide the map is.
    place = QPoint(math.ceil(view.scale.x_of(time_s)), round(view.y_of(velocity_mps)))
    pick(menu_at(view, place), "Copy value")
    words = QGuiApplication.clipboard().text()
    assert f"frame {frame}" in words
    assert "body at" in words
    before = c.synthetic.reference
    assert "0 dB" not in view.status()
    level = c.synthetic.read(time_s, velocity_mps).level
    pick(menu_at(view, place), f"0 dB here (now {level})")
    assert c.synthetic.reference == pytest.approx(values.max())
    assert f"0 dB set to {values.max():.3g}" in view.status()
    QTest.keyClick(window, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert c.synthetic.reference == before
    assert "0 dB" not in view.status()
    pick(menu_at(view, place), "Play what is in view in a loop")
    assert c.playback.playing
    assert c.playback.stretch_s == (window.session.span.start_s, window.session.span.end_s)
    c.playback.pause()
    c.playback.set_stretch(None)
    pick(menu_at(view, place), "Copy picture")
    assert QGuiApplication.clipboard().image().width() >= view.width()


def drawn_in(view) -> list[str]:
    """Texts in the picture of a view as a drawing."""
    copy_drawing(view)
    root = ElementTree.fromstring(QGuiApplication.clipboard().text())
    return [one.text for one in root.iter() if one.tag.endswith("text") and one.text]


def test_a_picture_of_a_map_has_axes_with_units_a_scale_and_a_legend_and_no_read_out(
    labelled, qtbot
):
    c, view = models_of(labelled), labelled.maps.synthetic
    quiet = pixmap_of(view).toImage()
    texts = drawn_in(view)
    assert {"0 s", "1 s", "−30 dB", "0 dB", "there", "back"} <= set(texts)
    # With the pointer on it, the clock elsewhere and a grip: the picture is the same.
    qtbot.mouseMove(view, view.plot_rect().center().toPoint())
    c.playback.seek_frame(40)
    c.session.aligning.toggle()
    assert c.pointer.reading is not None
    assert pixmap_of(view).toImage() == quiet
    c.session.aligning.end()
    c.display.set_levels(scale="linear")
    assert "100 %" in drawn_in(view)


def test_pictures_are_written(stack, tmp_path):
    for name in ("map.png", "map.svg"):
        write_picture(stack.synthetic, tmp_path / name)
        assert (tmp_path / name).stat().st_size > 1000
    assert b"<svg" in (tmp_path / "map.svg").read_bytes()[:500]
    pick(menu_at(stack.synthetic, QPoint(300, 60)), "Copy as SVG")
    copied = QGuiApplication.clipboard().mimeData()
    drawing = ElementTree.fromstring(bytes(copied.data("image/svg+xml").data()))
    assert drawing.tag.endswith("svg")
    size = stack.synthetic.picture_size()
    assert drawing.get("viewBox") == f"0 0 {size.width()} {size.height()}"
    assert ElementTree.fromstring(copied.text()).tag == drawing.tag
    with pytest.raises(Sd2Error, match=r"map\.bmp"):
        write_picture(stack.synthetic, tmp_path / "map.bmp")
    assert not (tmp_path / "map.bmp").exists()


@pytest.mark.parametrize("name", ["map.png", "map.svg"])
def test_a_picture_is_whole_or_not_there(stack, tmp_path, name):
    with full_disk(), pytest.raises(OSError, match=name):
        write_picture(stack.synthetic, tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_a_badge_says_that_the_sensor_is_elsewhere(window, stack, qtbot):
    badge = stack.real.findChild(RadarPlaceBadge)
    assert badge.isHidden()
    window.session.edits.place_sensor(VirtualSensor(position_m=(1.0, 0.0, 0.5)))
    qtbot.waitUntil(badge.isVisible)
    assert "1.1 m beside the radar" in badge.text()
    assert badge.text().endswith("Go to the radar's place")
    for width in (2560, 960, 1280):
        window.resize(width, 800)
        QApplication.processEvents()
        assert badge.geometry().right() < stack.real.width()
        assert badge.fontMetrics().horizontalAdvance(badge.text()) < badge.width()
    qtbot.mouseClick(badge, LEFT)
    assert window.session.sensor.sensor.position_m == (0.0, 0.0, 0.0)
    assert badge.isHidden()
    window.action("undo").trigger()
    assert window.session.sensor.sensor.position_m == (1.0, 0.0, 0.5)
    window.action("undo").trigger()


def test_the_reading_stands_beside_the_crosshair(stack, qtbot):
    view = stack.synthetic
    plot = view.plot_rect().toRect()
    for share_x, share_y in ((0.1, 0.9), (0.5, 0.5), (0.95, 0.1)):
        place = plot.topLeft() + QPoint(
            round(share_x * plot.width()), round(share_y * plot.height())
        )
        without = as_array(view)
        QCursor.setPos(view.mapToGlobal(place))
        qtbot.mouseMove(view, place)
        assert view.underMouse()
        changed = np.abs(as_array(view).astype(int) - without).sum(axis=2) > 0
        # The crosshair goes through the whole map: what is left is the box.
        changed[place.y() - 4 : place.y() + 5] = changed[:, place.x() - 4 : place.x() + 5] = False
        rows, columns = np.nonzero(changed)
        assert rows.size > 1000
        assert min(abs(rows - place.y())) <= 12
        assert min(abs(columns - place.x())) <= 16
        QCursor.setPos(view.mapToGlobal(QPoint(4, 4)))
        qtbot.mouseMove(view, QPoint(4, 4))
