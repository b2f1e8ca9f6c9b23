"""A few names with their values below one another."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QGridLayout, QLabel, QWidget

from sd2app.widgets.panel import sentence


class FactRows(QWidget):
    """Rows of a name and a value, as many as there are facts, up to ``most``.

    Parameters
    ----------
    most : int
    at_the_edge : bool
        Values stand at the right edge and long names wrap, instead of values following names.
    """

    def __init__(self, most: int, at_the_edge: bool, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(12)
        grid.setVerticalSpacing(2)
        grid.setColumnStretch(0 if at_the_edge else 1, 1)
        self._cells: list[tuple[QLabel, QLabel]] = []
        for row in range(most):
            name, value = sentence(""), QLabel(self)
            name.setWordWrap(at_the_edge)
            if at_the_edge:
                value.setAlignment(Qt.AlignmentFlag.AlignRight)
            grid.addWidget(name, row, 0)
            grid.addWidget(value, row, 1)
            self._cells.append((name, value))

    def show_facts(self, facts: Sequence[tuple[str, str]]) -> None:
        """Show them, and nothing where there are none."""
        self.setVisible(bool(facts))
        for row, (name, value) in enumerate(self._cells):
            texts = facts[row] if row < len(facts) else ("", "")
            for label, text in zip((name, value), texts, strict=True):
                label.setText(text)
                label.setVisible(row < len(facts))
