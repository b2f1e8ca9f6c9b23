"""The runs on disk: those under way, and those that have ended."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import LatestRunner
from sd2app.training.text import model_name, state_text
from sd2app.widgets.text import clock_text
from sd2core.errors import Sd2Error
from sd2core.runs.folder import LIVE
from sd2core.train.folder import RunStatus, TrainingFolder, runs_in


@dataclass(frozen=True)
class KnownRun:
    """A run found in the folder."""

    path: Path
    status: RunStatus

    @property
    def live(self) -> bool:
        """True while a process works on it."""
        return self.status.state in LIVE

    @property
    def title(self) -> str:
        """Title in a list."""
        status = self.status
        when = clock_text(status.started_unix_s)
        return f"{when} · {model_name(status.model)} · {state_text(status.state)}"


def user_runs_folder() -> Path:
    """Default folder of runs."""
    import platformdirs

    return Path(platformdirs.user_data_dir("sd2-studio", appauthor=False)) / "runs"


class TrainingLibrary(QObject):
    """Looks through a folder in the background; the newest run comes first."""

    changed = Signal()  # other runs, or another state of one
    refreshed = Signal()  # the folder has been read again

    def __init__(self, folder: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._folder = folder
        self._runs: tuple[KnownRun, ...] = ()
        self._cache: dict[Path, tuple[object, KnownRun]] = {}
        self._runner = LatestRunner("runs", self)
        self._runner.finished.connect(self._take)
        # The disk may be away for a moment; it is looked at again.
        self._runner.failed.connect(lambda error: self.refreshed.emit())

    @property
    def folder(self) -> Path:
        """Folder that is searched for runs."""
        return self._folder

    @property
    def runs(self) -> tuple[KnownRun, ...]:
        """Runs that were found, the newest first."""
        return self._runs

    @property
    def live(self) -> KnownRun | None:
        """The newest run under way."""
        return next((run for run in self._runs if run.live), None)

    def refresh(self) -> None:
        """Read the folder again."""
        folder = self._folder
        self._runner.submit(lambda emit: self._list(folder))

    def close(self) -> None:
        """Stop reading."""
        self._runner.close()

    def _list(self, folder: Path) -> tuple[KnownRun, ...]:
        try:
            folders = runs_in(folder)
        except Sd2Error:
            return ()  # there has been no run yet
        found = [known for run in folders if (known := self._known(run)) is not None]
        return tuple(sorted(found, key=lambda run: run.status.started_unix_s, reverse=True))

    def _known(self, run: TrainingFolder) -> KnownRun | None:
        try:
            stamps = [
                path.stat().st_mtime_ns if path.exists() else 0
                for path in (run.progress, run.path / "run.json", run.best)
            ]
            # Without this every look would read all that every run has ever told.
            live = run.live
            key = (stamps, live)
            kept = self._cache.get(run.path)
            if kept is not None and kept[0] == key:
                return kept[1]
            known = KnownRun(run.path, run.status())
        except (Sd2Error, OSError):
            return None
        # Otherwise it ended, or began, between two looks.
        if known.live == live:
            self._cache[run.path] = (key, known)
        return known

    def _take(self, runs: tuple[KnownRun, ...]) -> None:
        if runs != self._runs:
            self._runs = runs
            self.changed.emit()
        self.refreshed.emit()
