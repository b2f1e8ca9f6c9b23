"""Dialogs of the label set: choice of a colour, files to read and write."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtGui import QColor
from PySide6.QtWidgets import QColorDialog, QFileDialog

from sd2app.feature import Shell
from sd2app.labels.columns import Change
from sd2app.labels.model import LabelsModel
from sd2core.labels.field_edits import set_label_set
from sd2core.labels.files import read_label_set, write_label_set
from sd2core.labels.label_set import GESTURES, LabelSet

_FILES = "Label set (*.json);;All files (*)"


class LabelSetDialogs:
    """Dialogs, followed by the edit; ``report`` shows the sentence of a failure."""

    def __init__(self, shell: Shell, labels: LabelsModel, apply: Callable[[Change], bool]) -> None:
        self._shell, self._labels, self._apply = shell, labels, apply
        self._parent = shell.dialog_parent

    def ask_colour(self, colour: str) -> str:
        """Let the user choose any colour; empty where there is none."""
        chosen = QColorDialog.getColor(QColor(colour), self._parent, "Colour of the label")
        return chosen.name() if chosen.isValid() else ""

    def import_set(self) -> None:
        """Use the set of a file."""
        name, _ = QFileDialog.getOpenFileName(self._parent, "Import label set", "", _FILES)
        if name:
            self._shell.attempt(lambda: self._use(read_label_set(Path(name))))

    def export_set(self) -> None:
        """Write the set to a file."""
        shown = self._labels.labels.label_set
        start = f"{shown.name or 'labels'}.json".replace("/", "-")
        name, _ = QFileDialog.getSaveFileName(self._parent, "Export label set", start, _FILES)
        if name:
            self._shell.attempt(lambda: write_label_set(Path(name), shown))

    def usual_set(self) -> None:
        """Use the program's own set."""
        self._use(GESTURES)

    def _use(self, label_set: LabelSet) -> None:
        self._apply(lambda labels, _: set_label_set(labels, label_set))
