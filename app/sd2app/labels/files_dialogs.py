"""Dialogs to import and export labels and cut-outs."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QDialog, QFileDialog, QMessageBox

from sd2app.feature import Shell
from sd2app.labels.cut_out_dialog import CutOutDialog
from sd2app.labels.cut_out_model import CutOutModel, groups
from sd2app.labels.edits import LabelEdits
from sd2app.labels.export_dialog import LabelExportDialog
from sd2app.labels.export_model import LabelExportModel
from sd2app.labels.import_dialog import LabelImportDialog
from sd2app.labels.import_model import LABEL_FILES, LabelImportModel, is_label_file
from sd2app.labels.model import LabelsModel
from sd2app.session.session import Session
from sd2core.labels.import_labels import take_in


class LabelFileDialogs:
    """Dialogs, followed by calls of models and edits; results are shown over the window."""

    def __init__(
        self,
        shell: Shell,
        session: Session,
        labels: LabelsModel,
        edits: LabelEdits,
        cut_out: CutOutModel,
    ) -> None:
        self._shell, self._session = shell, session
        self._labels, self._edits, self._cut_out = labels, edits, cut_out
        cut_out.asked.connect(self.decide_on_others)

    def take_dropped(self, path: Path) -> bool:
        """Import a dropped file of labels; False where it is none."""
        if not is_label_file(path):
            return False
        # A dialog during the drop would keep the program waiting that it came from.
        QTimer.singleShot(0, lambda: self.import_labels(path))
        return True

    def import_labels(self, path: Path | None = None) -> None:
        """Ask for a file unless there is one, preview it, and import it."""
        if self._edits.refusal:
            self._shell.warn(self._edits.refusal)
            return
        if path is None:
            name, _ = QFileDialog.getOpenFileName(
                self._shell.dialog_parent, "Import labels", "", LABEL_FILES
            )
            if not name:
                return
            path = Path(name)
        model = LabelImportModel(
            path, self._labels.labels, self._session.playback.timebase, self._shell.dialog_parent
        )
        dialog = LabelImportDialog(model, self._shell.dialog_parent)
        accepted = dialog.exec() == QDialog.DialogCode.Accepted
        incoming, way = model.incoming, model.way
        model.close()
        for done in (dialog, model):
            done.deleteLater()
        if accepted and incoming is not None:
            self._edits.apply(lambda labels, _: take_in(labels, incoming, way, path.stem))

    def export_labels(self) -> None:
        """Ask for format and file, show the losses, and write it."""
        content = self._session.document.content
        if content is None:
            return
        model = LabelExportModel(
            self._labels.labels,
            self._session.playback.timebase,
            content.recording.video,
            self._shell.dialog_parent,
        )
        model.written.connect(lambda written: self._shell.note(str(written)))
        dialog = LabelExportDialog(model, self._session.document.title, self._shell.dialog_parent)
        dialog.exec()
        model.close()
        for done in (dialog, model):
            done.deleteLater()

    def cut_out(self) -> None:
        """Ask for spans, parts and folder, and export the cut-outs in the background."""
        source = self._cut_out.source()
        offered = groups(self._labels.labels, self._labels.selected)
        if source is None:
            return
        if not offered[-1][1]:
            self._shell.warn("There is nothing to cut out: accept the suggestions first.")
            return
        dialog = CutOutDialog(offered, source, self._shell.dialog_parent)
        accepted = dialog.exec() == QDialog.DialogCode.Accepted
        spans, parts = dialog.spans, dialog.parts
        dialog.deleteLater()
        if not accepted:
            return
        folder = QFileDialog.getExistingDirectory(
            self._shell.dialog_parent, "Folder for the cut-outs"
        )
        if folder:
            self._cut_out.start(spans, parts, Path(folder))

    def decide_on_others(self, count: int, example: str) -> None:
        """Ask what to do with folders that hold something else."""
        buttons = QMessageBox.StandardButton
        box = QMessageBox(self._shell.dialog_parent)
        box.setWindowTitle("Replace cut-outs?")
        box.setText(
            f"{count} folder{'s' * (count != 1)} of the same name hold something else, such as"
            f" {example}."
        )
        replace = box.addButton("Replace", QMessageBox.ButtonRole.DestructiveRole)
        keep = box.addButton("Keep them", QMessageBox.ButtonRole.AcceptRole)
        box.addButton(buttons.Cancel)
        box.setDefaultButton(keep)
        box.exec()
        if box.clickedButton() in (replace, keep):
            self._cut_out.go_on(replace_others=box.clickedButton() is replace)
        else:
            self._cut_out.give_up()
        box.deleteLater()
