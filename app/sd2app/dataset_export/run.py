"""Monitor of one data set that is written, and the lines of ``sd2 export --progress-json``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from sd2app.background.run_monitor import CommandRun, History


@dataclass(frozen=True)
class Exported:
    """A finished data set."""

    path: Path
    card: Path
    sheet: Path
    segments: int
    sources: int
    left_out: tuple[str, ...] = ()  # sources that could not be made, each with its reason


class ExportHistory(History):
    """Steps of an export, none while the preview sheet is drawn, and the data set at its end."""

    written: Exported | None = None

    def _done(self, event: dict[str, Any]) -> None:
        self.written = Exported(
            Path(event["dataset"]),
            Path(event["card"]),
            Path(event["sheet"]),
            int(event["segments"]),
            int(event["sources"]),
            tuple(map(str, event["failed"])),
        )

    readers: ClassVar = {**History.readers, "done": _done}


class ExportRun(CommandRun):
    """An export; its folder is that of the command, not the data set."""

    histories = ExportHistory
    history: ExportHistory
