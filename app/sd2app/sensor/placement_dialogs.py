"""Files with a plan of placements: taken into the recording, or written."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtWidgets import QFileDialog

from sd2app.feature import Shell
from sd2app.sensor.placements import PlacementsModel
from sd2core.placements.placements import read_placements, write_placements

_READ = "Placements (*.json *.toml);;All files (*)"
_WRITTEN = "Placements (*.json)"


class PlacementDialogs:
    """Dialogs, followed by calls of the model."""

    def __init__(self, shell: Shell, placements: PlacementsModel) -> None:
        self._shell, self._placements = shell, placements
        self._parent = shell.dialog_parent

    def take(self) -> None:
        """Let the user choose a file with a plan."""
        name, _ = QFileDialog.getOpenFileName(self._parent, "Take placements", "", _READ)
        if name:
            self._shell.attempt(
                lambda: self._placements.edits.plan_placements(read_placements(Path(name)))
            )

    def export(self) -> None:
        """Let the user choose where the plan is written."""
        plan = self._placements.plan
        if plan is None:
            return
        name, _ = QFileDialog.getSaveFileName(
            self._parent, "Export placements", "placements.json", _WRITTEN
        )
        if not name:
            return
        path = Path(name)
        if path.suffix.lower() != ".json":
            path = path.with_name(path.name + ".json")
        try:
            write_placements(path, plan)
        except OSError as error:
            self._shell.warn(f"{path} cannot be written ({error.strerror}).")
        else:
            self._shell.note(f"The placements are in {path}.")
