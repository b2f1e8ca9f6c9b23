"""Dialogs on the tracks of labels, and on the reaction time."""

from __future__ import annotations

from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QInputDialog,
    QLineEdit,
    QWidget,
)

from sd2app.feature import Shell
from sd2app.labels.edits import LabelTracks
from sd2app.labels.marking import LONGEST_MS, ReactionModel
from sd2app.labels.model import LabelsModel
from sd2core.labels.spans import Overlap


class TrackDialog(QDialog):
    """Name of a new track, and a choice if its spans may overlap."""

    def __init__(self, name: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("Add track")
        self._name = QLineEdit(name, self)
        self._name.setAccessibleName("Name of the track")
        self._name.selectAll()
        self._free = QCheckBox("Spans may overlap, e.g. of two hands", self)
        buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.Ok | QDialogButtonBox.StandardButton.Cancel, self
        )
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        accept = buttons.button(QDialogButtonBox.StandardButton.Ok)
        accept.setText("Add track")
        self._name.textChanged.connect(lambda text: accept.setEnabled(bool(text.strip())))
        layout = QFormLayout(self)
        layout.addRow("Name", self._name)
        layout.addRow("", self._free)
        layout.addRow(buttons)

    @property
    def name(self) -> str:
        """Name typed."""
        return self._name.text().strip()

    @property
    def overlap(self) -> Overlap:
        """Overlap chosen."""
        return "free" if self._free.isChecked() else "exclusive"


class TrackDialogs:
    """Dialogs, followed by calls of the edits."""

    def __init__(
        self, shell: Shell, labels: LabelsModel, tracks: LabelTracks, reaction: ReactionModel
    ) -> None:
        self._shell, self._labels, self._tracks, self._reaction = shell, labels, tracks, reaction

    def add(self) -> None:
        """Ask for a name, and add a track."""
        dialog = TrackDialog(self._tracks.new_name, self._shell.dialog_parent)
        if dialog.exec() == QDialog.DialogCode.Accepted:
            self._tracks.add(dialog.name, dialog.overlap)
        dialog.deleteLater()

    def rename(self) -> None:
        """Ask for another name of the track for new spans."""
        name, accepted = QInputDialog.getText(
            self._shell.dialog_parent, "Rename track", "Name", text=self._labels.track
        )
        if accepted:
            self._tracks.rename(name.strip())

    def remove(self) -> None:
        """Remove the track for new spans, and report the spans removed with it."""
        labels = self._labels
        track, count = labels.track, len(labels.labels.of_track(labels.track))
        if self._tracks.remove() and count:
            spans = "1 span" if count == 1 else f"{count} spans"
            self._shell.note(f"Removed {track!r} with {spans}; undo brings them back.")

    def reaction(self) -> None:
        """Ask for a reaction time that the menu does not offer."""
        reaction = self._reaction
        chosen_ms, accepted = QInputDialog.getInt(
            self._shell.dialog_parent,
            "Reaction time",
            "Marks made while it plays begin and end earlier by so many milliseconds.",
            reaction.reaction_ms,
            0,
            LONGEST_MS,
            10,
        )
        if accepted:
            reaction.set_reaction_ms(chosen_ms)
