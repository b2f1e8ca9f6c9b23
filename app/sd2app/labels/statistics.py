"""Statistics per label as the rows of a table."""

from __future__ import annotations

from PySide6.QtCore import QObject
from PySide6.QtGui import QIcon

from sd2app.labels.model import LabelsModel
from sd2app.session.playback import PlaybackModel
from sd2app.widgets.icons import swatch_icon
from sd2app.widgets.record_table import Heading, RecordTableModel
from sd2core.labels.statistics import (
    HEADINGS,
    label_statistics,
    statistics_rows,
    statistics_text,
)

_TIPS = (
    "Labels of the set, then any others that spans have",
    "Number of spans",
    "Sum of their lengths; overlapping spans count in full",
    "Mean length",
    "Standard deviation of the lengths (n − 1)",
    "Median length",
    "Shortest length",
    "Longest length",
    "Share of the recording that they cover; overlaps count once",
)


class StatisticsTableModel(RecordTableModel[tuple[str, ...]]):
    """A row per label."""

    def __init__(
        self, labels: LabelsModel, playback: PlaybackModel, parent: QObject | None = None
    ) -> None:
        texts = (text.capitalize().replace("Sd ", "SD ") for text in HEADINGS)
        headings = [
            Heading(text, tip, number=place > 0)
            for place, (text, tip) in enumerate(zip(texts, _TIPS, strict=True))
        ]
        super().__init__(headings, parent)
        self._labels, self._playback = labels, playback
        labels.changed.connect(self._follow)

    def text(self, separator: str) -> str:
        """Return the table as CSV, or with a tab to paste into a sheet."""
        return statistics_text(self._rows, separator)

    def _refresh(self) -> None:
        base = self._playback.timebase
        self.beginResetModel()
        found = label_statistics(self._labels.labels, (base.start_s, base.end_s))
        self._rows = statistics_rows(found)
        self.endResetModel()

    def _text(self, record: tuple[str, ...], column: int) -> str:
        return record[column]

    def _icon(self, record: tuple[str, ...], column: int) -> QIcon | None:
        return None if column else swatch_icon(self._labels.colour_of(record[0]))
