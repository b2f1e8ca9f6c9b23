"""Export of a map on screen: a file, or the command that makes it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtWidgets import QWidget

from sd2app.feature import Shell
from sd2app.manual.help import with_help
from sd2app.widgets.dialogs import Dialog, ExportButtons, accepted, ask_new
from sd2app.widgets.layouts import column_of
from sd2app.widgets.panel import copy_button, sentence

_ABOUT = "The map on screen as .npz with all that it was made from and with."


def export_map(
    title: str,
    name: str,
    line: Callable[[str], str],
    write: Callable[[Path], object],
    shell: Shell,
) -> None:
    """Show the dialog, and write the map where it was accepted.

    Parameters
    ----------
    title : str
    name : str
        Proposed for the file.
    line : callable
        Says the command that writes the map of the saved recording to a file of this name.
    write : callable
        Writes the map on screen.
    shell : Shell
    """
    dialog = MapExportDialog(title, name, partial(line, name), shell.dialog_parent)
    if accepted(dialog) and (path := dialog.path) is not None:
        shell.attempt(lambda: write(path))


class MapExportDialog(Dialog):
    """What is written, a copy of the command, and a button that asks for the file."""

    def __init__(self, title: str, name: str, line: Callable[[], str], parent: QWidget) -> None:
        super().__init__(title, parent)
        self.path: Path | None = None  # that was chosen
        self._name = name
        buttons = ExportButtons(self, self._ask)
        foot = with_help("Export map", buttons, copy_button(line, self))
        self.setLayout(column_of(sentence(_ABOUT), foot, spacing_px=16, margins_px=16))
        self.setMinimumWidth(440)

    def _ask(self) -> None:
        if path := ask_new(self, self.windowTitle(), self._name, "Doppler map (*.npz)"):
            self.path = path
            self.accept()
