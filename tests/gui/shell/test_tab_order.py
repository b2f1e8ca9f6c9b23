"""Tab reaches every control of the window, region by region from top left."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtGui import QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QSlider,
    QTabBar,
    QToolButton,
    QWidget,
)
from window_models import models_of

from sd2app.shell.side_panel import RailButton

_KINDS = (QAbstractButton, QAbstractSpinBox, QComboBox, QSlider, QTabBar)


def walk(window, qtbot, key=Qt.Key.Key_Tab) -> list[QWidget]:
    """Controls in the order in which a key reaches them, once round."""
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow, timeout=5000)
    reached: list[QWidget] = []
    while True:
        QTest.keyClick(QApplication.focusWidget() or window, key)
        focus = QApplication.focusWidget()
        if focus in reached:
            assert focus is reached[0]
            return reached
        reached.append(focus)


def controls(window) -> set[QWidget]:
    """What a mouse could use: shown, enabled, not in another control or one choice of a group."""
    found = set()
    for one in window.centralWidget().findChildren(QWidget):
        if not isinstance(one, _KINDS):
            continue
        inside = isinstance(one.parentWidget(), _KINDS)
        group = one.group() if isinstance(one, QAbstractButton) else None
        # Of one choice of several, the arrows reach the others.
        choice = isinstance(one, RailButton) or (group is not None and group.exclusive())
        other = choice and not one.isChecked()
        used = one.isVisible() and one.isEnabled() and one.window() is window
        if used and not inside and not other:
            found.add(one)
    return found


def test_every_control_is_reached_with_tab_and_back(window, qtbot) -> None:
    reached = walk(window, qtbot)
    assert controls(window) <= set(reached)
    back = walk(window, qtbot, Qt.Key.Key_Backtab)
    assert set(back) == set(reached)
    start = back.index(reached[0])
    assert [*back[start:], *back[:start]] == [reached[0], *reversed(reached[1:])]


def look_of(control: QWidget) -> QImage:
    """A control as it is painted in its window."""
    window = control.window()
    return window.grab(QRect(control.mapTo(window, QPoint(0, 0)), control.size())).toImage()


def test_one_sees_which_control_has_the_keyboard(window, qtbot) -> None:
    unseen: list[str] = []
    for panel in ("Sensor", "Accuracy"):
        window.bring_up(panel)
        QApplication.processEvents()
        for _ in walk(window, qtbot):
            focus = QApplication.focusWidget()
            assert focus is not None
            with_keyboard = look_of(focus)
            QTest.keyClick(focus, Qt.Key.Key_Tab)
            QApplication.processEvents()
            if look_of(focus) == with_keyboard:
                unseen.append(f"{type(focus).__name__} {focus.accessibleName()}")
    assert unseen == []


def test_the_order_is_that_of_reading(window, qtbot) -> None:
    reached = walk(window, qtbot)
    regions = window._regions
    places = [next(k for k, one in enumerate(regions) if one.isAncestorOf(at)) for at in reached]
    first = places.index(min(places))
    turned = [*places[first:], *places[:first]]
    assert turned == sorted(turned)
    by_region = {place: [] for place in places}
    for place, control in zip(places, reached, strict=True):
        by_region[place].append(control.mapTo(window, QPoint(0, 0)).y())
    for place, tops in by_region.items():
        turned = sorted(tops)
        if place != places[0]:  # where Tab began, the walk may have begun in its middle
            assert all(abs(a - b) < 20 for a, b in zip(tops, turned, strict=True)), tops


def test_space_presses_the_button_that_tab_has_reached_and_plays_elsewhere(window, qtbot) -> None:
    playback = models_of(window).playback
    named = {one.toolTip().split(" (")[0]: one for one in walk(window, qtbot)}
    button = named["One frame on"]
    assert isinstance(button, QToolButton)
    while QApplication.focusWidget() is not button:
        QTest.keyClick(QApplication.focusWidget(), Qt.Key.Key_Tab)
    QTest.keyClick(button, Qt.Key.Key_Space)
    assert playback.frame == 1
    assert not playback.playing
    button.clearFocus()
    QTest.keyClick(window, Qt.Key.Key_Space)
    assert playback.playing
    playback.pause()


@pytest.mark.parametrize("take_away", ["setHidden", "setDisabled"])
def test_nobody_has_the_keyboard_after_what_had_it_is_gone(window, qtbot, take_away) -> None:
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow, timeout=5000)
    tools = window.findChildren(QToolButton)
    button = next(one for one in tools if one.toolTip().startswith("One frame on"))
    button.setFocus()
    assert QApplication.focusWidget() is button
    getattr(button, take_away)(True)
    try:
        assert QApplication.focusWidget() is None
    finally:
        getattr(button, take_away)(False)
