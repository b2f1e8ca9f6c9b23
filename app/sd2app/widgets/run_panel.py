"""Runs of one kind: one under way or ended, or a form in which a new one is set up."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Generic, NamedTuple

from PySide6.QtCore import Qt
from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import QLabel, QLayout, QMenu, QSizePolicy, QWidget

from sd2app.background.run_monitor import UNDER_WAY
from sd2app.background.runs import Run, Runs, RunSetup
from sd2app.feature import Shell
from sd2app.widgets.dialogs import may_delete
from sd2app.widgets.inputs import Choice, NumberBox, option_box
from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import (
    ElidedLabel,
    ProgressBar,
    copy_button,
    outlined,
    sentence,
    show_words,
    side_by_side,
    title,
)
from sd2app.widgets.run_text import time_text, title_of
from sd2app.widgets.text import about
from sd2core.options.records import OptionRecord, option_named


class RunPanel(QWidget):
    """The list of runs on top; below it the run in view, or the setup of a new one.

    ``tip`` describes the list, ``new`` what is set up. ``open_other``, a text and a function, lets
    the user choose a run of another folder. ``guide`` is a help button beside the list, of a panel
    that fills a window: what is below takes all room then.
    """

    def __init__(
        self,
        runs: Runs[Any],
        setup: QWidget,
        run: QWidget,
        tip: str,
        open_other: tuple[str, Callable[[], object]] | None = None,
        new: str = "New training",
        guide: QWidget | None = None,
    ) -> None:
        super().__init__()
        self.setObjectName("page")
        self._runs, self._setup, self._run = runs, setup, run
        self._tip, self._open, self._what = tip, open_other, new
        self._list = Choice(tip, self)
        self._list.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self._list.activated.connect(self._choose)
        self._new = outlined("New", "Set up another one", lambda: runs.select(None), self)
        beside = () if guide is None else (guide,)
        head = row_of((self._list, 1), self._new, *beside, spacing_px=6)
        below = (setup, run, STRETCH) if guide is None else ((setup, 1), (run, 1))
        self.setLayout(column_of(head, *below, spacing_px=8, margins_px=(8, 4, 8, 6)))
        runs.changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        here = self._runs.run.path if self._runs.run is not None else None
        self._setup.setVisible(here is None)
        self._run.setVisible(here is not None)
        self._new.setVisible(here is not None)
        known = {one.path: title_of(one) for one in self._runs.known}
        begun = {} if here is None or here in known else {here: here.name}  # just so
        titles = {None: self._what} | begun | known
        other = () if self._open is None else (self._open[0],)
        self._paths = list(titles)
        self._list.setToolTip(str(here) if here is not None else self._tip)
        self._list.offer([*titles.values(), *other], self._paths.index(here))

    def _choose(self, at: int) -> None:
        if at < len(self._paths):
            self._runs.select(self._paths[at])
        elif self._open is not None:
            self._open[1]()
            self._refresh()

    def showEvent(self, event: QShowEvent) -> None:
        """Read the runs again, and follow them while the panel is shown."""
        super().showEvent(event)
        self._runs.set_watched(True)

    def hideEvent(self, event: QHideEvent) -> None:
        """Note that the panel is hidden."""
        super().hideEvent(event)
        self._runs.set_watched(False)


class Button(NamedTuple):
    """Action on a run, which is shown while it is ``useful`` to the run in view."""

    name: str
    text: str
    tip: str
    run: Callable[[], object]
    useful: Callable[[Any], object]
    primary: bool = False


class RunWords(NamedTuple):
    """How runs of one kind are spoken of."""

    headline: Callable[[Any], str]  # where a run stands, in a few words
    note: Callable[[Any], str]  # advice for one that has ended; empty without any
    time: Callable[[Any], str] = time_text
    what: str = "training"
    stop_tip: str = "End it now and keep the best so far"
    is_deleted: bool = True  # results that are the user's to delete are not


class RunView(QWidget, Generic[Run]):
    """Progress and actions of the run in view, and why it ended; subclasses add what it made."""

    def __init__(
        self, runs: Runs[Run], shell: Shell, words: RunWords, buttons: Sequence[Button]
    ) -> None:
        super().__init__()
        self._runs, self._shell, self._words = runs, shell, words
        stop = partial(runs.tell, "stop")
        buttons = (
            *buttons,
            Button("stop", "Stop", words.stop_tip, stop, lambda run: run.under_way),
            Button(
                "delete", "Delete…", "Delete this run with what it made", self._delete,
                lambda run: words.is_deleted,
            ),
        )  # fmt: skip
        self._headline = title("", f"How the {words.what} stands")
        self._bar = ProgressBar(f"Progress of the {words.what}")
        self._time, self._reason = sentence(""), sentence("", "warning")
        self._note = sentence("")
        self._useful = {one.name: one.useful for one in buttons}
        self._buttons = {
            one.name: outlined(
                one.text, one.tip, one.run, self, look="primary" if one.primary else "outlined"
            )
            for one in buttons
        }
        *harmless, delete = self._buttons.values()
        # At the top, where no text above moves them; the one that deletes stands below, so that it
        # never comes to where another one was.
        top = row_of(*harmless, STRETCH, spacing_px=6)
        below = row_of(delete, STRETCH, spacing_px=6)
        progress = self._headline, self._bar, self._time
        parts = top, *progress, below, self._reason, self._note
        self.column = column_of(*parts, spacing_px=6, margins_px=0)
        self.setLayout(self.column)
        runs.changed.connect(self.refresh)

    def add(self, *parts: QWidget | QLayout | tuple[QWidget, int]) -> None:
        """Put what shows what the run has told and made below."""
        for part in parts:
            if isinstance(part, QLayout):
                self.column.addLayout(part)
            else:
                self.column.addWidget(*part if isinstance(part, tuple) else (part,))
        self.refresh()

    def show_made(self, run: Run) -> None:
        """Follow what the run has told and made."""
        raise NotImplementedError

    def _delete(self) -> None:
        run = self._runs.run
        if run is None:
            return
        if under_way := run.phase in UNDER_WAY:
            reached = ", ".join(filter(None, (self._words.headline(run), self._words.time(run))))
            what = (
                f"{run.path.name} ends now, and all that it made is deleted ({reached})."
                " Stop ends it too, but keeps the best so far."
            )
        else:
            what = (
                f"{run.path.name} is deleted with what it made. A model that was put to use stays"
                " among your models."
            )
        if not may_delete(self._shell.dialog_parent, "Delete this run?", what):
            return
        # It may have ended while the question was open, which asked about something else then.
        if self._runs.run is run and (run.phase in UNDER_WAY) == under_way:
            if under_way:
                self._runs.tell("cancel")
            else:
                self._runs.delete()

    def refresh(self) -> None:
        """Follow the run in view."""
        run = self._runs.run
        if run is None:
            return
        self._headline.setText(self._words.headline(run))
        show_words(self._time, self._words.time(run))
        show_words(self._reason, run.text)
        show_words(self._note, self._words.note(run))
        self._bar.setVisible(run.phase in UNDER_WAY)
        self._bar.show_share(run.history.share)
        ending = run.phase in ("stopping", "cancelling")
        for name, button in self._buttons.items():
            button.setVisible(bool(self._useful[name](run)))
            if name == "delete":
                button.setEnabled(run.phase != "cancelling")
            elif name in ("pause", "go_on", "stop"):
                button.setEnabled(not ending and not run.history.saving)
        self.show_made(run)


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
