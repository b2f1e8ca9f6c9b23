"""No word of the start page, the panels and the last line is cut; each control has a name."""

from __future__ import annotations

from itertools import pairwise

import pytest
from finding import button_of
from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QLabel,
    QWidget,
)
from whole_window import opened

from sd2app.playback.feature import TransportBar
from sd2app.session.display import LAYOUTS
from sd2app.widgets.panel import InnerPages

_FRAME_PX, _ARROWS_PX = 6, 18


def needed_px(one: QWidget) -> int:
    """Width of what a control says, with its frame."""
    if isinstance(one, QComboBox):
        said = one.currentText()
        return one.fontMetrics().horizontalAdvance(said) + _FRAME_PX + _ARROWS_PX if said else 0
    if isinstance(one, QAbstractSpinBox):
        return one.fontMetrics().horizontalAdvance(one.text()) + _FRAME_PX + _ARROWS_PX
    return one.minimumSizeHint().width() if one.text() else 0


def faults(root: QWidget) -> list[str]:
    """What is cut without a tip, flat, or has no name though the keyboard reaches it."""
    found = []
    for one in root.findChildren(QWidget):
        kinds = QLabel, QAbstractButton, QComboBox, QAbstractSpinBox
        if not isinstance(one, kinds) or not one.isVisible():
            continue
        said = one.currentText() if isinstance(one, QComboBox) else one.text()
        name = f"{type(one).__name__} {said or one.accessibleName()!r}"
        if isinstance(one, QLabel) and one.wordWrap():
            if one.heightForWidth(one.width()) > one.height():
                found.append(f"{name} is {one.height()} px high")
        elif needed_px(one) > one.width() + 1 and not (isinstance(one, QLabel) and one.toolTip()):
            found.append(f"{name} is {one.width()} px wide, and needs {needed_px(one)}")
        reached = one.focusPolicy() & Qt.FocusPolicy.TabFocus
        if isinstance(one, QAbstractButton):
            if one.height() < one.minimumSizeHint().height() - 1:
                found.append(f"{name} is {one.height()} px high")
            if reached and not (one.accessibleName() or one.text()):
                found.append(f"a button of {type(one.parentWidget()).__name__} has no name")
    return found


@pytest.mark.parametrize("size", [(1000, 640), pytest.param((1280, 720), marks=pytest.mark.slow)])
def test_words_of_all_panels_have_room(empty_window, qtbot, small_recording, size) -> None:
    window = empty_window
    window.resize(*size)
    QApplication.processEvents()
    assert faults(window) == []
    opened(window, qtbot, small_recording)
    for layout in LAYOUTS:
        window.session.layouts.choose(layout)
        QApplication.processEvents()
        assert faults(window) == [], layout
    for panel in window.side.names:
        window.bring_up(panel)
        QApplication.processEvents()
        inner = [one for one in window.side.findChildren(InnerPages) if one.isVisible()]
        for page in inner[0].names if inner else [""]:
            if inner:
                inner[0].turn_to(page)
            QApplication.processEvents()
            assert faults(window) == [], (panel, page)


def test_nothing_of_the_last_line_is_painted_over_the_next(
    empty_window, qtbot, small_recording
) -> None:
    """Where there is no room, as on a small screen with everything half as large again."""
    (bar,) = opened(empty_window, qtbot, small_recording).findChildren(TransportBar)
    bar.setParent(None)
    qtbot.addWidget(bar)
    bar.resize(bar.minimumSizeHint())
    bar.show()
    QApplication.processEvents()
    assert bar.width() < 450
    shown = [one for one in bar.findChildren(QWidget) if one.isVisible() and one.width()]
    edges = sorted((one.x(), one.x() + one.width()) for one in shown)
    assert all(end <= begin for (_, end), (begin, _) in pairwise(edges))


def test_a_choice_without_effect_is_not_offered(empty_window, qtbot, small_recording) -> None:
    window = opened(empty_window, qtbot, small_recording)
    window.bring_up("Sensor")
    over = button_of(window.side, "Over maps")
    for width_px, offered in ((1280, True), (1000, False), (1280, True)):
        window.resize(width_px, 700)
        QApplication.processEvents()
        assert over.isVisible() == offered  # a narrow window has no room beside its maps
