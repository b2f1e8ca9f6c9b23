"""Dialog to import labels: content above, choices below."""

from __future__ import annotations

from PySide6.QtCore import QSignalBlocker
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QLabel,
    QVBoxLayout,
    QWidget,
)

from sd2app.labels.import_model import LabelImportModel
from sd2app.widgets.inputs import Choice
from sd2app.widgets.panel import FactRows, rule, sentence, title
from sd2core.labels.formats import FORMATS

_MOST_FACTS = 6


class LabelImportDialog(QDialog):
    """View of :class:`LabelImportModel`."""

    def __init__(self, model: LabelImportModel, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._model = model
        self.setWindowTitle("Import labels")
        self._build_reading()
        self._build_way()
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Cancel, self)
        self._import = buttons.addButton("Import", QDialogButtonBox.ButtonRole.AcceptRole)
        self._import.setDefault(True)
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        self._lay_out(buttons)
        model.changed.connect(self._refresh)
        self._refresh()
        self.setMinimumWidth(560)

    # --- building -------------------------------------------------------------------------

    def _build_reading(self) -> None:
        model = self._model
        self._format = Choice("The program that the file is of", self)
        self._format.addItem("found by name and content", None)
        for one in FORMATS:
            self._format.addItem(one.title, one.name)
        self._format.currentIndexChanged.connect(
            lambda _: model.read_as(self._format.currentData())
        )
        self._observation = Choice("Which of the videos in the file", self)
        self._observation.currentTextChanged.connect(
            lambda name: model.set_observation(name) if name else None
        )
        self._observation_name = QLabel("Observation", self)
        self._facts = FactRows(_MOST_FACTS, at_the_edge=False, parent=self)
        self._said = sentence("")

    def _build_way(self) -> None:
        self._way = Choice("What becomes of the labels that are there", self)
        self._way.addItem("on tracks of their own", "add")
        self._way.addItem("instead of all labels of this recording", "replace")
        self._way.currentIndexChanged.connect(
            lambda _: self._model.set_way(self._way.currentData())
        )
        self._consequence = sentence("")

    def _lay_out(self, buttons: QDialogButtonBox) -> None:
        form = QFormLayout()
        form.setHorizontalSpacing(12)
        form.addRow("Read as", self._format)
        form.addRow(self._observation_name, self._observation)
        take = QFormLayout()
        take.setHorizontalSpacing(12)
        take.addRow("Take them", self._way)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(8)
        layout.addWidget(title(self._model.path.name))
        layout.addLayout(form)
        layout.addWidget(rule())
        layout.addWidget(self._said)
        layout.addWidget(self._facts)
        layout.addWidget(rule())
        layout.addLayout(take)
        layout.addWidget(self._consequence)
        layout.addSpacing(8)
        layout.addWidget(buttons)

    # --- following the model --------------------------------------------------------------

    def _refresh(self) -> None:
        model = self._model
        self._show_said(model.problem or ("" if model.incoming is not None else "Reading…"))
        self._facts.show_facts(model.facts())
        several = bool(model.observations)
        for widget in (self._observation_name, self._observation):
            widget.setVisible(several)
        with QSignalBlocker(self._observation):
            if [self._observation.itemText(k) for k in range(self._observation.count())] != list(
                model.observations
            ):
                self._observation.clear()
                self._observation.addItems(model.observations)
            self._observation.setCurrentText(model.observation or "")
        with QSignalBlocker(self._way):
            self._way.setCurrentIndex(self._way.findData(model.way))
        self._consequence.setText(model.consequence())
        self._import.setEnabled(model.incoming is not None)

    def _show_said(self, text: str) -> None:
        self._said.setVisible(bool(text))
        self._said.setText(text)
        self._said.setObjectName("warning" if self._model.problem else "muted")
        self._said.style().unpolish(self._said)
        self._said.style().polish(self._said)
