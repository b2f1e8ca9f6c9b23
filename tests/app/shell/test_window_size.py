"""The window begins at 80 % of its screen, and never reaches beyond it."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QRect

from sd2app.shell.window import fitting

LARGE, SMALL = QRect(0, 0, 2560, 1440), QRect(0, 24, 1366, 700)


def test_at_first_it_takes_four_fifths_in_the_middle() -> None:
    place = fitting(None, LARGE)

    assert (place.width(), place.height()) == (2048, 1152)
    assert place.center() == LARGE.center()


def test_on_a_small_screen_it_is_as_large_as_its_views_need() -> None:
    place = fitting(None, SMALL)

    assert (place.width(), place.height()) == (1093, 640)
    assert SMALL.contains(place)


@pytest.mark.parametrize(
    "left_at",
    [
        QRect(300, 200, 1000, 900),  # lower than the screen is now
        QRect(-2000, -50, 1200, 650),  # on a screen that is gone
        QRect(1300, 690, 5000, 4000),
        QRect(0, 0, 640, 480),
    ],
)
@pytest.mark.parametrize("room", [LARGE, SMALL, QRect(-1920, 0, 800, 600)])
def test_a_remembered_place_is_brought_onto_the_screen(left_at, room) -> None:
    place = fitting(left_at, room)

    assert room.contains(place)
    assert place.width() == min(left_at.width(), room.width())
    assert place.height() == min(left_at.height(), room.height())


def test_a_place_on_the_screen_stays() -> None:
    here = QRect(40, 60, 1280, 620)

    assert fitting(here, SMALL) == here
