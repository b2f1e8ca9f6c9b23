"""Dialog to export labels: the format and its losses."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtWidgets import (
    QDialog,
    QFileDialog,
    QFormLayout,
    QVBoxLayout,
    QWidget,
)

from sd2app.labels.export_model import LabelExportModel
from sd2app.widgets.dialogs import ExportButtons
from sd2app.widgets.inputs import Choice
from sd2app.widgets.panel import rule, sentence
from sd2core.labels.formats import FORMATS


class LabelExportDialog(QDialog):
    """View of :class:`LabelExportModel`; accepted once the file is written."""

    def __init__(self, model: LabelExportModel, name: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._model, self._name = model, name
        self.setWindowTitle("Export labels")
        self._format = Choice("The program that is to read the file", self)
        for one in FORMATS:
            self._format.addItem(one.title, one.name)
        self._format.currentIndexChanged.connect(lambda _: model.choose(self._format.currentData()))
        self._about, self._losses = sentence(""), sentence("")
        self._buttons = ExportButtons(self, self._ask)
        form = QFormLayout()
        form.setHorizontalSpacing(12)
        form.addRow("For", self._format)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(8)
        layout.addLayout(form)
        layout.addWidget(self._about)
        layout.addWidget(rule())
        layout.addWidget(self._losses)
        layout.addStretch(1)
        layout.addWidget(self._buttons)
        model.changed.connect(self._refresh)
        model.written.connect(lambda _: self.accept())
        self._refresh()
        self.resize(560, 300)

    def _refresh(self) -> None:
        model, chosen = self._model, self._model.format
        self._about.setText(
            f"{', '.join(chosen.suffixes)}, opened by {chosen.made_for}. {chosen.remark}".strip()
        )
        if model.problem:
            role, text = "warning", model.problem
        elif model.losses is None:
            role, text = "muted", "Computing the losses…"
        elif not model.losses:
            role, text = "muted", "It holds everything: read back, the labels are the same."
        else:
            role = "muted"
            text = "It cannot hold everything:\n" + "\n".join(f"• {one}." for one in model.losses)
        self._losses.setObjectName(role)
        self._losses.style().unpolish(self._losses)
        self._losses.style().polish(self._losses)
        self._losses.setText(text)
        self._buttons.show_state(possible=model.losses is not None, exporting=model.exporting)

    def _ask(self) -> None:
        chosen = self._model.format
        kinds = " ".join(f"*{suffix}" for suffix in chosen.suffixes)
        name, _ = QFileDialog.getSaveFileName(
            self, "Export labels", f"{self._name}{chosen.suffixes[0]}", f"{chosen.title} ({kinds})"
        )
        if name:
            self._model.export(Path(name))
