"""Layouts written as they look: rows and columns of widgets and of one another."""

from __future__ import annotations

from PySide6.QtWidgets import QBoxLayout, QHBoxLayout, QLayout, QVBoxLayout, QWidget

Part = QWidget | QLayout | tuple[QWidget | QLayout | None, int]
"""A widget or a layout, perhaps with its share of what room is left over."""
STRETCH: Part = (None, 1)
"""Empty room."""
Margins = tuple[int, int, int, int]
"""Left, top, right and bottom, in pixels."""


def row(
    *parts: Part, spacing_px: int | None = None, margins_px: Margins | None = None
) -> QHBoxLayout:
    """Parts side by side; spacing and margins are those of the style or of what is around."""
    layout = QHBoxLayout()
    _fill(layout, parts, spacing_px, margins_px)
    return layout


def column(
    *parts: Part, spacing_px: int | None = None, margins_px: Margins | None = None
) -> QVBoxLayout:
    """Parts below each other; see :func:`row`."""
    layout = QVBoxLayout()
    _fill(layout, parts, spacing_px, margins_px)
    return layout


def _fill(
    layout: QBoxLayout, parts: tuple[Part, ...], spacing_px: int | None, margins_px: Margins | None
) -> None:
    if spacing_px is not None:
        layout.setSpacing(spacing_px)
    if margins_px is not None:
        layout.setContentsMargins(*margins_px)
    for part in parts:
        content, stretch = part if isinstance(part, tuple) else (part, 0)
        if isinstance(content, QWidget):
            layout.addWidget(content, stretch)
        elif isinstance(content, QLayout):
            layout.addLayout(content, stretch)
        else:
            layout.addStretch(stretch)
