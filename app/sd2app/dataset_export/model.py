"""Data set to be exported: its choices, its forecast, and the process that writes it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from pydantic import TypeAdapter
from PySide6.QtCore import QObject

from sd2app.background.latest import Emit, LatestRunner
from sd2app.background.run_monitor import CommandRun, History
from sd2app.background.runs import Runs, free_folder
from sd2app.session.tasks import Job, TaskList
from sd2app.settings import Settings
from sd2app.widgets.text import about, counted, quoted
from sd2core.cli.export import Export, dataset_and_making
from sd2core.errors import Sd2Error
from sd2core.files.paths import user_data
from sd2core.imu.mounting import PLACES
from sd2core.maps import MapKind
from sd2core.options.records import words_of
from sd2core.recording.recording import is_recording, open_recording
from sd2core.runs.command_folder import COMMAND_IN_FOLDER
from sd2core.runs.pace import Kind, known_pace_s

if TYPE_CHECKING:
    # Imported where it is used: it takes long to load, and the window starts without.
    from sd2core.datasets.forecast import Counting, Forecast

MAPS: dict[str, tuple[MapKind, ...]] = {
    "synthetic": ("synthetic",),
    "denoised": ("denoised",),
    "radar": ("simulated", "real"),
}
"""Kinds of maps that are chosen together; a radar's map is simulated or real."""


class _Counted(NamedTuple):
    sources: tuple[object, ...]  # what decides which there are
    counting: Counting
    forecast: Forecast
    pace: Kind


@dataclass(frozen=True)
class Exported:
    """A finished data set, as the last line of ``sd2 export --progress-json`` describes it."""

    dataset: Path
    card: Path
    sheet: Path
    segments: int
    sources: int
    failed: tuple[str, ...]  # sources that could not be made, each with its reason


_CHOICE, _WRITTEN = TypeAdapter(Export), TypeAdapter(Exported)


class ExportHistory(History):
    """Steps of an export, none while the preview sheet is drawn, and the data set at its end."""

    written: Exported | None = None

    def _take_done(self, event: dict[str, Any]) -> None:
        self.written = _WRITTEN.validate_python(event)


class ExportRun(CommandRun):
    """An export; its folder is that of the command, not the data set."""

    histories = ExportHistory
    history: ExportHistory


class ExportModel(Runs[ExportRun]):
    """Counts while choices are made, and has one data set written at a time.

    ``command`` runs ``sd2`` commands in a folder; ``folder`` is where running exports are noted.
    ``failed`` also says what was left out.
    """

    monitor, remembered = ExportRun, "run"
    shown_by = "File → Export data set…"
    environment: ClassVar = {}  # it gives way to whatever else wants the processors

    def __init__(
        self,
        jobs: TaskList,
        parent: QObject,
        command: Sequence[str] = COMMAND_IN_FOLDER,
        folder: Path | None = None,
    ) -> None:
        # Its folder is deleted at the end of an export: there is no last one to remember.
        super().__init__(Settings.forgetful(), folder or user_data("exports"), parent, command)
        self._jobs = jobs
        self.choice = Export(inputs=(), out=Path("set.zarr"))  # under another name
        self.problem = ""  # why these choices cannot be exported
        self.places = 0  # planned besides the recordings' own sensors, the most of any
        self.imu_places: tuple[str, ...] = ()  # named ones that the recordings have sensors at
        self.result: Exported | None = None  # written last, until something else is chosen
        self._counted: _Counted | None = None
        self._runner = LatestRunner("count segments", self, self._receive, self._refuse)
        self._job: Job | None = None
        self._over: set[Path] = set()

    @property
    def place(self) -> Path | None:
        """A recording, or a folder of recordings; None: not chosen yet."""
        return next(iter(self.choice.inputs), None)

    @property
    def forecast(self) -> Forecast | None:
        """Forecast of the data set; None while it is counted, or where it cannot be."""
        return None if self._counted is None or self.counting else self._counted.forecast

    @property
    def time(self) -> str:
        """Time of the whole export before it starts, and what is left of it while it runs."""
        if self.run is not None:
            left_s = self.run.history.left_s
            return "" if left_s is None else f"{about(left_s)} left"
        counted = self._counted
        each_s = None if counted is None or self.counting else known_pace_s(counted.pace)
        if each_s is None or counted is None:
            return "the first view tells how long it takes"
        return about(each_s * counted.forecast.segments)

    @property
    def counting(self) -> bool:
        """True while the forecast is counted."""
        return self._runner.busy

    @property
    def ready(self) -> bool:
        """True if there is something to write and nothing is being written."""
        forecast = self.forecast
        return forecast is not None and forecast.segments > 0 and not self.under_way

    def begin(self, place: Path | None) -> None:
        """Choose a recording or a folder and read it again; other choices stay."""
        self._counted = None
        self._look_into(place)
        self.result = None
        self.choice = replace(
            self.choice,
            inputs=() if place is None else (place,),
            placements=self.choice.placements if self.places else None,
            imu=self.imu_places if self.choice.imu else (),
            subjects=None,
        )
        self._count()

    def choose(self, **changes: Any) -> None:
        """Choose something else: options of ``sd2 export``."""
        choice = replace(self.choice, **changes)
        if choice == self.choice:
            return
        same = replace(choice, out=self.choice.out) == self.choice
        self.choice, self.result = choice, None
        if same:  # the format changes no count
            self.changed.emit()
        else:
            self._count()

    @property
    def usual_out(self) -> Path:
        """Data set beside what it is of."""
        place = self.place or Path()
        return place.parent / f"{place.stem}-set{self.choice.out.suffix}"

    @property
    def line(self) -> str:
        """Command for a terminal that writes the data set."""
        return quoted(words_of("export", self.command(self.usual_out)))

    def command(self, out: Path) -> Export:
        """Options of ``sd2 export`` for what is chosen."""
        spans = self.choice.segments == "spans"
        return replace(self.choice, out=out, margin_s=self.choice.margin_s if spans else 0.0)

    def start(self, out: Path) -> None:
        """Have the data set written, in a process of its own; goes on with one begun there."""
        if not self.ready:
            return
        command = replace(self.command(out), progress_json=True)
        choice = _CHOICE.dump_python(self.choice, mode="json")
        about = {"what": "export", "out": str(out), "choice": choice}
        path = free_folder(self._folder, "export", [out])
        self.result = None
        self._attempt(lambda: self.start_command(path, words_of("export", command), **about))
        self.changed.emit()

    # --- following ------------------------------------------------------------------------

    def candidates(self) -> Iterable[Path]:
        """Folders of what is being written, or has been meanwhile."""
        # One that has ended is there again where its folder could not be deleted.
        return (path for path in super().candidates() if path not in self._over)

    def _take_up(self) -> None:
        one = self.live or next(iter(self.known), None)
        if one is None or self.under_way:
            return
        run = ExportRun(one.path, self)
        try:
            self.choice = _CHOICE.validate_json(json.dumps(run.about.get("choice")))
        except ValueError:
            pass  # of another version: it is followed all the same
        else:
            self._look_into(self.place)
            self._count()
        self.follow(run, under_way=True)  # until it is known, and said, how it has ended
        if one.live:
            self.say_found(run.out.name)

    def follow(self, run: ExportRun | None, under_way: bool = False) -> None:
        """Show an export among the tasks; after its end, look for one that ended unseen."""
        self._jobs.finish(self._job)
        self._job = None
        super().follow(run, under_way)
        if run is None:
            self.look_for_runs()
        else:
            told = run.history
            job = self._job = Job(f"Exporting {run.out.name}", partial(self.tell, "stop"))
            self._jobs.start(job)
            run.changed.connect(lambda: self._jobs.report(job, told.done, told.total))

    def say_ended(self, run: ExportRun) -> None:
        """Tell the user what is written and what was left out, or what went wrong."""
        self.result = result = run.history.written
        if result is not None:
            what, views = counted(result.segments, "segment"), counted(result.sources, "view")
            self.noted.emit(f"{what} from {views} are in {result.dataset}.")
            if result.failed:
                self.failed.emit("\n".join(f"Left out: {one}" for one in result.failed))
        elif run.phase == "died":
            self.failed.emit(
                f"{run.out.name} was not written to its end: its process is gone. Export it again;"
                " what is complete is kept."
            )
        elif run.phase == "failed":
            self.failed.emit(run.text.splitlines()[-1])
        run.folder.discard()
        self._over.add(run.path)
        self.select(None)

    # --- inside ---------------------------------------------------------------------------

    def _look_into(self, place: Path | None) -> None:
        """Note what the recordings of a place plan and carry; damaged ones have nothing."""
        from sd2core.datasets.sources import recordings_in

        self.places = 0
        carried: set[str] = set()
        folders = [] if place is None else [place] if is_recording(place) else recordings_in(place)
        for folder in folders:
            try:
                recording = open_recording(folder)
            except Sd2Error:
                continue
            if recording.mesh is not None:
                carried.update(recording.imu_places)
                if recording.placements is not None:
                    self.places = max(self.places, len(recording.placements.places()))
        self.imu_places = tuple(name for name in PLACES if name in carried)

    def _count(self) -> None:
        choice, known = self.choice, self._counted
        self.problem = ""
        if not choice.inputs or not choice.kinds:
            self._runner.cancel()
            self._counted = None
            self.problem = "No map is chosen." if choice.inputs else ""
            self.changed.emit()
            return

        def count(emit: Emit) -> _Counted:
            from sd2core.datasets.forecast import Counting
            from sd2core.datasets.sources import gather

            wanted, making = dataset_and_making(choice)
            asked = choice.inputs, choice.subjects, making
            if known is not None and known.sources == asked:
                counting = known.counting
            else:
                sources = gather(choice.inputs, making, subjects=choice.subjects)
                counting = Counting.of(sources, lambda done, total: emit(None))
            forecast = counting.forecast(wanted, making.synthesis.axis.bins)
            return _Counted(asked, counting, forecast, making.pace_kind)

        self._runner.submit(count)
        self.changed.emit()

    def _receive(self, counted: _Counted) -> None:
        self._counted = counted
        if not counted.forecast.segments:
            self.problem = (
                "Nothing is labelled where a person is seen."
                if self.choice.segments == "spans"
                else f"No recording has {self.choice.segment_frames} frames on end with a person."
            )
        self.changed.emit()

    def _refuse(self, error: Exception) -> None:
        self._counted = None
        self.problem = str(error)
        self.changed.emit()
