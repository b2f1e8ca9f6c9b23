"""Windows besides the main one are no larger than their screen, and boxes are alike in height."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QSize
from PySide6.QtWidgets import QComboBox, QDoubleSpinBox, QLineEdit, QWidget

from sd2app.widgets import dialogs
from sd2app.widgets.layouts import column_of
from sd2app.widgets.theme import apply_theme


class OnScreen(QWidget):
    """A window on a screen of 1000 × 640."""

    def screen(self):
        return self

    def availableSize(self) -> QSize:
        return QSize(1000, 640)


@pytest.mark.parametrize(("usual", "given"), [((1240, 820), (1000, 600)), ((900, 320), (900, 320))])
def test_a_window_takes_no_more_than_its_screen_has(qtbot, monkeypatch, usual, given) -> None:
    monkeypatch.setattr(dialogs.QGuiApplication, "platformName", lambda: "xcb")
    window = OnScreen()
    qtbot.addWidget(window)
    dialogs.take_room(window, *usual)
    assert window.size() == QSize(*given)


def test_boxes_of_numbers_are_as_high_as_other_fields(qtbot, qapp) -> None:
    before = qapp.styleSheet(), qapp.palette()
    try:
        apply_theme(qapp, False)
        window = QWidget()
        qtbot.addWidget(window)
        fields = QDoubleSpinBox(), QComboBox(), QLineEdit()
        window.setLayout(column_of(*fields))
        window.show()
        heights = {type(one).__name__: one.height() for one in fields}
        assert max(heights.values()) - min(heights.values()) <= 1, heights
    finally:
        qapp.setStyleSheet(before[0])
        qapp.setPalette(before[1])
