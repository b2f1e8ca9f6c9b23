"""Labels, lines and buttons of the panels at the side."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QGridLayout, QHBoxLayout, QLabel, QToolButton, QWidget

from sd2app.widgets.elided import ElidedLabel


def title(text: str) -> QLabel:
    """A heading."""
    label = QLabel(text)
    label.setObjectName("title")
    return label


def sentence(text: str, role: str = "muted") -> QLabel:
    """Words that wrap and can be selected."""
    label = QLabel(text)
    label.setObjectName(role)
    label.setWordWrap(True)
    label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    return label


def rule() -> QFrame:
    """A line between two parts."""
    line = QFrame()
    line.setFixedHeight(1)
    line.setObjectName("rule")
    return line


def outlined(text: str, tip: str, run: Callable[[], object] | None, parent: QWidget) -> QToolButton:
    """A button with a border."""
    button = QToolButton(parent)
    button.setObjectName("outlined")
    button.setText(text)
    button.setToolTip(tip)
    button.setAccessibleName(text)
    button.setAccessibleDescription(tip)
    button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    if run is not None:
        button.clicked.connect(lambda: run())
    return button


def data_row(
    name: str,
    path: str,
    about: str,
    problem: str,
    remove: Callable[[], None],
    parent: QWidget,
    below: QWidget | None = None,
) -> QWidget:
    """Something to learn from: its name, what is known of it, and a button that removes it."""
    row = QWidget(parent)
    heading = ElidedLabel(row)
    heading.setText(name)
    heading.setToolTip(path)
    facts = sentence(problem or about, "warning" if problem else "muted")
    button = QToolButton(row)
    button.setText("✕")
    button.setToolTip(f"Do not learn from {name}")
    button.setAccessibleName(button.toolTip())
    button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    button.clicked.connect(lambda: remove())
    grid = QGridLayout(row)
    grid.setContentsMargins(0, 0, 0, 0)
    grid.setSpacing(0)
    grid.addWidget(heading, 0, 0)
    grid.addWidget(button, 0, 1, 2, 1, Qt.AlignmentFlag.AlignTop)
    grid.addWidget(facts, 1, 0)
    if below is not None:
        grid.addWidget(below, 2, 0)
    grid.setColumnStretch(0, 1)
    return row


def side_by_side(*widgets: QWidget, spacing_px: int = 8) -> QHBoxLayout:
    """Widgets in a row that begins at the left and leaves the rest empty."""
    row = QHBoxLayout()
    row.setSpacing(spacing_px)
    for widget in widgets:
        row.addWidget(widget)
    row.addStretch(1)
    return row
