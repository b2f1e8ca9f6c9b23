"""Files with a plan of placements: taken into the recording, or written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtWidgets import QFileDialog, QWidget

from sd2app.sensor.placements import PlacementsModel
from sd2core.errors import Sd2Error
from sd2core.placements.placements import read_placements, write_placements

_READ = "Placements (*.json *.toml);;All files (*)"
_WRITTEN = "Placements (*.json)"


class PlacementDialogs:
    """Dialogs, followed by calls of the model; ``report`` shows the sentence of a failure."""

    def __init__(
        self,
        parent: QWidget,
        placements: PlacementsModel,
        report: Callable[[str], None],
        note: Callable[[str], None],
    ) -> None:
        self._parent = parent
        self._placements = placements
        self._report, self._note = report, note

    def take(self) -> None:
        """Let the user choose a file with a plan."""
        name, _ = QFileDialog.getOpenFileName(self._parent, "Take placements", "", _READ)
        if not name:
            return
        try:
            self._placements.edits.plan_placements(read_placements(Path(name)))
        except Sd2Error as error:
            self._report(str(error))

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
            self._report(f"{path} cannot be written ({error.strerror}).")
        else:
            self._note(f"The placements are in {path}.")
