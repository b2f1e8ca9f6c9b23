"""Boxes to tick stand out from the window in the light and in the dark theme."""

from __future__ import annotations

import pytest
from PySide6.QtGui import QColor, QImage
from PySide6.QtWidgets import QApplication, QCheckBox

from sd2app.palette import palette_for
from sd2app.widgets.theme import apply_theme


def luminance(colour: QColor) -> float:
    """Relative luminance as WCAG 2 defines it."""
    red, green, blue = (
        one / 12.92 if one <= 0.04045 else ((one + 0.055) / 1.055) ** 2.4
        for one in colour.getRgbF()[:3]
    )
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(one: QColor, other: QColor) -> float:
    low, high = sorted(map(luminance, (one, other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("dark", [False, True])
def test_a_box_that_is_not_ticked_is_seen(qtbot, qapp: QApplication, dark: bool) -> None:
    before = qapp.styleSheet(), qapp.palette()
    try:
        apply_theme(qapp, dark)
        box = QCheckBox()
        qtbot.addWidget(box)
        box.resize(box.sizeHint())
        picture: QImage = box.grab().toImage()
        row = [picture.pixelColor(x, picture.height() // 2) for x in range(picture.width())]
        window = QColor(palette_for(dark).window)
        assert max(contrast(one, window) for one in row) >= 3.0  # WCAG 2, 1.4.11
    finally:
        qapp.setStyleSheet(before[0])
        qapp.setPalette(before[1])
