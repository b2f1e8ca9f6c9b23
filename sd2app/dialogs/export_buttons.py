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
        self.export = self.addButton("Export…", QDialogButtonBox.ButtonRole.ActionRole)
        self.export.setDefault(True)
        self.export.clicked.connect(ask)
        self.rejected.connect(dialog.reject)
