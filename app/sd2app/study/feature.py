"""Studies in the window: begun, followed, and shown."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QWidget

from sd2app.classify.setup import ClassSetup
from sd2app.feature import Action, Feature, Shell, report
from sd2app.session.session import Session
from sd2app.study.page import StudyRunView, StudySetupView
from sd2app.study.runs import StudyRuns
from sd2app.widgets.dialogs import ask_file
from sd2app.widgets.run_panel import RunPanel
from sd2core.runs.command_folder import COMMAND_IN_FOLDER

_RESULTS, _PLANS = "Results (*.json)", "Plans of studies (*.toml)"


class StudyFeature(Feature):
    """Runs of studies, on the labelled data of the classifiers or by plans."""

    def __init__(
        self,
        session: Session,
        shell: Shell,
        data: ClassSetup,
        command: Sequence[str] | None,
        parent: QObject,
    ) -> None:
        self._session, self._shell = session, shell
        self.runs = StudyRuns(session.settings, data, parent, command=command or COMMAND_IN_FOLDER)
        report(shell, self.runs)
        self.closing, self.running = (self.runs,), (self.runs,)  # runs go on

    def actions(self) -> Sequence[Action]:
        """The page."""
        return (
            Action(
                "study", "Model", "Study what helps…", (),
                "Find out whether synthetic data help a classifier on a radar",
                lambda: self._shell.bring_up("Train", "Study"),
            ),
        )  # fmt: skip

    def panel(self) -> QWidget:
        """Page of the Train panel."""
        runs, shell = self.runs, self._shell
        setup = StudySetupView(runs, shell, self.open_plan, self.open_result)
        run = StudyRunView(runs, shell, self.show_result)
        return RunPanel(runs, setup, run, "Studies: under way, or ended", new="New study")

    def open_plan(self) -> None:
        """Let the user choose a plan, and run it."""
        if path := ask_file(self._shell.dialog_parent, "Run a plan of a study", _PLANS):
            self._shell.attempt(lambda: self.runs.begin_plan(path))

    def open_result(self) -> None:
        """Let the user choose a result, and show it."""
        if path := ask_file(self._shell.dialog_parent, "Open a result", _RESULTS):
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

        display, parent = self._session.display, self._shell.dialog_parent
        self._shell.attempt(lambda: ClassResultDialog(read_result(path), display, parent).show())
