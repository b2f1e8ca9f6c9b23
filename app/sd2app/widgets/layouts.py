"""Layouts written as they look: rows and columns of widgets and of one another."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtWidgets import (
    QBoxLayout,
    QFormLayout,
    QGridLayout,
    QHBoxLayout,
    QLayout,
    QVBoxLayout,
    QWidget,
)

Part = QWidget | QLayout | int | tuple[QWidget | QLayout | None, int]
"""A widget or a layout, perhaps with its share of what room is left over; or pixels of a gap."""
STRETCH: Part = (None, 1)
"""Empty room."""
Margins = int | tuple[int, int, int, int]
"""All four, or left, top, right and bottom, in pixels."""
ANY_WIDTH_PX = (1 << 24) - 1
"""Greatest width of a widget that has none: Qt's largest."""


def row_of(
    *parts: Part, spacing_px: int | None = None, margins_px: Margins | None = None
) -> QHBoxLayout:
    """Parts side by side; spacing and margins are those of the style or of what is around."""
    layout = QHBoxLayout()
    _fill(layout, parts, spacing_px, margins_px)
    return layout


def column_of(
    *parts: Part, spacing_px: int | None = None, margins_px: Margins | None = None
) -> QVBoxLayout:
    """Parts below each other; see :func:`row_of`."""
    layout = QVBoxLayout()
    _fill(layout, parts, spacing_px, margins_px)
    return layout


def form_of(
    *rows: tuple[str | QWidget, QWidget | QLayout], gaps_px: tuple[int, int] = (16, 8)
) -> QFormLayout:
    """Fields below each other, each with its name; gaps across and down."""
    form = QFormLayout()
    form.setHorizontalSpacing(gaps_px[0])
    form.setVerticalSpacing(gaps_px[1])
    form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
    for name, field in rows:
        form.addRow(name, field)
    return form


def grid_of(
    *rows: Sequence[QWidget], gaps_px: tuple[int, int], wide: Sequence[int] = (1,)
) -> QGridLayout:
    """Rows of widgets in columns, of which the ``wide`` ones share what room is left over."""
    grid = QGridLayout()
    grid.setContentsMargins(0, 0, 0, 0)
    grid.setHorizontalSpacing(gaps_px[0])
    grid.setVerticalSpacing(gaps_px[1])
    for column in wide:
        grid.setColumnStretch(column, 1)
    for line, row in enumerate(rows):
        for column, widget in enumerate(row):
            grid.addWidget(widget, line, column)
    return grid


def pane(*parts: Part, spacing_px: int = 0) -> QWidget:
    """Widget of parts below each other, without margins."""
    widget = QWidget()
    widget.setLayout(column_of(*parts, spacing_px=spacing_px, margins_px=0))
    return widget


def _fill(
    layout: QBoxLayout, parts: tuple[Part, ...], spacing_px: int | None, margins_px: Margins | None
) -> None:
    if spacing_px is not None:
        layout.setSpacing(spacing_px)
    if margins_px is not None:
        sides = (margins_px,) * 4 if isinstance(margins_px, int) else margins_px
        layout.setContentsMargins(*sides)
    for part in parts:
        content, stretch = part if isinstance(part, tuple) else (part, 0)
        if isinstance(content, int):
            layout.addSpacing(content)
        elif isinstance(content, QWidget):
            layout.addWidget(content, stretch)
        elif isinstance(content, QLayout):
            layout.addLayout(content, stretch)
        else:
            layout.addStretch(stretch)
