"""Page of studies: one to be set up, one under way, or what one found."""

from __future__ import annotations

from collections.abc import Callable, Collection
from functools import partial
from pathlib import Path

from PySide6.QtWidgets import QWidget

from sd2app.background.quoting import quoted
from sd2app.background.run_monitor import UNDER_WAY
from sd2app.feature import Shell
from sd2app.study.runs import SWITCHES, TABLE_NAME, StudyRun, StudyRuns
from sd2app.widgets.inputs import CheckBox
from sd2app.widgets.layouts import STRETCH, column_of
from sd2app.widgets.panel import (
    copy_button,
    outlined,
    rule,
    say,
    sentence,
    show_words,
    side_by_side,
    title,
)
from sd2app.widgets.run_panel import Button, RunView, RunWords
from sd2app.widgets.text import PHASES, counted

_ABOUT = (
    "Trains again and again on a radar's maps alone and with other maps added, and with less and"
    " less of the radar's; judged on people, or movements, that were not learnt from. Gains come"
    " with intervals."
)
_TEXTS = {
    "quick": ("Quick", "Two draws instead of five, and 10 and 100 % of the radar's data"),
    "radar_only": ("The radar alone", "Add nothing: compare networks, and amounts of data"),
    "same_people": (
        "The same people",
        "Judge other movements of the people who are learnt from, instead of other people",
    ),
}


class StudySetupView(QWidget):
    """What is studied, and how to begin."""

    def __init__(
        self, runs: StudyRuns, shell: Shell, open_plan: Callable[[], object],
        open_result: Callable[[], object],
    ) -> None:  # fmt: skip
        super().__init__()
        self._runs = runs
        self._data, self._problem = sentence(""), sentence("", "warning")
        self._switches = {
            name: CheckBox(text, self, partial(runs.turn, name), tip)
            for name, (text, tip) in _TEXTS.items()
        }
        self._start = outlined(
            "Start", "", partial(shell.attempt, runs.begin), self, look="primary"
        )
        self._copy = copy_button(
            lambda: quoted(runs.arguments(Path(TABLE_NAME))), self, attempt=shell.attempt
        )
        tip = "Run a STUDY.toml, or go on with it: folds, shares, denoisers, speeds, more video"
        plan = outlined("Run a plan…", tip, open_plan, self)
        tip = "Show a study.json, or a matrix of sd2 classify eval"
        show = outlined("Open a result…", tip, open_result, self)
        self.setLayout(
            column_of(
                title("Do synthetic data help?"), sentence(_ABOUT), self._data, self._problem,
                *self._switches.values(), side_by_side(self._start, self._copy, spacing_px=6),
                rule(), side_by_side(plan, show, spacing_px=6), STRETCH, spacing_px=8, margins_px=0,
            )
        )  # fmt: skip
        runs.changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        runs = self._runs
        count = len(runs.data.data)
        self._data.setText(
            f"Of the Classifier page's {counted(count, 'source')} of labelled data, with its"
            " network." if count else "Of the labelled data of the Classifier page."
        )  # fmt: skip
        say(self._problem, runs.why_not, "warning" if count else "muted")
        self._problem.setVisible(bool(runs.why_not))
        for name in SWITCHES:
            self._switches[name].show_checked(runs.is_on(name))
        self._start.setEnabled(not runs.why_not)
        self._start.setToolTip(runs.why_not or "Train and compare in the background")
        self._copy.setEnabled(not runs.data.problem)


class StudyRunView(RunView[StudyRun]):
    """Progress of a study, and what it found."""

    def __init__(self, runs: StudyRuns, shell: Shell, show_result: Callable[[], object]) -> None:
        tip = "Gains, learning curve and confusion matrices"
        buttons = (
            Button("show", "Show result", tip, show_result, primary=True),
            Button("again", "Resume", "Train what is missing", partial(shell.attempt, runs.again)),
        )
        stop_tip = "End it now; what it has trained is kept"
        words = RunWords(_headline, _note, what="study", stop_tip=stop_tip)
        super().__init__(runs, shell, words, buttons)
        self._found, self._about = sentence("", "plain"), sentence("")
        for part in (self._found, self._about):
            self.column.addWidget(part)
        self.refresh()

    def shown(self, run: StudyRun) -> Collection[str]:
        """Names of the buttons that are of use now."""
        if run.phase in UNDER_WAY:
            return ("stop", "delete")
        useful = {"show": run.result is not None, "again": run.phase != "finished", "delete": True}
        return [name for name, is_useful in useful.items() if is_useful]

    def show_made(self, run: StudyRun) -> None:
        """Show the conclusion."""
        show_words(self._found, run.conclusion)
        self._about.setText(str(run.out))


def _headline(run: StudyRun) -> str:
    if run.phase != "running":
        return PHASES[run.phase]
    total = run.history.total
    return f"Studying: training {min(run.history.steps_done + 1, total)} of {total}"


def _note(run: StudyRun) -> str:
    stopped = run.phase == "stopped"
    return "What it has trained is kept: Resume trains what is missing." if stopped else ""
