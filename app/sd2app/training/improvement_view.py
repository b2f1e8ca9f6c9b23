"""Improvement of a trained model over the earlier one, on the open recording."""

from __future__ import annotations

from PySide6.QtCore import QSignalBlocker
from PySide6.QtWidgets import QCheckBox, QHBoxLayout, QVBoxLayout, QWidget

from sd2app.training.result import TrainingUse
from sd2app.training.text import gain_rows, gain_summary
from sd2app.widgets.panel import FactRows, outlined, sentence, title


class TrainingGainView(QWidget):
    """A view of :class:`TrainingUse`."""

    def __init__(self, use: TrainingUse, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._use = use
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(4)
        layout.addWidget(title("In use"))
        self._summary = sentence("")
        layout.addWidget(self._summary)
        self._table = FactRows(3, at_the_edge=True, parent=self)
        layout.addWidget(self._table)
        self._both = QCheckBox("Show the map from before", self)
        self._both.setToolTip("Draw the map of the model before under that of this one")
        self._both.toggled.connect(use.set_comparing)
        self._back = outlined("Go back", "Denoise with what was in use before", use.go_back, self)
        row = QHBoxLayout()
        row.addWidget(self._both)
        row.addStretch(1)
        row.addWidget(self._back)
        layout.addLayout(row)
        use.changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        use = self._use
        self._summary.setText(gain_summary(use.gain, use.has_radar))
        self._table.show_facts(gain_rows(use.gain) if use.gain is not None else [])
        with QSignalBlocker(self._both):
            self._both.setChecked(use.comparing)
        self._both.setVisible(use.can_compare)
