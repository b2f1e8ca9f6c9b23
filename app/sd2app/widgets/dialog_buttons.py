"""The buttons of a dialog that exports something."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtWidgets import QDialog, QDialogButtonBox


class ExportButtons(QDialogButtonBox):
    """Export… asks where to, and Cancel ends the dialog.

    Parameters
    ----------
    dialog : QDialog
    ask : callable
        Where to; called when the first is pressed.
    """

    def __init__(self, dialog: QDialog, ask: Callable[[], None]) -> None:
        super().__init__(QDialogButtonBox.StandardButton.Cancel, dialog)
        self._export = self.addButton("Export…", QDialogButtonBox.ButtonRole.ActionRole)
        self._export.setDefault(True)
        self._export.clicked.connect(ask)
        self.rejected.connect(dialog.reject)

    def show_state(self, *, possible: bool, exporting: bool) -> None:
        """Whether there is something to export, and whether it is being written."""
        self._export.setEnabled(possible and not exporting)
        self._export.setText("Exporting…" if exporting else "Export…")
