"""A data set to be exported: what of, what it would hold, and the process that writes it."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from PySide6.QtCore import QObject, Signal

from sd2app.jobs.latest import Emit, LatestRunner
from sd2app.jobs.line_process import Ending, LineProcess
from sd2app.models.export_messages import Exported, Progressed, Refused, message_of
from sd2app.models.jobs import Job, JobsModel
from sd2core.datasets.inputs import gather, recordings_in
from sd2core.datasets.options import DatasetOptions
from sd2core.datasets.planning import Counting, Forecast
from sd2core.datasets.recording_sources import Making
from sd2core.errors import Sd2Error
from sd2core.progress import Cancelled
from sd2core.recording import is_recording, open_recording
from sd2core.segments import LENGTH, OVERLAP
from sd2core.sensor import VelocityAxis
from sd2core.spectrum import MapKind

COMMAND = (sys.executable, "-u", "-m", "sd2app.jobs.background")

ENDINGS = (".zarr", ".h5", ".npz")

MAPS: dict[str, tuple[MapKind, ...]] = {
    "synthetic": ("synthetic",),
    "denoised": ("denoised",),
    "radar": ("simulated", "real"),
}
"""What is chosen together: a radar's map is simulated or real as its recording is."""


@dataclass(frozen=True)
class ExportChoice:
    """What a data set is to hold.

    Parameters
    ----------
    place : Path or None
        A recording, or a folder of recordings.
    maps : frozenset of str
        Some of :data:`MAPS`.
    planned : bool
        From all places that each recording plans, besides its own sensor.
    subjects : tuple of str
        Who each recording is of; empty: everyone another person.
    length, overlap : int
        Frames.
    ending : str
        One of :data:`ENDINGS`.
    """

    place: Path | None = None
    maps: frozenset[str] = frozenset(MAPS)
    planned: bool = False
    subjects: tuple[str, ...] = ()
    length: int = LENGTH
    overlap: int = OVERLAP
    ending: str = ".zarr"

    @property
    def kinds(self) -> tuple[MapKind, ...]:
        """Kinds of maps that are wanted."""
        return tuple(kind for name, kinds in MAPS.items() if name in self.maps for kind in kinds)

    @property
    def sources(self) -> tuple[object, ...]:
        """What decides which sources there are."""
        return self.place, self.maps, self.planned, self.subjects


class _Counted(NamedTuple):
    sources: tuple[object, ...]
    counting: Counting
    forecast: Forecast


class ExportModel(QObject):
    """Counts while choices are made, and has one data set written at a time.

    Parameters
    ----------
    jobs : JobsModel
    command : sequence of str
        What runs ``sd2`` commands.

    Signals
    -------
    changed
        A choice, a count, or how far the writing is.
    noted : str
        What was written.
    failed : str
        Why nothing was written, or what was left out.
    """

    changed = Signal()
    noted = Signal(str)
    failed = Signal(str)

    def __init__(
        self,
        jobs: JobsModel,
        parent: QObject | None = None,
        command: Sequence[str] = COMMAND,
    ) -> None:
        super().__init__(parent)
        self._jobs, self._command = jobs, tuple(command)
        self._choice = ExportChoice()
        self._counted: _Counted | None = None
        self._problem = ""
        self._places = 0
        self._runner = LatestRunner("count segments", self)
        self._runner.finished.connect(self._receive)
        self._runner.failed.connect(self._refuse)
        self._process: LineProcess | None = None
        self._job: Job | None = None
        self._refused = ""
        self._result: Exported | None = None
        self._stopped = False

    @property
    def choice(self) -> ExportChoice:
        """What was chosen."""
        return self._choice

    @property
    def forecast(self) -> Forecast | None:
        """What would be written; None while that is counted, or where it cannot be."""
        return None if self._counted is None or self.counting else self._counted.forecast

    @property
    def counting(self) -> bool:
        """Whether what would be written is being counted."""
        return self._runner.busy

    @property
    def problem(self) -> str:
        """Why these choices cannot be exported; empty where they can."""
        return self._problem

    @property
    def places(self) -> int:
        """Places that the recordings plan besides their own sensors, the most of any."""
        return self._places

    @property
    def exporting(self) -> bool:
        """Whether a data set is being written."""
        return self._process is not None

    @property
    def progress(self) -> tuple[int, int]:
        """Steps done, and of how many; 0 where that is not known."""
        return (0, 0) if self._job is None else (self._job.done, self._job.total)

    @property
    def result(self) -> Exported | None:
        """What was written last, until something else is chosen."""
        return self._result

    @property
    def ready(self) -> bool:
        """Whether there is something to write, and nothing being written."""
        forecast = self.forecast
        return forecast is not None and forecast.segments > 0 and not self.exporting

    def begin(self, place: Path | None) -> None:
        """Start anew with a recording or a folder, keeping other choices; looks at it again."""
        self._counted = None
        self._places = _places(place)
        planned = self._choice.planned and self._places > 0
        self._result = None
        self._choice = replace(self._choice, place=place, planned=planned, subjects=())
        self._count()

    def choose(self, **changes: object) -> None:
        """Choose something else."""
        choice = replace(self._choice, **changes)  # type: ignore[arg-type]
        if choice == self._choice:
            return
        same = replace(choice, ending=self._choice.ending) == self._choice
        self._choice, self._result = choice, None
        if same:  # the format changes no count
            self.changed.emit()
        else:
            self._count()

    def start(self, out: Path) -> None:
        """Have the data set written, in a process of its own; goes on with one begun there."""
        if not self.ready or self._choice.place is None:
            return
        choice = self._choice
        self._result, self._refused, self._stopped = None, "", False
        self._job = self._jobs.start(f"Exporting {out.name}", self.stop)
        self._process = LineProcess(self)
        self._process.line.connect(self._follow)
        self._process.ended.connect(self._end)
        words = [
            "export", str(choice.place), "--out", str(out), "--kinds", ",".join(choice.kinds),
            "--length", str(choice.length), "--overlap", str(choice.overlap), "--progress-json",
        ]  # fmt: skip
        words += ["--placements", "planned"] if choice.planned else []
        words += ["--subjects", ",".join(choice.subjects)] if choice.subjects else []
        self._process.start([*self._command, *words])
        self.changed.emit()

    def stop(self) -> None:
        """Stop writing; what is complete stays, and the same export goes on from there."""
        if self._process is not None:
            self._stopped = True
            self._process.stop()
            self.changed.emit()

    def close(self) -> None:
        """End everything at once."""
        self._runner.close()
        if self._process is not None:
            self._process.close()
            self._finish()

    # --- inside ---------------------------------------------------------------------------

    def _count(self) -> None:
        choice, known = self._choice, self._counted
        self._problem = ""
        if choice.place is None or not choice.maps:
            self._runner.cancel()
            self._counted = None
            self._problem = "" if choice.place is None else "No map is chosen."
            self.changed.emit()
            return
        place = choice.place

        def count(emit: Emit) -> _Counted:
            options = DatasetOptions(
                kinds=choice.kinds, length=choice.length, overlap=choice.overlap
            )
            if known is not None and known.sources == choice.sources:
                counting = known.counting
            else:
                sources = gather(
                    [place],
                    Making(kinds=choice.kinds, placements="planned" if choice.planned else None),
                    subjects=choice.subjects or None,
                )
                counting = Counting.of(sources, lambda done, total: emit(None))
            forecast = counting.forecast(options, VelocityAxis().bins)
            return _Counted(choice.sources, counting, forecast)

        self._runner.submit(count)
        self.changed.emit()

    def _receive(self, counted: _Counted) -> None:
        self._counted = counted
        if not counted.forecast.segments:
            self._problem = f"No recording has {self._choice.length} frames on end with a person."
        self.changed.emit()

    def _refuse(self, error: Exception) -> None:
        if isinstance(error, Cancelled):
            return
        self._counted = None
        self._problem = str(error)
        self.changed.emit()

    def _follow(self, line: str) -> None:
        message = message_of(line)
        if isinstance(message, Progressed) and self._job is not None:
            self._jobs.report(self._job, message.done, message.total)
        elif isinstance(message, Exported):
            self._result = message
        elif isinstance(message, Refused):
            self._refused = message.text
        self.changed.emit()

    def _end(self, ending: Ending) -> None:
        self._finish()
        result = self._result
        if result is not None:
            self.noted.emit(
                f"{result.segments:,} segment{'s' * (result.segments != 1)} from {result.sources:,}"
                f" view{'s' * (result.sources != 1)} are in {result.path}."
            )
            if result.left_out:
                self.failed.emit("\n".join(f"Left out: {one}" for one in result.left_out))
        elif not self._stopped:
            said = self._refused or "\n".join(ending.errors.splitlines()[-1:])
            self.failed.emit(said or "The export ended by itself, nobody said why.")
        self.changed.emit()

    def _finish(self) -> None:
        self._process = None
        if self._job is not None:
            self._jobs.finish(self._job)
            self._job = None


def _places(place: Path | None) -> int:
    """The most places that a recording there plans; damaged ones plan none."""
    if place is None:
        return 0
    most = 0
    for folder in [place] if is_recording(place) else recordings_in(place):
        try:
            recording = open_recording(folder)
        except Sd2Error:
            continue
        if recording.placements is not None and recording.mesh is not None:
            most = max(most, len(recording.placements.places()))
    return most
