"""Table of spans; its selection is the selection on the timeline."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from itertools import pairwise
from typing import cast

from PySide6.QtCore import QItemSelection, QItemSelectionModel, QItemSelectionRange, QModelIndex, Qt
from PySide6.QtGui import (
    QContextMenuEvent,
    QFocusEvent,
    QPainter,
    QPaintEvent,
    QResizeEvent,
    QShowEvent,
)
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QMenu, QWidget

from sd2app.feature import Shell
from sd2app.labels.edits import LabelEdits
from sd2app.labels.table_model import COLUMNS, NOBODY, SpanTableModel
from sd2app.session.session import Session
from sd2app.widgets.table import CellTable, FramedCells

_PADDING_PX = 8
_HIDDEN = "span_table/hidden"
_MENU = ("span_starts_here", "span_ends_here", "split_span", "merge_spans", "delete_spans")
"""Actions of the window that the context menu has too."""
_GIVE_WAY = "frames", "track", "duration"
"""Columns that a narrow table does without, first what others say as well."""


class SpanTable(CellTable):
    """Table whose current cell the window follows.

    It shows the first frame of the span in that row, in a column of ends the last one.
    """

    def __init__(
        self,
        model: SpanTableModel,
        edits: LabelEdits,
        session: Session,
        shell: Shell,
        parent: QWidget,
    ) -> None:
        super().__init__("Spans", parent=parent)
        self._model, self._edits, self._session, self._shell = model, edits, session, shell
        self._labels, self._playback = edits.labels, session.playback
        self._mirroring = False
        self._row = -1  # that was current last
        self.setModel(model)
        self.setItemDelegate(FramedCells(self))
        self.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self._arrange_columns()
        self.clicked.connect(self._go)
        edits.labels.selection_changed.connect(self.mirror)
        edits.labels.changed.connect(self.mirror)
        session.document.changed.connect(self._follow_persons)

    # --- columns --------------------------------------------------------------------------

    def _arrange_columns(self) -> None:
        header = self.horizontalHeader()
        # Asked which headings are selected, it would look at every cell of all selected rows.
        header.setSelectionModel(QItemSelectionModel(self._model, self))
        header.setSectionResizeMode(QHeaderView.ResizeMode.Interactive)
        header.setMinimumSectionSize(40)
        header.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        metrics = self.fontMetrics()
        usual = " ".join(column.id for column in COLUMNS if column.hidden)
        hidden = self._session.settings.stored(_HIDDEN, usual).split()
        texts = ((column.wide, column.heading) for column in COLUMNS)
        self._usual_px = [max(map(metrics.horizontalAdvance, one)) + _PADDING_PX for one in texts]
        for place, wide_px in enumerate(self._usual_px):
            self.setColumnWidth(place, wide_px)
        self.columns_menu = self._made_columns_menu(hidden)
        """Menu of the columns that are shown."""
        header.customContextMenuRequested.connect(
            lambda at: self.columns_menu.exec(header.mapToGlobal(at))
        )
        self.sortByColumn(0, Qt.SortOrder.AscendingOrder)
        self.setSortingEnabled(True)

    def _made_columns_menu(self, hidden: list[str]) -> QMenu:
        menu = QMenu("Columns", self)
        menu.setToolTipsVisible(True)
        for column in COLUMNS:
            action = menu.addAction(column.heading)
            action.setToolTip(column.tip)
            action.setCheckable(True)
            action.setChecked(column.id not in hidden)
            action.setEnabled(column.id != "start")  # one is always there
            action.toggled.connect(self._choose_columns)
        return menu

    def _choose_columns(self) -> None:
        chosen = zip(COLUMNS, self.columns_menu.actions(), strict=True)
        hidden = [column.id for column, action in chosen if not action.isChecked()]
        self._session.settings.set_value(_HIDDEN, " ".join(hidden))
        self._fit_columns()

    def _follow_persons(self) -> None:
        """Offer the column of persons where there are some to choose from."""
        place = next(place for place, one in enumerate(COLUMNS) if one.id == "person")
        self.columns_menu.actions()[place].setVisible(bool(self._model.choices("person")))
        self._fit_columns()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Show as many of the chosen columns as there is room for."""
        super().resizeEvent(event)
        self._fit_columns()

    def _fit_columns(self) -> None:
        actions = self.columns_menu.actions()
        shown = [at for at, one in enumerate(actions) if one.isVisible() and one.isChecked()]
        for name in _GIVE_WAY:
            if sum(self._usual_px[at] for at in shown) > self.viewport().width():
                shown = [at for at in shown if COLUMNS[at].id != name]
        for at, action in enumerate(actions):
            cut = action.isVisible() and action.isChecked() and at not in shown
            action.setText(COLUMNS[at].heading + (" (no room here)" if cut else ""))
            self.setColumnHidden(at, at not in shown)

    # --- one selection --------------------------------------------------------------------

    def selectionChanged(self, selected: QItemSelection, deselected: QItemSelection) -> None:
        """Select the chosen rows' spans in the whole window."""
        super().selectionChanged(selected, deselected)
        if not self._mirroring:
            # By ranges: rows one by one are asked for every cell, which takes seconds.
            spans = self._model.rows
            ranges = cast(Iterable[QItemSelectionRange], self.selectionModel().selection())
            self._labels.select(
                span.id for part in ranges for span in spans[part.top() : part.bottom() + 1]
            )

    def currentChanged(self, current: QModelIndex, previous: QModelIndex) -> None:
        """Go to the span of the current cell."""
        super().currentChanged(current, previous)
        self._row = current.row()
        if not self._mirroring:
            self._go(current)

    def _go(self, index: QModelIndex) -> None:
        if not index.isValid():
            return
        span, column = self._model.rows[index.row()], COLUMNS[index.column()]
        base = self._playback.timebase
        first, stop = base.frames_between(span.start_s, span.end_s)
        at_end = column.edge is not None and column.edge.side == "end"
        if stop > first:
            self._playback.seek_frame(stop - 1 if at_end else first)
            self._session.span.reveal(self._playback.time_s)

    def showEvent(self, event: QShowEvent) -> None:
        """Follow the labels and their selection."""
        super().showEvent(event)
        self.mirror()

    def mirror(self) -> None:
        """Select the rows of the spans selected elsewhere."""
        if not self.isVisible():
            return
        self._follow_persons()
        rows = sorted(
            row for one in self._labels.selected if (row := self._model.row_of(one.id)) is not None
        )
        chosen = QItemSelection()
        last_column = self._model.columnCount() - 1
        breaks = [0, *(k for k, (a, b) in enumerate(pairwise(rows), 1) if b != a + 1), len(rows)]
        for first, stop in pairwise(breaks):
            if stop > first:
                top = self._model.index(rows[first], 0)
                chosen.select(top, self._model.index(rows[stop - 1], last_column))
        flags = QItemSelectionModel.SelectionFlag
        self._mirroring = True
        try:
            self.selectionModel().select(chosen, flags.ClearAndSelect)
            if rows and self.currentIndex().row() not in rows:
                column = max(self.currentIndex().column(), 0)
                current = self._model.index(rows[0], column)
                self.selectionModel().setCurrentIndex(current, flags.NoUpdate)
                self.scrollTo(current)
            elif not self.currentIndex().isValid() and self._row >= 0:  # its span is gone
                row = min(self._row, self._model.rowCount() - 1)
                current = self._model.index(row, 0)
                self.selectionModel().setCurrentIndex(current, flags.NoUpdate)
        finally:
            self._mirroring = False

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Make a row current, which is no wish to go there: the selected one, else the nearest."""
        self._mirroring = True
        try:
            if self._model.rows and not self.currentIndex().isValid():
                self._make_nearest_current()
            super().focusInEvent(event)
        finally:
            self._mirroring = False

    def _make_nearest_current(self) -> None:
        now_s = self._playback.time_s
        nearest = min(
            range(len(self._model.rows)),
            key=lambda row: abs(self._model.rows[row].start_s - now_s),
        )
        self.selectionModel().setCurrentIndex(
            self._model.index(nearest, 0), QItemSelectionModel.SelectionFlag.NoUpdate
        )

    # --- the rest -------------------------------------------------------------------------

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the rows, or why there are none."""
        super().paintEvent(event)
        if not self._model.rows:
            with QPainter(self.viewport()) as painter:
                painter.setPen(self.palette().color(self.palette().ColorRole.PlaceholderText))
                words = (
                    "No span matches the filters"
                    if self._model.total
                    else "Nothing is labelled yet"
                )
                place = Qt.AlignmentFlag.AlignCenter
                painter.drawText(self.viewport().rect(), place, words)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Show the menu of the selected rows."""
        if not self._labels.selected:
            return
        menu = QMenu(self)
        for title, listed, run in (
            ("Give label", "label", self._edits.relabel),
            ("Put on track", "track", partial(self._edits.give, "track")),
            ("Give to person", "person", partial(self._edits.give, "person")),
        ):
            if not (choices := self._model.choices(listed)):
                continue
            submenu = menu.addMenu(title)
            for choice in choices:
                submenu.addAction(choice or NOBODY, partial(run, choice))
        menu.addSeparator()
        menu.addActions([self._shell.action(name) for name in _MENU])
        menu.exec(event.globalPos())
