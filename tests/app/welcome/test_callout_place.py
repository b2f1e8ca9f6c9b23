"""The callout stands beside the thing that it is about, on the window."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from PySide6.QtCore import QRect, QSize

from sd2app.welcome.feature import beside

ROOM, SIZE = QRect(12, 12, 1256, 696), QSize(340, 120)


@given(st.integers(-40, 1200), st.integers(-40, 700), st.integers(20, 1400), st.integers(20, 900))
def test_it_is_always_on_the_window(left, top, width, height) -> None:
    assert ROOM.contains(beside(QRect(left, top, width, height), SIZE, ROOM))


@given(st.integers(0, 860), st.integers(0, 600))
def test_it_never_hides_a_thing_that_leaves_room(left, top) -> None:
    thing = QRect(left, top, 400, 100)

    assert not beside(thing, SIZE, ROOM).intersects(thing)
