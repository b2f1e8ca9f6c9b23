"""Runs of one kind: something new to be set up, or one that is under way or has ended."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Generic, NamedTuple

from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import QLayout, QSizePolicy, QWidget

from sd2app.background.run_monitor import UNDER_WAY
from sd2app.background.runs import Run, Runs
from sd2app.feature import Shell
from sd2app.widgets.dialogs import may_delete
from sd2app.widgets.inputs import Choice
from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import ProgressBar, outlined, sentence, show_words, title
from sd2app.widgets.run_text import time_text, title_of


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
