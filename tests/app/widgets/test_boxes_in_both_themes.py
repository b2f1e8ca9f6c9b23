"""What is typed, chosen or ticked stands out from the window in the light and in the dark theme."""

from __future__ import annotations

import pytest
from PySide6.QtGui import QColor, QImage
from PySide6.QtWidgets import QApplication, QCheckBox, QComboBox, QDoubleSpinBox, QLineEdit

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


@pytest.fixture(params=[False, True])
def theme(request, qapp: QApplication):
    """Colours of a theme that is in use."""
    before = qapp.styleSheet(), qapp.palette()
    apply_theme(qapp, request.param)
    yield palette_for(request.param)
    qapp.setStyleSheet(before[0])
    qapp.setPalette(before[1])


def ticked_box() -> QCheckBox:
    box = QCheckBox()
    box.setChecked(True)
    return box


@pytest.mark.parametrize("kind", [QCheckBox, ticked_box, QComboBox, QDoubleSpinBox, QLineEdit])
def test_its_frame_is_seen(qtbot, theme, kind) -> None:
    box = kind()
    qtbot.addWidget(box)
    box.resize(box.sizeHint())
    picture: QImage = box.grab().toImage()
    # Without what is in it: above the sign of a ticked box, and above text and arrows.
    middle = picture.height() // 2
    column = [
        picture.pixelColor(6, y) for y in range(middle - 5 if isinstance(box, QCheckBox) else 3)
    ]
    window = QColor(theme.window)
    assert max(contrast(one, window) for one in column) >= 3.0  # WCAG 2, 1.4.11


def test_what_is_disabled_can_still_be_read(theme) -> None:
    backgrounds = theme.window, theme.panel, theme.well
    assert min(contrast(QColor(theme.disabled), QColor(one)) for one in backgrounds) >= 3.0
