"""The maps that a batch made, as rows."""

from __future__ import annotations

from pathlib import Path

from pydantic import TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass
from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import LatestRunner
from sd2app.widgets.record_table import Heading, RecordTableModel
from sd2core.batch.folder import BatchFolder
from sd2core.errors import Sd2Error
from sd2core.files.limits import open_regular
from sd2core.files.texts import whole_lines
from sd2core.placements.placements import Place
from sd2core.sensor import Vector, VirtualSensor, spherical_from_position

_MAX_ROWS = 50_000
"""Limit of shown rows; the file has all."""
_COLUMNS = ("Recording", "Subject", "Place", "Seen from the body", "Maps")


@dataclass(frozen=True)
class Result:
    """One map of a recording from one place, as a line of ``results.jsonl`` describes it."""

    recording: str
    subject: str
    source: str  # the processed file
    mesh: str  # the mesh that the map is of
    placement: int | None  # 0 or None is the recording's own sensor
    sensor: VirtualSensor
    target_m: Vector  # position of the body
    # Files of the maps, relative to the folder of the batch.
    synthetic: str | None = None
    denoised: str | None = None
    simulated: str | None = None

    @property
    def kinds(self) -> str:
        """Kinds of maps that there are, in words."""
        kinds = ("synthetic", "denoised", "simulated")
        return ", ".join(kind for kind in kinds if getattr(self, kind))


_LINE = TypeAdapter(Result)


class BatchResults(RecordTableModel[Result]):
    """Reads ``results.jsonl`` in the background; one row per map, however many stretches."""

    changed = Signal()

    def __init__(self, parent: QObject) -> None:
        super().__init__([Heading(text) for text in _COLUMNS], parent)
        self.card = ""  # of the exported data set, as Markdown; empty where there is none
        self._runner = LatestRunner("results", parent, self._take)
        # There may be none, or the disk is away.
        self._runner.failed.connect(lambda error: self.forget())

    def read(self, folder: BatchFolder) -> None:
        """Read the results of a batch."""
        self._runner.submit(lambda emit: (_rows(folder.results), _card(folder)))

    def forget(self) -> None:
        """Show none."""
        self._runner.cancel()
        self._take(([], ""))

    def _take(self, results: tuple[list[Result], str]) -> None:
        self.beginResetModel()
        self.rows, self.card = results
        self.endResetModel()
        self.changed.emit()

    def _text(self, record: Result, column: int) -> str:
        around = spherical_from_position(record.target_m, record.sensor.position_m)
        return (
            record.recording,
            record.subject,
            f"{record.placement:,}" if record.placement else "own sensor",
            Place(*around).words.replace("-", "−"),
            record.kinds,
        )[column]


def _rows(file: Path) -> list[Result]:
    rows: dict[tuple[str, str, int], Result] = {}
    with open_regular(file) as stream:
        for line in whole_lines(stream):
            row = _row(line)
            if row is not None:
                rows.setdefault((row.recording, row.subject, row.placement or 0), row)
            if len(rows) >= _MAX_ROWS:
                break
    return list(rows.values())


def _row(line: bytes) -> Result | None:
    try:
        return _LINE.validate_json(line)
    except (ValidationError, Sd2Error):
        return None


def _card(folder: BatchFolder) -> str:
    """Card of the exported data set; empty where none was exported."""
    from sd2core.datasets.card import card_paths

    try:
        return card_paths(folder.path / "dataset")[0].read_text(encoding="utf-8")
    except OSError:
        return ""
