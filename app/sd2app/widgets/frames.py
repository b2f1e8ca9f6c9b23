"""Framed panels, splitters and how they are filled."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QLayout, QSplitter, QVBoxLayout, QWidget


def panel(name: str) -> QFrame:
    """An empty panel."""
    frame = QFrame()
    frame.setObjectName("panel")
    frame.setAccessibleName(name.capitalize())
    # A click anywhere in it takes the keyboard back from a number box.
    frame.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
    return frame


def splitter(
    orientation: Qt.Orientation, widgets: list[QWidget], sizes: tuple[int, ...]
) -> QSplitter:
    """Widgets side by side or below each other, of these sizes to begin with."""
    made = QSplitter(orientation)
    made.setChildrenCollapsible(False)
    made.setHandleWidth(8)
    for widget in widgets:
        made.addWidget(widget)
    made.setSizes(list(sizes))
    # Extra room goes to the middle of the top row and to the left of the bottom row.
    for index, size in enumerate(sizes):
        made.setStretchFactor(index, 1 if size == max(sizes) else 0)
    return made


def fill(frame: QFrame, content: QWidget | QLayout) -> None:
    """Put something into an empty panel."""
    if isinstance(content, QWidget):
        layout: QLayout = QVBoxLayout()
        layout.addWidget(content)
    else:
        layout = content
    layout.setContentsMargins(1, 1, 1, 1)
    layout.setSpacing(0)
    frame.setLayout(layout)
