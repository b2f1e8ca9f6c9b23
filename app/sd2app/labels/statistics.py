"""Page of statistics per label, with buttons to copy them."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QObject
from PySide6.QtGui import QGuiApplication, QIcon
from PySide6.QtWidgets import QAbstractItemView, QWidget

from sd2app.labels.model import LabelsModel
from sd2app.session.playback import PlaybackModel
from sd2app.widgets.icons import swatch_icon
from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import outlined
from sd2app.widgets.record_table import Heading, RecordTableModel
from sd2app.widgets.table import RecordTable
from sd2core.labels.statistics import HEADINGS, label_statistics, statistics_rows, statistics_text

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
_WIDE = "■ left-to-right  "
_PADDING_PX = 10


class StatisticsTableModel(RecordTableModel[tuple[str, ...]]):
    """A row per label."""

    def __init__(self, labels: LabelsModel, playback: PlaybackModel, parent: QObject) -> None:
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
        return statistics_text(self.rows, separator)

    def _refresh(self) -> None:
        base = self._playback.timebase
        self.beginResetModel()
        found = label_statistics(self._labels.labels, (base.start_s, base.end_s))
        self.rows = statistics_rows(found)
        self.endResetModel()

    def _text(self, record: tuple[str, ...], column: int) -> str:
        return record[column]

    def _icon(self, record: tuple[str, ...], column: int) -> QIcon | None:
        return None if column else swatch_icon(self._labels.colour_of(record[0]))


class StatisticsPage(QWidget):
    """A row per label; kept up to date while it is shown."""

    def __init__(self, labels: LabelsModel, playback: PlaybackModel, parent: QWidget) -> None:
        super().__init__(parent)
        self._model = StatisticsTableModel(labels, playback, self)
        table = RecordTable("Statistics per label", self)
        table.setModel(self._model)
        table.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        table.setTabKeyNavigation(False)
        for place, heading in enumerate(self._model.headings):
            text = heading.text if place else _WIDE
            wide = self.fontMetrics().horizontalAdvance(text) + _PADDING_PX
            table.setColumnWidth(place, max(wide, 52))
        to_paste, csv = (
            outlined(text, tip, partial(self._copy, separator), self)
            for text, tip, separator in (
                ("Copy table", "To be pasted into a sheet", "\t"),
                ("Copy CSV", "Comma-separated values", ","),
            )
        )
        buttons = row_of(STRETCH, to_paste, csv, spacing_px=6)
        self.setLayout(column_of((table, 1), buttons, spacing_px=6, margins_px=0))

    def _copy(self, separator: str) -> None:
        text = self._model.text(separator)
        clipboard = QGuiApplication.clipboard()
        clipboard.setText(text)
        if separator == ",":
            # The clipboard's own: data made here would be deleted after Python, with a crash.
            clipboard.mimeData().setData("text/csv", text.encode())
