"""Frames are seen and text can be read, in the light and in the dark theme."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPalette
from PySide6.QtWidgets import (
    QApplication,
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
    QLineEdit,
    QListWidget,
    QPlainTextEdit,
    QPushButton,
    QSlider,
    QToolButton,
    QTreeWidget,
    QWidget,
)

from sd2app.labels.painting import _SELECTED_TINT, _TINT
from sd2app.palette import palette_for
from sd2app.study.result_dialog import _STRONGEST
from sd2app.widgets.panel import outlined
from sd2app.widgets.theme import apply_theme
from sd2app.widgets.time_axis import paint_readout
from sd2core.labels.colours import OFFERED


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


def outlined_button() -> QToolButton:
    return outlined("", "", None, None)


def pressed_button() -> QToolButton:
    button = outlined_button()
    button.setObjectName("")
    button.setCheckable(True)
    button.setChecked(True)
    return button


def slider() -> QSlider:
    return QSlider(Qt.Orientation.Horizontal)


KINDS = [
    *(QCheckBox, ticked_box, QComboBox, QDoubleSpinBox, QLineEdit, QPushButton),
    *(outlined_button, pressed_button, slider, QListWidget, QTreeWidget, QPlainTextEdit),
]


def contrast_of_frame(qtbot, kind, ground: str, enabled: bool) -> float:
    """Contrast of the frame of a new control with what it stands on."""
    place = QWidget()
    place.setStyleSheet(f"QWidget#place {{ background: {ground}; }}")
    place.setObjectName("place")
    qtbot.addWidget(place)
    box = kind()
    box.setEnabled(enabled)
    box.setParent(place)
    box.setGeometry(10, 10, 80, box.sizeHint().height())
    place.resize(100, 60)
    picture: QImage = place.grab().toImage()
    # Without what is in it: above the sign of a ticked box, and above text and arrows.
    middle = 10 + box.height() // 2
    rows = range(10, middle - 5) if isinstance(box, QCheckBox) else range(10, 13)
    column = [picture.pixelColor(16, y) for y in rows]
    stands_on = picture.pixelColor(2, 2)
    assert stands_on == QColor(ground)
    return max(contrast(one, stands_on) for one in column)


@pytest.mark.one_in(7)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("ground", ["window", "panel"])
@pytest.mark.parametrize("enabled", [True, False])
def test_its_frame_is_seen(qtbot, theme, kind, ground, enabled) -> None:
    seen = contrast_of_frame(qtbot, kind, getattr(theme, ground), enabled)
    assert seen >= 3.0  # WCAG 2, 1.4.11


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_disabled_stands_out_no_more_than_what_is_not(qtbot, theme, kind) -> None:
    enabled, disabled = (contrast_of_frame(qtbot, kind, theme.panel, on) for on in (True, False))
    assert disabled <= enabled * 1.02  # rounded colours


GROUPS = [QPalette.ColorGroup.Active, QPalette.ColorGroup.Inactive, QPalette.ColorGroup.Disabled]
ROLES = QPalette.ColorRole
ROLES_ON = [
    *((ink, on) for ink in (ROLES.WindowText, ROLES.BrightText) for on in (ROLES.Window,)),
    *((ROLES.Text, on) for on in (ROLES.Base, ROLES.AlternateBase)),
    (ROLES.ButtonText, ROLES.Button),
    (ROLES.ToolTipText, ROLES.ToolTipBase),
    (ROLES.PlaceholderText, ROLES.Base),
    (ROLES.HighlightedText, ROLES.Highlight),
    *((ink, on) for ink in (ROLES.Link, ROLES.LinkVisited) for on in (ROLES.Window, ROLES.Base)),
]


@pytest.mark.parametrize("group", GROUPS)
def test_text_of_every_role_can_be_read(qapp, theme, group) -> None:
    palette = qapp.palette()
    found = {
        (ink.name, on.name): contrast(palette.color(group, ink), palette.color(group, on))
        for ink, on in ROLES_ON
    }
    assert {pair: found[pair] for pair in found if found[pair] < 4.5} == {}


@pytest.fixture(params=[False, True])
def colours(request):
    """Colours of a theme."""
    return palette_for(request.param)


def over(ink: str, alpha: int, ground: QColor) -> QColor:
    """A colour that is not opaque on another."""
    share = alpha / 255
    colours = zip(QColor(ink).getRgb()[:3], ground.getRgb()[:3], strict=True)
    return QColor(*(round(share * a + (1 - share) * b) for a, b in colours))


@pytest.mark.parametrize("ground", ["window", "panel", "well"])
@pytest.mark.parametrize("ink", ["text", "muted", "disabled", "accent", "warning"])
def test_own_colours_of_text_can_be_read(colours, ink, ground) -> None:
    assert contrast(QColor(getattr(colours, ink)), QColor(getattr(colours, ground))) >= 4.5


def test_the_filled_button_can_be_read(colours) -> None:
    assert contrast(QColor(colours.accent_text), QColor(colours.accent)) >= 4.5


@pytest.mark.parametrize("tint", [_TINT, _SELECTED_TINT])
@pytest.mark.parametrize(("name", "colour"), OFFERED)
def test_names_on_spans_can_be_read(colours, name, colour, tint) -> None:
    ground = over(colour, tint, QColor(colours.well))
    assert contrast(QColor(colours.text), ground) >= 4.5


@pytest.mark.parametrize("below", ["black", "white"])
def test_a_readout_over_a_map_can_be_read(colours, below) -> None:
    picture = QImage(200, 100, QImage.Format.Format_RGB32)
    picture.fill(QColor(below))
    with QPainter(picture) as painter:
        paint_readout(painter, QRectF(picture.rect()), QPointF(20, 20), [" "], colours)
    assert contrast(QColor(colours.text), picture.pixelColor(40, 36)) >= 4.5


@pytest.mark.parametrize("tint", ["accent", "real"])
def test_shares_in_a_table_of_confusions_can_be_read(colours, tint) -> None:
    ground = over(getattr(colours, tint), _STRONGEST, QColor(colours.panel))
    assert contrast(QColor(colours.text), ground) >= 4.5
