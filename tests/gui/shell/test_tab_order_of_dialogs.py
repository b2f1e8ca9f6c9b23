"""Tab goes through every dialog and every page at the side as one reads, and is caught nowhere."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import pytest
from PySide6.QtCore import QPoint, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QLineEdit,
    QSlider,
    QWidget,
)

from sd2app.shell.side_panel import RailButton
from sd2app.widgets.panel import InnerPages

_KINDS = (QAbstractButton, QAbstractSpinBox, QComboBox, QLineEdit, QSlider, QAbstractItemView)
_ROW_PX = 12
"""Middles of controls in one row differ by less."""


def controls(root: QWidget) -> set[QWidget]:
    """What a mouse could use: shown, enabled, not a part of another or one choice of several."""
    found = set()
    for one in root.findChildren(QWidget):
        shown = one.isVisible() and one.isEnabled() and one.window() is root.window()
        inside, above = False, one.parentWidget()
        while above is not None and above is not root:
            inside = inside or isinstance(above, _KINDS)
            above = above.parentWidget()
        group = one.group() if isinstance(one, QAbstractButton) else None
        choice = isinstance(one, RailButton) or (group is not None and group.exclusive())
        other = choice and not one.isChecked()
        # The arrows of the search above it lead through such a list.
        listed = isinstance(one, QAbstractItemView)
        other |= listed and one.focusPolicy() == Qt.FocusPolicy.NoFocus
        if isinstance(one, _KINDS) and shown and not inside and not other:
            found.add(one)
    return found


def control_of(focus: QWidget, known: set[QWidget]) -> QWidget:
    """The control that the widget with the keyboard belongs to."""
    above: QWidget | None = focus
    while above is not None and above not in known:
        above = above.parentWidget()
    return above or focus


def walk(root: QWidget, key: Qt.Key) -> list[QWidget]:
    """Controls in the order in which a key reaches them, once round."""
    known, reached = controls(root), list[QWidget]()
    for _ in range(300):
        focus = QApplication.focusWidget()
        assert focus is not None
        assert focus.isVisible()
        at = control_of(focus, known)
        if at in reached[:-1] or (at in reached and len(known) == 1):
            return reached
        if at not in reached:
            reached.append(at)
        QTest.keyClick(focus, key)
    pytest.fail(f"the keyboard does not leave {name_of(reached[-1])}")


def name_of(one: QWidget) -> str:
    said = one.accessibleName() or (one.text() if isinstance(one, QAbstractButton) else "")
    return f"{type(one).__name__} {said!r}"


def place_of(one: QWidget) -> tuple[int, int]:
    middle = one.mapTo(one.window(), QPoint(0, one.height() // 2))
    return middle.y(), middle.x()


def reads_on(one: QWidget, other: QWidget) -> bool:
    """True if the other is to the right of one, or below it."""
    (y, x), (other_y, other_x) = place_of(one), place_of(other)
    return other_y >= y + _ROW_PX or other_x > x or other.height() > 3 * _ROW_PX


def faults(root: QWidget) -> list[str]:
    """What is not reached, and where the order turns back more than once."""
    reached = walk(root, Qt.Key.Key_Tab)
    found = [f"{name_of(one)} is not reached" for one in controls(root) - set(reached)]
    round_trip = [*pairwise(reached), (reached[-1], reached[0])]
    turns = [pair for pair in round_trip if not reads_on(*pair)]
    if len(turns) > 1:
        found += [f"{name_of(one)} leads back to {name_of(other)}" for one, other in turns]
    back = walk(root, Qt.Key.Key_Backtab)
    found += [f"{name_of(one)} is not reached backwards" for one in set(reached) - set(back)]
    return found


def in_dialog(window: QWidget, action: str, look: Callable[[QWidget], object]) -> None:
    """Show what an action shows, look at it with the keyboard there, and close it."""
    done, errors = [], list[BaseException]()

    def wait() -> None:
        tops = QApplication.topLevelWidgets()
        shown = [one for one in tops if one.isVisible() and one is not window and one.isWindow()]
        shown = [
            one for one in shown if one.windowType() in (Qt.WindowType.Dialog, Qt.WindowType.Window)
        ]
        if not shown or (QApplication.focusWidget() or window).window() is not shown[0]:
            if shown:
                shown[0].activateWindow()
                if QApplication.focusWidget() is None:
                    QTest.keyClick(shown[0], Qt.Key.Key_Tab)
            QTimer.singleShot(50, wait)
            return
        try:
            look(shown[0])
        except BaseException as error:  # told once the dialog is closed
            errors.append(error)
        done.append(shown[0].close())

    QTimer.singleShot(50, wait)
    window.action(action).trigger()
    while not done:
        QApplication.processEvents()
    if errors:
        raise errors[0]


@pytest.mark.one_in(5)
@pytest.mark.parametrize(
    "action",
    [
        *("listen", "export_map", "export_maps", "export_strip", "export_dataset", "batch"),
        *("any_command", "align", "preferences", "messages", "export_labels", "cut_out"),
        *("add_track", "find_action", "keys", "manual", "about"),
    ],
)
def test_tab_goes_through_a_dialog(window, action) -> None:
    found: list[str] = []
    in_dialog(window, action, lambda dialog: found.extend(faults(dialog)))
    assert found == []


@pytest.mark.slow
def test_tab_goes_through_every_page_at_the_side(window, qtbot) -> None:
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow, timeout=5000)
    found: dict[tuple[str, str], set[str]] = {}
    for panel in window.side.names:
        window.bring_up(panel)
        inner = [one for one in window.side.findChildren(InnerPages) if one.isVisible()]
        for page in inner[0].names if inner else [""]:
            if inner:
                inner[0].turn_to(page)
            QApplication.processEvents()
            QTest.keyClick(QApplication.focusWidget() or window, Qt.Key.Key_Tab)
            missed = controls(window.side) - set(walk(window, Qt.Key.Key_Tab))
            found[panel, page] = set(map(name_of, missed))
    assert {place: missed for place, missed in found.items() if missed} == {}
