"""Studies in the window: begun, followed, and shown."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from PySide6.QtWidgets import QWidget

from sd2app.classify.run import ClassSetup
from sd2app.feature import Action, Feature, Shell, report
from sd2app.session.session import Session
from sd2app.study.runs import SWITCHES, TABLE_NAME, StudyRun, StudyRuns
from sd2app.widgets.dialogs import ask_file
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
from sd2app.widgets.run_panel import Button, RunPanel, RunView, RunWords
from sd2app.widgets.run_text import PHASES
from sd2app.widgets.text import counted, quoted
from sd2core.runs.command_folder import COMMAND_IN_FOLDER

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
    """Set-up of a study, and its start."""

    def __init__(self, feature: StudyFeature) -> None:
        super().__init__()
        self._runs = runs = feature.runs
        attempt = feature.shell.attempt
        self._data, self._problem = sentence(""), sentence("", "warning")
        self._switches = {
            name: CheckBox(text, self, partial(runs.turn, name), tip)
            for name, (text, tip) in _TEXTS.items()
        }
        self._start = outlined("Start", "", partial(attempt, runs.begin), self, look="primary")
        self._copy = copy_button(lambda: quoted(runs.arguments(Path(TABLE_NAME))), self)
        tip = "Run a STUDY.toml, or go on with it: folds, shares, denoisers, speeds, more video"
        plan = outlined("Run a plan…", tip, feature.open_plan, self)
        tip = "Show a study.json, or a matrix of sd2 classify eval"
        show = outlined("Open a result…", tip, feature.open_result, self)
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

    def __init__(self, feature: StudyFeature) -> None:
        runs, shell = feature.runs, feature.shell
        tip = "Gains, learning curve and confusion matrices"
        buttons = (
            Button(
                "show", "Show result", tip, feature.show_result, lambda run: run.result,
                primary=True,
            ),
            Button(
                "again", "Resume", "Train what is missing", partial(shell.attempt, runs.again),
                lambda run: not run.under_way and run.phase != "finished",
            ),
        )  # fmt: skip
        stop_tip = "End it now; what it has trained is kept"
        words = RunWords(_headline, _note, what="study", stop_tip=stop_tip)
        super().__init__(runs, shell, words, buttons)
        self._conclusion, self._about = sentence("", "plain"), sentence("")
        self.add(self._conclusion, self._about)

    def show_made(self, run: StudyRun) -> None:
        """Show the conclusion."""
        show_words(self._conclusion, run.conclusion)
        self._about.setText(str(run.out))


def _headline(run: StudyRun) -> str:
    if run.phase != "running":
        return PHASES[run.phase]
    total = run.history.total
    return f"Studying: training {min(run.history.done + 1, total)} of {total}"


def _note(run: StudyRun) -> str:
    stopped = run.phase == "stopped"
    return "What it has trained is kept: Resume trains what is missing." if stopped else ""


_RESULTS, _PLANS = "Results (*.json)", "Plans of studies (*.toml)"


class StudyFeature(Feature):
    """Runs of studies, on the labelled data of the classifiers or by plans."""

    def __init__(
        self, session: Session, shell: Shell, data: ClassSetup, command: Sequence[str] | None
    ) -> None:
        self._session, self.shell = session, shell
        self.runs = StudyRuns(
            session.settings, data, session.parent, command=command or COMMAND_IN_FOLDER
        )
        report(shell, self.runs)
        self.closing, self.running = (self.runs,), (self.runs,)  # runs go on

    def actions(self) -> Sequence[Action]:
        """The page."""
        return (
            Action(
                "study", "Model", "Study what helps…", (),
                "Find out whether synthetic data help a classifier on a radar",
                lambda: self.shell.bring_up("Train", "Study"),
            ),
        )  # fmt: skip

    def panel(self) -> QWidget:
        """Page of the Train panel."""
        setup, run = StudySetupView(self), StudyRunView(self)
        return RunPanel(self.runs, setup, run, "Studies: under way, or ended", new="New study")

    def open_plan(self) -> None:
        """Let the user choose a plan, and run it."""
        if path := ask_file(self.shell.dialog_parent, "Run a plan of a study", _PLANS):
            self.shell.attempt(lambda: self.runs.begin_plan(path))

    def open_result(self) -> None:
        """Let the user choose a result, and show it."""
        if path := ask_file(self.shell.dialog_parent, "Open a result", _RESULTS):
            self._show(path)

    def show_result(self) -> None:
        """Show what the study in view found."""
        run = self.runs.run
        if run is not None and run.result is not None:
            self._show(run.result)

    def _show(self, path: Path) -> None:
        # Imported here because a result needs what loads torch.
        from sd2app.study.result import read_result
        from sd2app.study.result_dialog import ClassResultDialog

        display, parent = self._session.display, self.shell.dialog_parent
        self.shell.attempt(lambda: ClassResultDialog(read_result(path), display, parent).show())
