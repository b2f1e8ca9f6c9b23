"""Export of data sets in a background process."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QObject, Qt

from sd2app.dataset_export.dialog import ExportDialog
from sd2app.dataset_export.model import ExportModel
from sd2app.feature import Action, Feature, Shell, report
from sd2app.session.saving import saved_first
from sd2app.session.session import Session


class DatasetExportFeature(Feature):
    """Segments with labels to learn from, of the open recording or a folder."""

    def __init__(self, session: Session, shell: Shell, parent: QObject) -> None:
        self._session, self._shell = session, shell
        self.model = ExportModel(session.jobs, parent)
        report(shell, self.model)
        self.closing = self.running = (self.model,)  # an export goes on

    def actions(self) -> Sequence[Action]:
        """The dialog."""
        return (
            Action(
                "export_dataset", "File", "Export data set…", ("Ctrl+Shift+D",),
                "Write segments with labels to learn from (Zarr, HDF5, NPZ), of this recording or"
                " a folder",
                self._export,
            ),
        )  # fmt: skip

    def _export(self) -> None:
        """Choose what a data set holds and have it written; the window can be used meanwhile."""
        document = self._session.document
        if not saved_first(document, self._shell, "A data set is made of what is saved."):
            return
        recording = document.recording
        opened = None if recording is None else recording.folder
        if not self.model.under_way:
            self.model.begin(opened)
        dialog = ExportDialog(self.model, opened, self._shell.dialog_parent)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.open()
