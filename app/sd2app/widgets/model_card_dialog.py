"""Page of facts about a model file."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QScrollArea,
    QWidget,
)

from sd2app.widgets.layouts import column_of
from sd2app.widgets.model_page import ModelPage


class ModelCardDialog(QDialog):
    """Dialog of facts from the header of a model file, which is not loaded for it."""

    def __init__(self, page: ModelPage, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle(f"Model: {page.title}")
        inside = QWidget(self)
        self._grid = QGridLayout(inside)
        self._grid.setContentsMargins(16, 8, 16, 16)
        self._grid.setHorizontalSpacing(24)
        self._grid.setVerticalSpacing(4)
        self._grid.setColumnStretch(1, 1)
        self._grid.addLayout(self._head(page), 0, 0, 1, 2)
        self._add(page.rows)
        for heading, rows in page.sections:
            self._add(rows, heading)
        self._grid.setRowStretch(self._grid.rowCount(), 1)
        scroll = QScrollArea(self)
        scroll.setWidget(inside)
        scroll.setWidgetResizable(True)
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close, self)
        buttons.rejected.connect(self.reject)
        self.setLayout(column_of(scroll, buttons))
        self.resize(640, 560)

    def _head(self, page: ModelPage) -> QHBoxLayout:
        row = QHBoxLayout()
        row.setSpacing(12)
        title = QLabel(page.title, self)
        title.setObjectName("title")
        row.addWidget(title)
        if page.simulated:
            badge = QLabel("simulated data only", self)
            badge.setObjectName("badge")
            badge.setToolTip("No real radar was there when this model learned")
            row.addWidget(badge)
        row.addStretch(1)
        return row

    def _add(self, rows: list[tuple[str, str]], heading: str = "") -> None:
        number = self._grid.rowCount()
        if heading:
            label = QLabel(heading, self)
            label.setObjectName("title")
            self._grid.addWidget(label, number, 0, 1, 2, Qt.AlignmentFlag.AlignBottom)
            self._grid.setRowMinimumHeight(number, 32)
            number += 1
        for name, text in rows:
            value = QLabel(text, self)
            value.setWordWrap(True)
            value.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
            if name:
                label = QLabel(name, self)
                label.setObjectName("muted")
                self._grid.addWidget(label, number, 0, Qt.AlignmentFlag.AlignTop)
                self._grid.addWidget(value, number, 1)
            else:
                self._grid.addWidget(value, number, 0, 1, 2)
            number += 1
