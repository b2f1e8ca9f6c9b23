"""Studies, in processes that outlive the window."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject

from sd2app.background.run_monitor import CommandRun
from sd2app.background.runs import Runs, free_folder
from sd2app.classify.run import ClassSetup
from sd2app.settings import Settings, StoredChoices
from sd2app.training.run import StepHistory
from sd2core.classify.files import user_classifiers_folder
from sd2core.errors import Sd2Error
from sd2core.files.texts import read_json
from sd2core.runs.command_folder import COMMAND_IN_FOLDER

RESULT_NAME = "study.json"
TABLE_NAME = "study"
SWITCHES = ("quick", "radar_only", "same_people")
"""Options of ``sd2 classify table`` that are on or off."""


class StudyHistory(StepHistory):
    """Trainings that are done, of all."""

    def _take_run(self, event: dict[str, Any]) -> None:
        self.total, self.begun = int(event["total"]), True
        self._advance(int(event["done"]), float(event["elapsed_s"]))


class StudyRun(CommandRun):
    """A study under way, or one that has ended."""

    histories = StudyHistory
    history: StudyHistory
    result_name = RESULT_NAME

    @cached_property
    def _conclusion(self) -> str:
        # Read once: the page asks at every step, and the file may have megabytes.
        try:
            return str(read_json(self.out / RESULT_NAME)["conclusion"])
        except (Sd2Error, KeyError, TypeError):
            return ""

    @property
    def conclusion(self) -> str:
        """Sentence of its page; empty without one."""
        return "" if self.result is None else self._conclusion


class StudyRuns(Runs[StudyRun]):
    """Studies, one under way at a time: of the labelled data of a set-up, or of a plan."""

    monitor, remembered = StudyRun, "study/run"

    def __init__(
        self,
        settings: Settings,
        data: ClassSetup,
        parent: QObject,
        folder: Path | None = None,
        command: Sequence[str] = COMMAND_IN_FOLDER,
    ) -> None:
        folder = (folder or user_classifiers_folder()) / "studies"
        super().__init__(settings, folder, parent, command)
        self.data = data
        defaults = {name: "yes" if name == "quick" else "no" for name in SWITCHES}
        self._switches = StoredChoices(
            settings, "study", defaults, dict.fromkeys(SWITCHES, ("yes", "no"))
        )
        data.changed.connect(self.changed)

    @property
    def why_not(self) -> str:
        """Reason why the labelled data cannot be studied; empty when they can."""
        return self.busy or self.data.problem

    def is_on(self, switch: str) -> bool:
        """True if one of :data:`SWITCHES` is on."""
        return bool(self._switches[switch] == "yes")

    def turn(self, switch: str, on: bool) -> None:
        """Turn a switch on or off."""
        self._switches.set(switch, "yes" if on else "no")
        self.changed.emit()

    def arguments(self, out: Path) -> list[str]:
        """Arguments of ``sd2 classify table`` for what is set up."""
        return self.data.table(out, **{name: self.is_on(name) for name in SWITCHES})

    def begin(self) -> None:
        """Study the labelled data; Sd2Error if it cannot start, OSError without a folder."""
        if self.why_not:
            raise Sd2Error(self.why_not)
        path = free_folder(self._folder, "study", [one.path for one in self.data.data])
        out = path / TABLE_NAME
        self._start(path, [*self.arguments(out), "--progress-json"], out)

    def begin_plan(self, plan: Path) -> None:
        """Run a plan, or go on with it; raises as :meth:`begin`, also if the plan is wrong."""
        from sd2core.study.plan import read_study

        out = Path(read_study(plan).out)
        path = free_folder(self._folder, plan.stem, [plan])
        self._start(path, ["study", str(plan.absolute()), "--progress-json"], out)

    def again(self) -> None:
        """Go on with the study in view, which was stopped: what it has trained is kept."""
        run = self.run
        if run is not None and not run.under_way:
            self._start(run.path, [str(word) for word in run.about.get("arguments", ())], run.out)

    def _start(self, path: Path, arguments: list[str], out: Path) -> None:
        self.start_command(path, arguments, what="study", out=str(out))
