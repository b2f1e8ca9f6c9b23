"""The window begins at 80 % of its screen, and never reaches beyond it."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QByteArray, QRect
from PySide6.QtWidgets import QWidget

from sd2app.shell.window import place_on_screen, usual_place

LARGE, SMALL = QRect(0, 0, 2560, 1440), QRect(0, 24, 1366, 700)


def test_at_first_it_takes_four_fifths_in_the_middle() -> None:
    place = usual_place(LARGE)

    assert (place.width(), place.height()) == (2048, 1152)
    assert place.center() == LARGE.center()


def test_on_a_small_screen_it_is_as_large_as_its_views_need() -> None:
    place = usual_place(SMALL)

    assert (place.width(), place.height()) == (1093, 640)
    assert SMALL.contains(place)


@pytest.mark.parametrize(
    "left_at",
    [
        QRect(300, 200, 700, 900),  # lower than the screen is now
        QRect(-2000, -50, 700, 650),  # on a screen that is gone
        QRect(1300, 690, 5000, 4000),
        QRect(40, 60, 640, 480),
    ],
)
def test_a_remembered_place_is_brought_onto_the_screen(qtbot, left_at) -> None:
    before, window = QWidget(), QWidget()
    for one in (before, window):
        qtbot.addWidget(one)
    before.setGeometry(left_at)
    assert window.restoreGeometry(before.saveGeometry())
    room = window.screen().availableGeometry()
    assert room.contains(window.geometry())
    assert room.contains(left_at) == (window.geometry() == left_at)


def test_where_a_remembered_place_says_nothing_it_is_as_large_as_at_first(qtbot) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    place_on_screen(window, QByteArray(b"of a screen that was twice as wide"))
    assert (window.width(), window.height()) == (1280, 800)
