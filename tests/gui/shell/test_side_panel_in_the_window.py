"""The column of panels at the side, by real keys and a real mouse."""

from __future__ import annotations

import pytest
from finding import button_of, named, panel_of, splitter_around
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtGui import QFontMetrics
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QLabel,
    QScrollArea,
    QSplitter,
    QSplitterHandle,
    QWidget,
)
from whole_window import close_window, opened

from sd2app.maps.arrangement import HEADER_PX
from sd2app.settings import Settings
from sd2app.shell.parts import Parts
from sd2app.shell.side_panel import _WORD_PX
from sd2app.shell.status_bar import StatusLine
from sd2app.shell.window import MainWindow
from sd2app.widgets.panel import InnerPages

LEFT = Qt.MouseButton.LeftButton
NAMES = ("Sensor", "Accuracy", "Train", "Labels", "Agreement")


def place_of(widget: QWidget) -> QRect:
    """Place of a widget on the screen."""
    return QRect(widget.mapToGlobal(QPoint(0, 0)), widget.size())


def drag(handle: QSplitterHandle, right_px: int, down_px: int = 0) -> None:
    """Drag the handle of a splitter."""
    start = handle.rect().center()
    QTest.mousePress(handle, LEFT, pos=start)
    # The handle follows, so that each way is from where it is now.
    QTest.mouseMove(handle, start + QPoint(right_px, down_px))
    QTest.mouseRelease(handle, LEFT, pos=start)


def around_all(window: MainWindow) -> QSplitter:
    """The splitter between all views and the room of the panel at the side."""
    across = Qt.Orientation.Horizontal
    return splitter_around(splitter_around(window.maps, across), across)


@pytest.fixture
def sized(window):
    """Makes the window as large as wanted."""

    def make(width_px: int = 1280, height_px: int = 720) -> MainWindow:
        window.resize(width_px, height_px)
        QApplication.processEvents()
        return window

    yield make
    window.side.button("Train").set_mark("", None)
    make(1280, 800)


@pytest.mark.parametrize("width_px", [1000, 1280])
def test_nothing_of_a_page_is_cut_at_the_right(sized, qtbot, width_px) -> None:
    """Also of pages that are made when they are first shown."""
    window = sized(width_px)
    for name in NAMES:
        window.bring_up(name)
        shown = [one for one in window.side.findChildren(InnerPages) if one.isVisible()]
        for page in shown[0].names if shown else [""]:
            if page:
                (button,) = (
                    one
                    for one in shown[0].findChildren(QAbstractButton)
                    if one.accessibleName() == page
                )
                qtbot.mouseClick(button, LEFT)
            QApplication.processEvents()
            scroll = next(one for one in window.side.findChildren(QScrollArea) if one.isVisible())
            right_px = place_of(scroll.viewport()).right()
            cut = [
                one
                for one in scroll.widget().findChildren(QWidget)
                if one.isVisible() and place_of(one).right() > right_px
            ]
            assert not cut, (name, page)


@pytest.fixture
def windows(qtbot, compiled_kernels, fake, fake_models, fake_classes, small_recording):
    """Makes windows one after the other on the same settings."""
    settings = Settings.forgetful()
    for name in ("folded", "over"):  # the panel is open and beside the maps
        settings.set_value(f"layouts/Look/{name}", False)
    made: list[MainWindow] = []

    def make(width_px: int = 1280, height_px: int = 720) -> MainWindow:
        if made:
            close_window(made[-1])
        parts = Parts(
            accuracy=fake, denoisers=fake_models.library, classifiers=fake_classes.library
        )
        window = MainWindow(settings, parts)
        window.resize(width_px, height_px)
        window.show()
        window.populate()
        qtbot.waitUntil(lambda: window.settled, timeout=120_000)
        window.resize(width_px, height_px)
        opened(window, qtbot, small_recording)
        made.append(window)
        return window

    yield make
    fake.gate.set()
    fake_classes.gate.set()
    close_window(made[-1])


@pytest.mark.one_in(3)
@pytest.mark.parametrize("size", [(960, 640), (1280, 720), (2560, 1440)])
def test_it_stands_beside_scene_and_maps_and_shows_every_icon(sized, size) -> None:
    window = sized(*size)
    side, line = place_of(window.side), place_of(window.findChild(StatusLine))
    assert (
        side.top() <= window.menuBar().mapToGlobal(QPoint(0, 0)).y() + window.menuBar().height() + 8
    )
    assert line.top() - 12 <= side.bottom() <= line.top()
    window.side.button("Train").set_mark("0 %", 0.0)
    QApplication.processEvents()
    for name in NAMES:
        icon = place_of(window.side.button(name))
        assert side.contains(icon), name
        assert icon.width() >= 32
    if size[0] > 1100:  # a narrow window has no room beside its maps
        for other in ("tracks", "scene"):
            assert place_of(panel_of(window, other)).right() < side.left()


@pytest.mark.slow
def test_words_below_the_icons_stand_clear_of_the_frame(sized) -> None:
    window = sized(1280, 720)
    for name in NAMES:
        icon = window.side.button(name)
        font = icon.font()
        font.setPixelSize(_WORD_PX)
        word_px = QFontMetrics(font).horizontalAdvance(name)
        assert word_px + 2 * 2 <= icon.width(), name  # the frame and a pixel, on both sides


def test_it_lies_over_the_maps_by_choice_and_takes_no_room_of_theirs(windows) -> None:
    window = windows()
    side, tracks, beside_px = window.side, panel_of(window, "tracks"), window.side.width()
    narrow_px = tracks.width()
    QTest.mouseClick(button_of(side, "Over maps"), LEFT)
    QApplication.processEvents()
    assert tracks.width() > narrow_px + 200
    assert side.width() == pytest.approx(beside_px, abs=4)
    assert place_of(side).left() < place_of(panel_of(window, "spectrum")).right()
    assert window.childAt(side.mapTo(window, QPoint(20, 200))) is not None
    assert side.isAncestorOf(window.childAt(side.mapTo(window, QPoint(20, 200))))
    wide_px = tracks.width()
    QTest.keyClick(window, Qt.Key.Key_F9)
    QApplication.processEvents()
    assert side.folded
    assert tracks.width() == wide_px
    again = windows()
    QTest.keyClick(again, Qt.Key.Key_S)
    QApplication.processEvents()
    assert panel_of(again, "tracks").width() == pytest.approx(wide_px, abs=2)


def test_icons_have_names_tips_and_a_ring_for_what_is_under_way(sized) -> None:
    side = sized().side
    for name in NAMES:
        assert (side.button(name).accessibleName(), side.button(name).toolTip()) == (name, name)
    icon = side.button("Train")
    before, size = icon.grab().toImage(), icon.size()
    side.button("Train").set_mark("25 %", 0.25)
    assert icon.size() == size
    assert icon.toolTip() == icon.accessibleName() == "Train · 25 %"
    quarter = icon.grab().toImage()
    side.button("Train").set_mark("75 %", 0.75)
    assert before != quarter != icon.grab().toImage()
    side.button("Train").set_mark("", None)
    assert icon.grab().toImage() == before


def test_icons_have_their_words_where_the_window_is_wide(sized) -> None:
    window = sized(1280, 720)
    icon = window.side.button("Agreement")
    worded = icon.size()
    assert worded.width() >= icon.fontMetrics().horizontalAdvance("Agree")
    window.resize(1000, 700)
    QApplication.processEvents()
    assert icon.width() < worded.width()
    window.resize(1280, 720)
    QApplication.processEvents()
    assert icon.size() == worded


def test_arrows_go_from_panel_to_panel(sized) -> None:
    window = sized()
    side = window.side
    side.button("Sensor").setFocus(Qt.FocusReason.TabFocusReason)
    for name in (*NAMES[1:], NAMES[-1]):
        QTest.keyClick(QApplication.focusWidget(), Qt.Key.Key_Down)
        assert side.shown == name
        assert named(side, "Open panel", QLabel).text() == name
        assert QApplication.focusWidget() is side.button(name)
    QTest.keyClick(QApplication.focusWidget(), Qt.Key.Key_Up)
    assert side.shown == NAMES[-2]


def test_its_own_icon_or_a_key_folds_it_and_another_opens_it(sized) -> None:
    window = sized()
    side, tracks = window.side, panel_of(window, "tracks")
    wide_px, tracks_px = side.width(), tracks.width()
    QTest.mouseClick(side.button("Sensor"), LEFT)
    assert side.folded
    assert not window.action("side_panel").isChecked()
    assert side.width() < 80
    assert tracks.width() > tracks_px + 100
    assert all(side.rect().contains(side.button(name).geometry()) for name in NAMES)
    QTest.mouseClick(side.button("Accuracy"), LEFT)
    assert (side.folded, side.shown, side.width()) == (False, "Accuracy", wide_px)
    QTest.keyClick(window, Qt.Key.Key_F9)
    assert side.folded
    QTest.keyClick(window, Qt.Key.Key_S)
    assert (side.folded, side.shown, side.width()) == (False, "Sensor", wide_px)


@pytest.mark.slow
def test_the_next_window_has_the_width_that_was_chosen(windows) -> None:
    window = windows()
    before_px = window.side.width()
    drag(around_all(window).handle(1), -90)
    chosen_px = window.side.width()
    assert chosen_px == pytest.approx(before_px + 90, abs=2)
    again = windows()
    assert again.side.width() == chosen_px
    QTest.keyClick(again, Qt.Key.Key_F9)
    folded = windows()
    assert folded.side.folded
    assert folded.side.width() < 80
    QTest.keyClick(folded, Qt.Key.Key_F9)
    assert folded.side.width() == chosen_px


@pytest.mark.slow
def test_the_next_window_has_the_heights_that_were_chosen(windows, qtbot, small_recording) -> None:
    def opened():
        window = windows(1280, 1000)
        window.open_paths([small_recording])
        qtbot.waitUntil(
            lambda: window.settled and window.maps.synthetic.isVisible(), timeout=60_000
        )
        return window

    def heights(window):
        QApplication.processEvents()
        return window.maps.synthetic.height(), window.maps.real.height()

    window = opened()
    video = panel_of(window, "video")
    before_px = video.height()
    drag(splitter_around(video, Qt.Orientation.Vertical).handle(1), 0, 60)
    chosen_px = video.height()
    assert chosen_px == pytest.approx(before_px + 60, abs=2)
    view = window.maps.synthetic
    border = QPoint(200, view.height() - 2)
    QTest.mousePress(view, LEFT, pos=border)
    for step_px in (20, 50):
        QTest.mouseMove(view, border + QPoint(0, step_px))
        QApplication.processEvents()
    QTest.mouseRelease(view, LEFT, pos=border + QPoint(0, 50))
    chosen = heights(window)
    assert chosen[0] > border.y() + 40
    window = opened()
    assert panel_of(window, "video").height() == chosen_px
    assert heights(window) == chosen
    QTest.mouseClick(window.maps.real, LEFT, pos=QPoint(10, HEADER_PX // 2))
    assert heights(window)[1] == HEADER_PX
    assert heights(opened())[1] == HEADER_PX
