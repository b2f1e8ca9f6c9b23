"""Base of the pages on which a training is set up: data, settings, estimate, start."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QMenu, QSizePolicy, QWidget

from sd2app.background.run_setup import RunSetup
from sd2app.feature import Shell
from sd2app.widgets.inputs import Choice, NumberBox, option_box
from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import (
    ElidedLabel,
    copy_button,
    outlined,
    sentence,
    show_words,
    side_by_side,
    title,
)
from sd2app.widgets.text import about
from sd2core.options.records import OptionRecord, option_named


class Field(NamedTuple):
    """Setting that is a number, an option of a record that says its bounds and what it is."""

    record: type[OptionRecord]
    name: str
    text: str
    step: float
    decimals: int = 0
    suffix: str = ""


class TrainingForm(QWidget):
    """Page over a :class:`RunSetup`; subclasses put its parts together."""

    def __init__(self, setup: RunSetup[Any], shell: Shell) -> None:
        super().__init__()
        self._setup, self._shell = setup, shell
        self._shown_data: Sequence[Any] | None = None
        self._numbers: dict[str, NumberBox] = {}
        self._choices: dict[str, Choice] = {}
        self.column = column_of(spacing_px=6, margins_px=0)
        self.setLayout(self.column)

    def add_data(self, heading: str, add: str, tip: str, nothing: str) -> QMenu:
        """Add the list of data and who is learnt from; returns the menu for more."""
        menu = QMenu(self)
        menu.setToolTipsVisible(True)
        button = outlined(add, tip, menu, self)
        self.nothing, self._division = sentence(nothing), sentence("")
        self._rows = column_of(spacing_px=6)
        self.column.addLayout(row_of(title(heading), STRETCH, button))
        self.column.addWidget(self.nothing)
        self.column.addLayout(self._rows)
        self.column.addWidget(self._division)
        return menu

    def number(self, field: Field) -> tuple[QLabel, NumberBox]:
        """Make the box of a setting, and its name."""
        box = option_box(
            field.record, field.name, field.suffix, decimals=field.decimals, step=field.step
        )
        box.setMinimumWidth(64)
        box.setGroupSeparatorShown(field.decimals == 0 and field.name != "seed")
        box.valueChanged.connect(partial(self._setup.set_value, field.name))
        self._numbers[field.name] = box
        label = QLabel(field.text)
        label.setToolTip(option_named(field.record, field.name).sentence)
        return label, box

    def choice(self, name: str, tip: str, words: Mapping[str, str]) -> Choice:
        """Make the list of a setting; ``words`` are the texts of its values."""
        choice = Choice(tip, self, words, partial(self._setup.set_value, name))
        choice.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self._choices[name] = choice
        return choice

    def add_start(self, start: Callable[[], None], command: Callable[[], str]) -> None:
        """Add the estimate, why it cannot start, and the buttons to start it or to copy it."""
        self._time = title("", "How long it will take")
        self._basis = sentence("")
        self._problem = sentence("", "warning")
        for label in (self._time, self._basis, self._problem):
            self.column.addWidget(label)
        attempt, tip = self._shell.attempt, "Train in a background process"
        self._start = outlined("Start training", tip, partial(attempt, start), self, look="primary")
        self._copy = copy_button(command, self)
        self.column.addLayout(side_by_side(self._start, self._copy, spacing_px=6))

    def below_row(self, one: Any) -> QWidget | None:
        """Make what stands below the row of some data."""
        return None

    def show_setup(self, division: str) -> None:
        """Show data and settings; ``division`` says who is learnt from, or nothing."""
        if self._setup.data != self._shown_data:
            self._list_data()
        self.nothing.setVisible(not self._setup.data)
        show_words(self._division, division)
        for name, choice in self._choices.items():
            choice.show_value(self._setup.value(name))
        for name, box in self._numbers.items():
            box.show_value(self._setup.value(name))

    def show_estimate(self, count: str, steps: int, step_s: float | None) -> None:
        """Show the time of so many steps, if there are any; ``count`` ends with their number."""
        self._time.setVisible(steps > 0)
        self._basis.setVisible(steps > 0)
        if step_s is None:
            self._time.setText("Time: not known yet")
            self._basis.setText(f"{count}. The first ones tell how long it takes.")
        else:
            self._time.setText(f"Takes {about(steps * step_s)}")
            self._basis.setText(f"{count} of about {step_text(step_s)}, as measured here before.")

    def show_start(self, why_not: str, can_copy: bool) -> None:
        """Show whether a training can be started."""
        data = self._setup.data
        # What is wrong with the data, or that there is none, is said above.
        explained = not data or any(one.problem for one in data)
        show_words(self._problem, "" if explained else why_not)
        self._start.setEnabled(not why_not)
        self._start.setToolTip(why_not or "Train in a background process")
        self._copy.setEnabled(can_copy)

    def _list_data(self) -> None:
        self._shown_data = self._setup.data
        while (item := self._rows.takeAt(0)) is not None:
            if (widget := item.widget()) is not None:
                widget.hide()
                widget.deleteLater()
        for one in self._setup.data:
            row = self._row(one)
            self._rows.addWidget(row)
            row.show()

    def _row(self, one: Any) -> QWidget:
        """Row of data: its name, its facts, and a button to remove it."""
        row = QWidget(self)
        heading = ElidedLabel(row)
        heading.setText(one.path.name)
        heading.setToolTip(str(one.path))
        facts = sentence(one.problem or one.text, "warning" if one.problem else "muted")
        tip, remove = f"Do not learn from {one.path.name}", partial(self._setup.remove, one.path)
        button = outlined("✕", tip, remove, row, name=tip, look="")
        below = self.below_row(one)
        words = column_of(*filter(None, (heading, facts, below)), spacing_px=0)
        whole = row_of((words, 1), button, spacing_px=0, margins_px=0)
        whole.setAlignment(button, Qt.AlignmentFlag.AlignTop)
        row.setLayout(whole)
        return row


def step_text(seconds: float) -> str:
    """Time of a step."""
    if seconds >= 0.95:
        return f"{seconds:.1f} s"
    return f"{float(f'{1000 * seconds:.2g}'):g} ms"
