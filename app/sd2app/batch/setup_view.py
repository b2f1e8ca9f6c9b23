"""Set-up of a batch: recordings, placements, steps, and the estimated time."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QKeyEvent, QShowEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QFormLayout,
    QHBoxLayout,
    QListWidget,
    QListWidgetItem,
    QWidget,
)

from sd2app.batch.model import BatchModel
from sd2app.batch.questions import BatchQuestions
from sd2app.batch.run import entry_text, estimate_facts, estimate_headline, unusable_text
from sd2app.batch.setup import Accuracy, OptionalStep, most_workers
from sd2app.widgets.inputs import CheckBox, Choice, NumberBox
from sd2app.widgets.layouts import STRETCH, column_of, form_of, row_of
from sd2app.widgets.panel import (
    ElidedLabel,
    FactRows,
    outlined,
    rule,
    say,
    sentence,
    side_by_side,
    title,
)
from sd2core.numerics.map_accuracy import percent

_SUBJECT_TEXT = {
    "recording": "each recording is a person of its own",
    "folder": "all in a folder are one person",
}
_ACCURACY_TEXT: dict[Accuracy, str] = {
    "exact": "as exactly as possible",
    "tolerance": "within the tolerance of the Accuracy panel, {percent}, which takes time to plan",
}
_STEP_TEXT: dict[OptionalStep, tuple[str, str]] = {
    "fit": ("Fit bodies", "To the person in videos that have no mesh"),
    "denoise": ("Denoise with", "What a radar would show in place of every synthetic map"),
    "export": ("Export as", "Segments of all maps with their labels, to learn from"),
}
_FORMAT_TEXT = {"zarr": "Zarr", "h5": "HDF5", "npz": "NPZ"}
_MAX_FACTS = 8


class BatchSetupView(QWidget):
    """A view of :class:`BatchSetupModel` and of its estimate."""

    def __init__(self, batch: BatchModel, asks: BatchQuestions, parent: QWidget) -> None:
        super().__init__(parent)
        self._batch, self._setup, self._asks = batch, batch.setup, asks
        self._list = _Paths(self._drop, self)
        self._list.itemSelectionChanged.connect(self._follow_selection)
        self._total = title("", "What the batch would take")
        self._facts = FactRows(_MAX_FACTS, at_the_edge=False, parent=self)
        self._problem = sentence("")
        estimate = (rule(), self._total, self._facts, self._problem, STRETCH)
        parts = (self._recordings_row(), (self._list, 1), self._form(), *estimate, self._buttons())
        self.setLayout(column_of(*parts, spacing_px=8, margins_px=0))
        batch.changed.connect(self.refresh)
        self.refresh()

    def _recordings_row(self) -> QHBoxLayout:
        asks = self._asks
        add = outlined("Add files…", "Recordings, videos or meshes", asks.add_files, self)
        folder = outlined("Add folder…", "All recordings below a folder", asks.add_folder, self)
        self._remove = outlined("Remove", "Do not work on what is selected", self._drop, self)
        return row_of((title("Recordings"), 1), add, folder, self._remove, spacing_px=6)

    def _form(self) -> QFormLayout:
        set_value = self._setup.set_value
        self._subjects = Choice("Who is who", self, _SUBJECT_TEXT, partial(set_value, "subjects"))
        self._placements = Choice("Where sensors are put", self)
        self._placements.activated.connect(self._asks.choose_placements)
        self._steps: dict[OptionalStep, CheckBox] = {}
        for step, (text, tip) in _STEP_TEXT.items():
            self._steps[step] = CheckBox(text, self, partial(set_value, step), tip)
        self._accuracy = Choice("How exactly", self, _ACCURACY_TEXT, partial(set_value, "accuracy"))
        self._model = Choice("Model to denoise with", self)
        self._model.textActivated.connect(self._asks.choose_model)
        self._format = Choice(
            "Format of the data set", self, _FORMAT_TEXT, partial(set_value, "format")
        )
        self._out = ElidedLabel(self)
        choose = outlined("Choose…", "Put the results elsewhere", self._asks.choose_out, self)
        self._workers = NumberBox(
            1, most_workers(), "", "Processes that share the work", decimals=0, step=1.0
        )
        self._workers.valueChanged.connect(partial(set_value, "workers"))
        return form_of(
            ("People", self._subjects),
            ("Sensors", self._placements),
            ("Videos", self._steps["fit"]),
            ("Synthesise", self._accuracy),
            ("Then", side_by_side(self._steps["denoise"], self._model)),
            ("", side_by_side(self._steps["export"], self._format)),
            ("Results in", row_of((self._out, 1), choose, spacing_px=8)),
            ("Workers", side_by_side(self._workers)),
            gaps_px=(16, 6),
        )

    def _buttons(self) -> QHBoxLayout:
        asks = self._asks
        self._save = outlined("Save plan…", "As a file for sd2 batch", asks.save_plan, self)
        tip = "Save the plan, and copy the command for a terminal that works on it"
        self._copy = outlined("Copy command…", tip, asks.copy_command, self)
        tip = "In background processes"
        self._start = outlined("Start", tip, asks.start, self, look="primary")
        return row_of(STRETCH, self._save, self._copy, self._start, spacing_px=6)

    def refresh(self) -> None:
        """Follow the models, and the choices that the open recording offers."""
        if self._batch.run is not None:
            return
        setup = self._setup
        self._list.show_entries([(one.path, entry_text(one)) for one in setup.data])
        self._follow_selection()
        allowed = percent(setup.tolerance)
        self._accuracy.setItemText(1, _ACCURACY_TEXT["tolerance"].format(percent=allowed))
        self._subjects.show_value(setup.value("subjects"))
        self._accuracy.show_value(setup.value("accuracy"))
        self._format.show_value(setup.value("format"))
        self._placements.offer(self._asks.placement_choices(), self._asks.placement_index())
        names = list(dict.fromkeys([*self._asks.models, setup.value("model")]))
        self._model.offer(names, names.index(setup.value("model")))
        for step, box in self._steps.items():
            box.show_checked(setup.value(step))
        self._model.setEnabled(setup.value("denoise"))
        self._format.setEnabled(setup.value("export"))
        self._out.setText(str(setup.out or "–"))
        self._workers.show_value(setup.workers)
        self._show_estimate()

    def showEvent(self, event: QShowEvent) -> None:
        """Follow what the open recording offers by now."""
        super().showEvent(event)
        self.refresh()

    def _show_estimate(self) -> None:
        batch = self._batch
        why_not = batch.why_not_start
        made = None if why_not else batch.estimate
        self._total.setVisible(made is not None)
        self._total.setText("" if made is None else estimate_headline(made))
        self._facts.show_facts(() if made is None else estimate_facts(made)[:_MAX_FACTS])
        text = why_not if made is None else unusable_text(made)
        bad = made is not None or batch.refused
        bad |= any(entry.problem for entry in self._setup.data)
        say(self._problem, text, "warning" if bad else "muted")
        self._problem.setVisible(bool(text))
        self._start.setEnabled(not why_not)
        self._save.setEnabled(not self._setup.problem)
        self._copy.setEnabled(not self._setup.problem)

    def _follow_selection(self) -> None:
        self._remove.setEnabled(bool(self._list.selectedItems()))

    def _drop(self) -> None:
        self._setup.remove(*self._list.chosen)


class _Paths(QListWidget):
    """Files and folders; Delete removes what is selected."""

    def __init__(self, drop: Callable[[], None], parent: QWidget) -> None:
        super().__init__(parent)
        self._drop = drop
        self._shown: list[tuple[Path, str]] = []
        self.setAccessibleName("Recordings to work on")
        self.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.setTextElideMode(Qt.TextElideMode.ElideMiddle)

    @property
    def chosen(self) -> list[Path]:
        """Selected entries."""
        return [self._shown[self.row(item)][0] for item in self.selectedItems()]

    def show_entries(self, entries: list[tuple[Path, str]]) -> None:
        """Show paths, each with a remark."""
        if entries == self._shown:
            return
        self._shown = entries
        self.clear()
        for path, words in entries:
            item = QListWidgetItem(f"{path.name} · {words}" if words else path.name)
            item.setToolTip(f"{path}\n{words}".rstrip())
            self.addItem(item)

    def sizeHint(self) -> QSize:
        """Size of a few lines."""
        return QSize(400, 96)

    def minimumSizeHint(self) -> QSize:
        """Size of two lines."""
        return QSize(200, 52)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Remove the selected entries with Delete."""
        if event.key() in (Qt.Key.Key_Delete, Qt.Key.Key_Backspace):
            self._drop()
        else:
            super().keyPressEvent(event)
