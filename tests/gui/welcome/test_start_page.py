"""The start page: ways to begin, and recordings with pictures, by mouse and keyboard."""

from __future__ import annotations

import pytest
from answering import once_asked
from dropping import drop
from PySide6.QtCore import Qt
from PySide6.QtGui import QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QDialog
from whole_window import close_window, new_window, opened
from window_models import models_of

from sd2app.live.dialog import ListenDialog
from sd2app.shell.open_dialog import OpenDialog
from sd2app.welcome.start_page import Card, RecentCard

LEFT = Qt.MouseButton.LeftButton


def card(window, name: str) -> Card:
    return next(one for one in window.start.findChildren(Card) if one.text().startswith(name))


def click(window, name: str) -> None:
    QTest.mouseClick(card(window, name), LEFT)


def views(window):
    return [window._panels[name] for name in ("video", "scene", "tracks", "side")]


@pytest.fixture
def starting(empty_window, qtbot):
    """A window without a recording, its start page on screen."""
    qtbot.waitUntil(empty_window.start.isVisible)
    return empty_window


def test_nothing_but_the_start_page_is_there_until_something_is_open(
    starting, qtbot, small_recording
) -> None:
    assert not any(view.isVisible() for view in views(starting))

    opened(starting, qtbot, small_recording)

    qtbot.waitUntil(starting.start.isHidden)
    assert all(view.isVisible() for view in views(starting))


def test_it_is_gone_back_to_and_what_is_open_stays_open(starting, qtbot, small_recording) -> None:
    assert not starting.action("start_page").isEnabled()
    assert starting.start.back.isHidden()
    opened(starting, qtbot, small_recording)
    document = models_of(starting).document
    qtbot.waitUntil(starting.start.isHidden)

    starting.action("start_page").trigger()

    qtbot.waitUntil(starting.start.isVisible)
    assert starting.action("start_page").isChecked()
    assert not any(view.isVisible() for view in views(starting))
    assert starting.start.back.text() == "Back to “ball”"
    QTest.mouseClick(starting.start.back, LEFT)
    qtbot.waitUntil(starting.start.isHidden)
    assert all(view.isVisible() for view in views(starting))
    assert not starting.action("start_page").isChecked()
    assert document.recording.folder == small_recording

    starting.action("start_page").trigger()
    qtbot.waitUntil(starting.start.isVisible)
    with qtbot.waitSignal(document.opened, timeout=20_000):
        QTest.mouseClick(starting.start.recent[0], LEFT)
    qtbot.waitUntil(starting.start.isHidden)


def test_it_comes_back_where_opening_fails(starting, qtbot, tmp_path) -> None:
    (tmp_path / "broken.mp4").write_bytes(b"no video")
    with qtbot.waitSignal(models_of(starting).document.failed, timeout=20_000):
        starting.open_paths([tmp_path / "broken.mp4"])

    qtbot.waitUntil(starting.start.isVisible)
    assert "broken.mp4" in starting.messages.text


@pytest.mark.parametrize(
    ("name", "dialog", "title"),
    [("Open a radar", OpenDialog, "Open a radar capture"), ("Record", ListenDialog, "")],
)
def test_a_card_asks_for_what_it_says(starting, name, dialog, title) -> None:
    asked: list[QDialog] = []

    def look(shown: QDialog) -> None:
        asked.append(shown)
        assert title in shown.windowTitle()
        shown.reject()

    once_asked(dialog, look)
    click(starting, name)

    assert asked


def test_what_is_dropped_on_it_opens(starting, qtbot, small_recording) -> None:
    with qtbot.waitSignal(models_of(starting).document.opened, timeout=20_000):
        drop(starting, small_recording)

    qtbot.waitUntil(starting.start.isHidden)


def test_the_keyboard_alone_reaches_every_card(starting, qtbot) -> None:
    starting.activateWindow()
    qtbot.waitUntil(starting.isActiveWindow, timeout=5000)
    reached = set()
    for _ in range(12):
        QTest.keyClick(starting, Qt.Key.Key_Tab)
        reached.add(QApplication.focusWidget())

    assert set(starting.start.findChildren(Card)) <= reached
    assert all(starting.start.isAncestorOf(one) for one in reached if isinstance(one, Card))


def test_a_panel_can_be_brought_up_beside_it(starting, qtbot) -> None:
    starting.action("show_train").trigger()

    qtbot.waitUntil(lambda: starting.side.width() > 200)
    assert starting.side.shown == "Train"
    assert starting.start.isVisible()


def test_a_recording_is_there_the_next_time_with_its_picture(
    qtbot, empty_window, small_recording, fakes
) -> None:
    opened(empty_window, qtbot, small_recording)
    pictures = empty_window.features.welcome.pictures
    path = pictures.path_of([small_recording])
    qtbot.waitUntil(path.is_file, timeout=20_000)
    picture, frame = QImage(str(path)), models_of(empty_window).video.picture
    recent = empty_window.session.settings.recent

    second = new_window(qtbot, **fakes)
    for paths in recent:
        second.session.settings.add_recent(*paths)
    second.start.refresh()
    qtbot.waitUntil(second.start.isVisible)
    found = second.start.findChildren(RecentCard)
    shown = [one for one in found if one.text() == small_recording.name]
    assert len(shown) == 1
    assert not shown[0]._picture.isNull()
    # The middle of the video is the middle of the picture.
    height, width, _ = frame.shape
    middle = picture.pixelColor(picture.width() // 2, picture.height() // 2)
    assert abs(middle.red() - int(frame[height // 2, width // 2, 0])) < 8
    with qtbot.waitSignal(models_of(second).document.opened, timeout=20_000):
        QTest.mouseClick(shown[0], LEFT)
    close_window(second)


def test_pictures_that_cannot_be_kept_are_no_failure(
    qtbot, empty_window, small_recording, own_data
) -> None:
    (own_data / "sd2-studio").mkdir(exist_ok=True)
    (own_data / "sd2-studio" / "pictures").write_text("a file where the folder would be")

    opened(empty_window, qtbot, small_recording)
    qtbot.waitUntil(lambda: not empty_window.features.welcome.pictures._patience.isActive())
    qtbot.waitUntil(lambda: not empty_window.features.welcome.pictures.busy)

    assert not empty_window.messages.text
