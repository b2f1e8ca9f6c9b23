"""Data set to be exported: its choices, its forecast, and the process that writes it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

from pydantic import TypeAdapter
from PySide6.QtCore import QObject

from sd2app.background.latest import Emit, LatestRunner
from sd2app.background.quoting import quoted
from sd2app.background.runs import Runs, free_folder
from sd2app.dataset_export.run import Exported, ExportRun
from sd2app.session.tasks import Job, TaskList
from sd2app.settings import Settings
from sd2app.widgets.text import about, counted
from sd2core.cli.export import Export
from sd2core.errors import Sd2Error
from sd2core.files.paths import user_data
from sd2core.imu.mounting import PLACES
from sd2core.maps import MapKind
from sd2core.options.records import words_of
from sd2core.pairs.segments import LENGTH, OVERLAP
from sd2core.progress import Cancelled
from sd2core.recording.recording import is_recording, open_recording
from sd2core.runs.command_folder import COMMAND_IN_FOLDER, CommandFolder
from sd2core.runs.pace import known_pace_s
from sd2core.sensor import VelocityAxis

if TYPE_CHECKING:
    # Imported where it is used: it takes long to load, and the window starts without.
    from sd2core.datasets.forecast import Counting, Forecast
    from sd2core.datasets.recording_sources import Making

MAPS: dict[str, tuple[MapKind, ...]] = {
    "synthetic": ("synthetic",),
    "denoised": ("denoised",),
    "radar": ("simulated", "real"),
}
"""Kinds of maps that are chosen together; a radar's map is simulated or real."""


@dataclass(frozen=True)
class ExportChoice:
    """Choices for a data set."""

    place: Path | None = None  # a recording, or a folder of recordings
    maps: frozenset[str] = frozenset(MAPS)  # some of MAPS
    planned: bool = False  # also from all places that each recording plans
    subjects: tuple[str, ...] = ()  # person of each recording; empty: each of a different person
    length: int = LENGTH  # frames
    overlap: int = OVERLAP  # frames
    spans: bool = False  # one segment of each labelled span, instead of windows
    margin_s: float = 0.0  # kept before and after each span
    ending: Literal[".zarr", ".h5", ".npz"] = ".zarr"
    imu: tuple[str, ...] = ()  # named places of inertial sensors; empty: none are exported

    @property
    def kinds(self) -> tuple[MapKind, ...]:
        """Kinds of maps that are wanted."""
        return tuple(kind for name, kinds in MAPS.items() if name in self.maps for kind in kinds)

    @property
    def making(self) -> Making:
        """Options for the maps."""
        from sd2core.datasets.recording_sources import Making

        placements: Literal["planned"] | None = "planned" if self.planned else None
        return Making(kinds=self.kinds, placements=placements, imu=self.imu)

    @property
    def sources(self) -> tuple[object, ...]:
        """Choices that decide which sources there are."""
        return self.place, self.maps, self.planned, self.subjects, self.imu


CHOICE = TypeAdapter(ExportChoice)
"""Reads and writes choices as JSON holds them."""


class _Counted(NamedTuple):
    sources: tuple[object, ...]
    counting: Counting
    forecast: Forecast


class ExportModel(Runs[ExportRun]):
    """Counts while choices are made, and has one data set written at a time.

    ``command`` runs ``sd2`` commands in a folder; ``folder`` is where running exports are noted.
    ``failed`` also says what was left out.
    """

    monitor, remembered = ExportRun, "run"
    shown_by = "File → Export data set…"

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
        self.choice = ExportChoice()
        self.problem = ""  # why these choices cannot be exported
        self.places = 0  # planned besides the recordings' own sensors, the most of any
        self.imu_places: tuple[str, ...] = ()  # named ones that the recordings have sensors at
        self.result: Exported | None = None  # written last, until something else is chosen
        self._counted: _Counted | None = None
        self._runner = LatestRunner("count segments", self, self._receive, self._refuse)
        self._job: Job | None = None
        self._over: set[Path] = set()

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
        each_s = known_pace_s(self.choice.making.pace_kind)
        if each_s is None or self.forecast is None:
            return "the first view tells how long it takes"
        return about(each_s * self.forecast.segments)

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
        planned = self.choice.planned and self.places > 0
        imu = self.imu_places if self.choice.imu else ()
        self.result = None
        self.choice = replace(self.choice, place=place, planned=planned, subjects=(), imu=imu)
        self._count()

    def choose(self, **changes: object) -> None:
        """Choose something else."""
        choice = replace(self.choice, **changes)  # type: ignore[arg-type]
        if choice == self.choice:
            return
        same = replace(choice, ending=self.choice.ending) == self.choice
        self.choice, self.result = choice, None
        if same:  # the format changes no count
            self.changed.emit()
        else:
            self._count()

    @property
    def usual_out(self) -> Path:
        """Data set beside what it is of."""
        place = self.choice.place or Path()
        return place.parent / f"{place.stem}-set{self.choice.ending}"

    @property
    def line(self) -> str:
        """Command for a terminal that writes the data set."""
        return quoted(words_of("export", self.command(self.usual_out)))

    def command(self, out: Path) -> Export:
        """Options of ``sd2 export`` for what is chosen."""
        choice = self.choice
        return Export(
            inputs=() if choice.place is None else (choice.place,),
            out=out,
            kinds=choice.kinds,
            segment_frames=choice.length,
            overlap_frames=choice.overlap,
            segments="spans" if choice.spans else "windows",
            margin_s=choice.margin_s if choice.spans else 0.0,
            placements="planned" if choice.planned else None,
            imu=choice.imu,
            subjects=choice.subjects or None,
        )

    def start(self, out: Path) -> None:
        """Have the data set written, in a process of its own; goes on with one begun there."""
        if not self.ready:
            return
        command = replace(self.command(out), progress_json=True)
        about = {
            "what": "export",
            "out": str(out),
            "choice": CHOICE.dump_python(self.choice, mode="json"),
        }
        path = free_folder(self._folder, "export", [out])
        try:
            # It may use all processors: it gives way to whatever else wants them.
            process = CommandFolder(path).start(
                words_of("export", command), about, self._command, {}
            )
        except (Sd2Error, OSError) as error:
            CommandFolder(path).discard()
            self.failed.emit(str(error))
            return
        self.result = None
        self.follow_new(path, process)

    def stop(self) -> None:
        """Stop writing; what is complete stays, and the same export goes on from there."""
        self.tell("stop")

    def close(self) -> None:
        """Stop polling; a running export goes on."""
        self._runner.close()
        super().close()

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
            self.choice = CHOICE.validate_python(run.choice)
        except ValueError:
            pass  # of another version: it is followed all the same
        else:
            self._look_into(self.choice.place)
            self._count()
        self.follow(run, under_way=True)  # until it is known, and said, how it has ended
        if one.live:
            self.say_found(run.out.name)

    def follow(self, run: ExportRun | None, under_way: bool = False) -> None:
        """Show an export among the tasks; after its end, look for one that ended unseen."""
        if self._job is not None:
            self._jobs.finish(self._job)
            self._job = None
        super().follow(run, under_way)
        if run is None:
            self.look_for_runs()
        else:
            self._job = self._jobs.start(f"Exporting {run.out.name}", self.stop)
            run.changed.connect(self._report)

    def _report(self) -> None:
        if self.run is not None and self._job is not None:
            history = self.run.history
            self._jobs.report(self._job, history.done, history.total)

    def say_ended(self, run: ExportRun) -> None:
        """Tell the user what is written and what was left out, or what went wrong."""
        self.result = result = run.history.written
        if result is not None:
            what, views = counted(result.segments, "segment"), counted(result.sources, "view")
            self.noted.emit(f"{what} from {views} are in {result.path}.")
            if result.left_out:
                self.failed.emit("\n".join(f"Left out: {one}" for one in result.left_out))
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
        if choice.place is None or not choice.maps:
            self._runner.cancel()
            self._counted = None
            self.problem = "" if choice.place is None else "No map is chosen."
            self.changed.emit()
            return
        place = choice.place

        def count(emit: Emit) -> _Counted:
            from sd2core.datasets.forecast import Counting
            from sd2core.datasets.options import DatasetOptions
            from sd2core.datasets.sources import gather
            from sd2core.options.exporting import SpanOptions

            options = DatasetOptions(
                kinds=choice.kinds,
                length=choice.length,
                overlap=choice.overlap,
                imu=choice.imu,
                spans=SpanOptions(margin_s=choice.margin_s) if choice.spans else None,
            )
            if known is not None and known.sources == choice.sources:
                counting = known.counting
            else:
                sources = gather([place], choice.making, subjects=choice.subjects or None)
                counting = Counting.of(sources, lambda done, total: emit(None))
            forecast = counting.forecast(options, VelocityAxis().bins)
            return _Counted(choice.sources, counting, forecast)

        self._runner.submit(count)
        self.changed.emit()

    def _receive(self, counted: _Counted) -> None:
        self._counted = counted
        if not counted.forecast.segments:
            self.problem = (
                "Nothing is labelled where a person is seen."
                if self.choice.spans
                else f"No recording has {self.choice.length} frames on end with a person."
            )
        self.changed.emit()

    def _refuse(self, error: Exception) -> None:
        if isinstance(error, Cancelled):
            return
        self._counted = None
        self.problem = str(error)
        self.changed.emit()
