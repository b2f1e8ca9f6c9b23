"""Page of facts about a model file."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFormLayout, QLabel, QScrollArea, QWidget

from sd2app.widgets.dialogs import Dialog, closing
from sd2app.widgets.layouts import column_of
from sd2app.widgets.model_page import ModelPage
from sd2app.widgets.panel import sentence, side_by_side, title


class ModelCardDialog(Dialog):
    """Dialog of facts from the header of a model file, which is not loaded for it."""

    def __init__(self, page: ModelPage, parent: QWidget) -> None:
        super().__init__(f"Model: {page.title}", parent)
        inside = QWidget(self)
        form = QFormLayout(inside)
        form.setContentsMargins(16, 8, 16, 16)
        form.setHorizontalSpacing(24)
        form.setVerticalSpacing(4)
        head = [title(page.title)]
        if page.simulated:
            badge = QLabel("simulated data only", self)
            badge.setObjectName("badge")
            badge.setToolTip("No real radar was there when this model learned")
            head.append(badge)
        form.addRow(side_by_side(*head, spacing_px=12))
        for heading, rows in (("", page.rows), *page.sections):
            if heading:
                above = title(heading)
                above.setMinimumHeight(32)
                above.setAlignment(Qt.AlignmentFlag.AlignBottom)
                form.addRow(above)
            for name, text in rows:
                value = sentence(text, "")
                if name:
                    form.addRow(sentence(name), value)
                else:
                    form.addRow(value)
        scroll = QScrollArea(self)
        scroll.setWidget(inside)
        scroll.setWidgetResizable(True)
        self.setLayout(column_of(scroll, closing(self)))
        self.resize(640, 560)
