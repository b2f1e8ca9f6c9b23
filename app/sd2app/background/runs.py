"""Runs of one kind: set up, listed, taken up, followed one at a time, steered and deleted."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Generic, NamedTuple, TypeVar

from PySide6.QtCore import QObject, QTimer, Signal

from sd2app.background.latest import BackgroundModel, ClosingModel, LatestRunner
from sd2app.background.run_monitor import RunMonitor
from sd2app.settings import Settings, StoredChoices
from sd2core.errors import Sd2Error
from sd2core.files.paths import plain_path
from sd2core.processes import ONE_THREAD, ProcessId
from sd2core.runs.command_folder import COMMAND_IN_FOLDER, CommandFolder
from sd2core.runs.control import Command
from sd2core.runs.folder import LIVE, State


@dataclass(frozen=True)
class Source:
    """Something that a run works on."""

    path: Path
    problem: str = field(default="", kw_only=True)  # why it cannot be used


D = TypeVar("D", bound=Source)


class RunSetup(BackgroundModel, Generic[D]):
    """Choices for a run and the data that it works on, kept from one start to the next.

    The paths of the data are kept in the settings under ``stored``.
    """

    kind: ClassVar[type[Any]]
    """Class of the data, made of its path alone until it has been looked into."""

    changed = Signal()

    def __init__(
        self,
        settings: Settings,
        values: StoredChoices,
        stored: str,
        data: Sequence[D],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._settings, self._values, self._stored = settings, values, stored
        self.data = tuple(data)  # to work on
        self._runner = LatestRunner("data of a run", self, self._take)
        self.refresh()

    def look_into(self, source: D) -> D:
        """Read the content of data from disk, in the background."""
        raise NotImplementedError

    def data_problem(self, nothing: str) -> str:
        """Reason why the data cannot be worked on, ``nothing`` without any; empty if it can."""
        return next((one.problem for one in self.data if one.problem), "" if self.data else nothing)

    def value(self, name: str) -> Any:
        """One of the settings."""
        return self._values[name]

    def set_value(self, name: str, value: Any) -> None:
        """Choose a setting; KeyError if there is no such setting."""
        if self._values.set(name, value):
            self.changed.emit()

    def add(self, *paths: Path) -> None:
        """Add data; a file inside of a recording or of a Zarr group stands for that."""
        plain = [plain_path(path) for path in paths]
        meant = [
            one.parent if one.name in ("zarr.json", "recording.json") else one for one in plain
        ]
        known = {one.path for one in self.data}
        new = [path for path in dict.fromkeys(meant) if path not in known]
        if new:
            self.keep((*self.data, *map(self.kind, new)))

    def remove(self, *paths: Path) -> None:
        """Remove data."""
        self.keep(tuple(one for one in self.data if one.path not in paths))

    def keep(self, data: tuple[D, ...]) -> None:
        """Work on this data, and remember it."""
        self._runner.cancel()
        self.data = data
        self._settings.set_paths(self._stored, [one.path for one in data])
        self.refresh()
        self.changed.emit()

    def refresh(self) -> None:
        """Read the data again: a campaign grows while it is being made."""
        chosen = self.data
        if chosen:
            self._runner.submit(lambda emit: tuple(map(self.look_into, chosen)))

    def _take(self, data: tuple[D, ...]) -> None:
        self.data = data
        self.changed.emit()


_LIST_MS = 3000

Run = TypeVar("Run", bound=RunMonitor[Any])


class KnownRun(NamedTuple):
    """A run on disk."""

    path: Path
    name: str
    started_unix_s: float
    state: State

    @property
    def live(self) -> bool:
        """True while a process works on it."""
        return self.state in LIVE


class Runs(ClosingModel, Generic[Run]):
    """A run in view, or a new one that is being set up, and the others in a list.

    They are in a ``folder``; ``command`` is the program that runs ``sd2`` commands. A process under
    way goes on when it is closed. Subclasses say what follows a run.
    """

    monitor: ClassVar[type[RunMonitor[Any]]]
    remembered: ClassVar[str]
    """Setting that names the run in view."""
    shown_by: ClassVar[str] = "The Train panel"
    environment: ClassVar[Mapping[str, str]] = ONE_THREAD
    """Of commands: what moves on the screen comes first, where they get by with one processor."""
    setup: Any = None
    """Set-up of a new one, a :class:`RunSetup`, whose data is read again when they are shown."""

    changed = Signal()
    ended = Signal(object)  # the run in view came to its end
    noted = Signal(str)
    failed = Signal(str)

    def __init__(
        self,
        settings: Settings,
        folder: Path,
        parent: QObject | None = None,
        command: Sequence[str] = COMMAND_IN_FOLDER,
    ) -> None:
        super().__init__(parent)
        self._settings, self._folder, self._command = settings, folder, tuple(command)
        self.run: Run | None = None  # in view; none while a new one is being set up
        self.under_way = False  # true while the run in view has a process
        self.known: tuple[KnownRun, ...] = ()  # on disk, the newest first
        self._taking_up = self._watched = False
        self._lister = LatestRunner("runs", self, self._list)
        self._timer = QTimer(self, interval=_LIST_MS)
        self._timer.timeout.connect(self.refresh)

    # --- what subclasses say ----------------------------------------------------------------

    def candidates(self) -> Iterable[Path]:
        """Folders that may be those of runs; asked in the background."""
        return self._folder.iterdir() if self._folder.is_dir() else ()

    def find(self) -> list[KnownRun]:
        """Look for runs on disk, in the background; the newest first."""
        known = []
        for path in self.candidates():
            folder = self.monitor.folders(path)
            try:
                state, about = folder.state_and_about()
                started_unix_s = float(about.get("started_unix_s", 0.0))
            except (Sd2Error, OSError, TypeError, ValueError):
                if not folder.exists:
                    continue  # none, or deleted meanwhile
                state, about, started_unix_s = "died", {}, 0.0  # damaged: it can be deleted
            known.append(KnownRun(path, self.name_of(path, about), started_unix_s, state))
        return sorted(known, key=lambda one: one.started_unix_s, reverse=True)

    def name_of(self, path: Path, about: Mapping[str, Any]) -> str:
        """Name of a run in the list, by its folder and the description there."""
        return path.name

    # --- what is known ----------------------------------------------------------------------

    @property
    def live(self) -> KnownRun | None:
        """The newest run on disk that is under way, apart from the one in view."""
        here = None if self.run is None else self.run.path
        return next((one for one in self.known if one.live and one.path != here), None)

    @property
    def busy(self) -> str:
        """Reason why no other run can be started; empty when one can."""
        other = self.run if self.under_way else self.live
        return f"{other.path.name} is under way. Wait for it, or stop it." if other else ""

    @property
    def mark(self) -> str:
        """Share of the run in view that is done, as text; empty when none is under way."""
        if self.run is None or not self.under_way:
            return ""
        if self.run.phase == "paused":
            return "paused"
        return "…" if self.share is None else f"{100 * self.share:.0f} %"

    @property
    def share(self) -> float | None:
        """Share of the run in view that is done; None while that is not known."""
        return None if self.run is None else self.run.history.share

    # --- one run after another --------------------------------------------------------------

    def set_watched(self, watched: bool) -> None:
        """Note that the runs are visible or hidden."""
        self._watched = watched
        if watched:
            self.refresh()
            if self.setup is not None:
                self.setup.refresh()

    def look_for_runs(self) -> None:
        """At the start of the program: find what is under way, or what was in view last."""
        self._taking_up = True
        self.refresh()
        self._timer.start()

    def refresh(self) -> None:
        """Look for runs on disk again."""
        self._lister.submit(lambda emit: tuple(self.find()))

    def select(self, path: Path | None) -> None:
        """Show a run; None is a new one, to be set up."""
        if path is None:
            self.follow(None)
        elif self.run is None or self.run.path != path:
            self.follow(self.monitor(path, self))  # type: ignore[arg-type]

    def open_run(self, path: Path) -> None:
        """Show a run of another folder, such as a terminal's; Sd2Error if there is none."""
        self.monitor.folders(path).about()
        self.select(path)

    def start_command(self, path: Path, words: Sequence[str], **about: Any) -> None:
        """Start an ``sd2`` command in a folder, and show it.

        Raises Sd2Error if another is under way or it cannot be started, OSError if the folder
        cannot be made.
        """
        if self.busy:
            raise Sd2Error(self.busy)
        folder = CommandFolder(path)
        is_new = not folder.exists
        try:
            process = folder.start(words, about, self._command, self.environment)
        except (Sd2Error, OSError):
            if is_new:
                folder.discard()
            raise
        self.follow_new(path, process)

    def follow_new(self, path: Path, process: ProcessId) -> None:
        """Show a run whose process was just started."""
        run = self.monitor(path, self, process=process)
        self.follow(run, under_way=True)  # type: ignore[arg-type]
        self.refresh()

    def tell(self, word: Command) -> None:
        """Give the run in view an order."""
        run = self.run
        if run is not None:
            self._attempt(lambda: run.tell(word))

    def delete(self) -> None:
        """Delete the run in view, which has ended, with what it made."""
        run = self.run
        if run is not None and not run.under_way:
            self._attempt(run.delete)
            self.select(None)
            self.refresh()

    # --- following --------------------------------------------------------------------------

    def follow(self, run: Run | None, under_way: bool = False) -> None:
        """Show a run that is being followed; None is a new one, to be set up."""
        if self.run is not None:
            self.run.close()
            self.run.deleteLater()
        self.run, self.under_way = run, under_way
        self._settings.set_value(self.remembered, "" if run is None else str(run.path))
        if run is not None:
            run.changed.connect(self.changed)
            run.phase_changed.connect(self._notice)
        self.changed.emit()

    def _notice(self) -> None:
        """Follow another phase of the run in view."""
        run = self.run
        if run is None:
            return
        self.refresh()
        if run.phase == "gone":
            self.select(None)
            return
        ended = self.under_way and not run.under_way
        self.under_way = run.under_way and (run.loaded or self.under_way)
        if ended:
            self.ended.emit(run)
            if not self._watched:
                self.say_ended(run)

    def say_ended(self, run: Run) -> None:
        """Tell the user how a run ended that nobody watched."""
        name, there = run.path.name, self.shown_by
        if run.phase == "finished":
            self.noted.emit(f"{name} is done. {there} shows what came of it.")
        elif run.phase in ("failed", "died"):
            self.failed.emit(f"{name} did not come to its end. {there} says more.")

    def _list(self, known: tuple[KnownRun, ...]) -> None:
        if known != self.known:
            self.known = known
            self.changed.emit()
        if self._taking_up:
            self._taking_up = False
            self._take_up()

    def _take_up(self) -> None:
        live = self.live
        if live is not None:
            self.select(live.path)
            self.say_found(live.path.name)
            return
        last = self._settings.stored(self.remembered, "")
        if last and Path(last).is_dir():  # its disk may be away
            self.select(Path(last))

    def say_found(self, name: str) -> None:
        """Tell the user of a run that is under way when the program starts."""
        self.noted.emit(f"{name} is under way. {self.shown_by} shows it.")

    def _attempt(self, work: Callable[[], None]) -> None:
        try:
            work()
        except (OSError, Sd2Error) as error:
            self.failed.emit(str(error))


def free_folder(place: Path, what: str, data: Sequence[Path]) -> Path:
    """Name of a new run in a folder: its kind, its data and the time."""
    names = "+".join(path.stem for path in data)[:40]
    name = f"{what} {names} {time.strftime('%Y-%m-%d %H.%M')}"
    path, number = place / name, 2
    while path.exists() or path.with_name(f".{path.name}.out").exists():
        path, number = place / f"{name} {number}", number + 1
    return path
