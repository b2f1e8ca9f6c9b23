"""Set-up of a batch: recordings, placements, steps, and the folder of its results."""

from __future__ import annotations

import glob
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

from PySide6.QtCore import QObject

from sd2app.background.runs import RunSetup, Source
from sd2app.settings import Settings, StoredChoices
from sd2core.errors import Sd2Error
from sd2core.files.paths import plain_path
from sd2core.io.kinds import VIDEO_SUFFIXES, kind_of
from sd2core.numerics.compiled import worker_count
from sd2core.placements.placements import Placements

if TYPE_CHECKING:
    # Imported where it is used: it takes long to load, and the window starts without.
    from sd2core.batch.plan import BatchPlan

OptionalStep = Literal["fit", "denoise", "export"]
Accuracy = Literal["exact", "tolerance"]
ACCURACIES: tuple[Accuracy, ...] = get_args(Accuracy)
FORMATS: tuple[Literal["zarr", "h5", "npz"], ...] = ("zarr", "h5", "npz")
SUBJECTS: tuple[Literal["recording", "folder"], ...] = ("recording", "folder")

_USABLE = ("recording", "video", "mesh")
_RECORDINGS = "batch/recordings"
_DEFAULTS: dict[str, Any] = {
    "fit": True,
    "denoise": True,
    "export": True,
    "accuracy": "exact",
    "model": "denoiser",
    "limbs": False,  # the model takes the map of each part of the body
    "format": "zarr",
    "subjects": "recording",
    "workers": worker_count(),
}


@dataclass(frozen=True)
class Entry(Source):
    """A file, or all recordings in a folder."""

    patterns: tuple[str, ...] = ()  # as the plan names them; empty until it has been read
    count: int | None = None  # files; None until it has been read


class BatchSetupModel(RunSetup[Entry]):
    """Choices of a batch; all but the placements are kept from one start to the next."""

    kind = Entry

    def __init__(self, settings: Settings, parent: QObject | None = None) -> None:
        known = {"accuracy": ACCURACIES, "format": FORMATS, "subjects": SUBJECTS}
        values = StoredChoices(settings, "batch", _DEFAULTS, known)
        entries = [Entry(path) for path in settings.paths(_RECORDINGS)]
        out = settings.stored("batch/out", "")
        self._out = Path(out) if out else None
        self.placements: Placements | None = None  # None: each recording's own
        self.placed = ""  # where the placements are from, in words
        super().__init__(settings, values, _RECORDINGS, entries, parent)

    def look_into(self, source: Entry) -> Entry:
        """Count what there is, once."""
        return _looked_at(source.path) if source.count is None else source

    @property
    def out(self) -> Path | None:
        """Folder of the results; one beside the first recording until another is chosen."""
        if self._out is not None:
            return self._out
        if not self.data:
            return None
        first = self.data[0].path
        return first.parent / f"{first.stem} batch"

    @property
    def tolerance(self) -> float:
        """Error that is allowed where a plan is chosen: that of the Accuracy panel."""
        return self._settings.tolerance

    @property
    def workers(self) -> int:
        """Processes that share the work."""
        return min(max(self._values["workers"], 1), most_workers())

    def set_out(self, folder: Path) -> None:
        """Put the results elsewhere."""
        self._out = plain_path(folder)
        self._settings.set_value("batch/out", str(self._out))
        self.changed.emit()

    def set_placements(self, placements: Placements | None, placed: str = "") -> None:
        """Put sensors elsewhere; ``placed`` says where that is from."""
        self.placements, self.placed = placements, placed
        self.changed.emit()

    @property
    def problem(self) -> str:
        """Reason why there is no plan; empty when there is one."""
        if problem := self.data_problem("Add recordings to work on."):
            return problem
        if any(entry.count is None for entry in self.data):
            return "Looking for recordings…"
        return ""

    def plan(self) -> BatchPlan:
        """Plan in the form that the library takes; Sd2Error if something is missing."""
        from sd2core.batch.plan import BatchPlan, Recordings
        from sd2core.options.exporting import Exporting
        from sd2core.options.fitting import Fitting
        from sd2core.options.shared import Denoising
        from sd2core.options.synthesis import Synthesis

        if self.problem:
            raise Sd2Error(self.problem)
        assert self.out is not None
        values = self._values
        tolerance = self.tolerance if values["accuracy"] == "tolerance" else None
        where = {"kind": "recording"} if self.placements is None else self.placements.as_dict()
        return BatchPlan(
            out=str(self.out),
            recordings=Recordings(
                files=tuple(pattern for entry in self.data for pattern in entry.patterns),
                subjects=values["subjects"],
            ),
            placements=where,
            fit=Fitting() if values["fit"] else None,
            synthesise=Synthesis(tolerance=tolerance, limbs=values["denoise"] and values["limbs"]),
            denoise=Denoising(model=values["model"]) if values["denoise"] else None,
            export=Exporting(format=values["format"]) if values["export"] else None,
        )


def most_workers() -> int:
    """Largest useful number of processes."""
    return 2 * worker_count()


def _looked_at(path: Path) -> Entry:
    """Read a file or folder, in the background."""
    try:
        if path.is_dir() and (content := _in_folder(path)):
            patterns, count = content
            return Entry(path, patterns, count)
        kind = kind_of(path)
    except (Sd2Error, OSError) as error:
        return Entry(path, problem=str(error))
    if kind not in _USABLE:
        return Entry(path, problem=f"{path} is a {kind}; add recordings, videos or meshes.")
    return Entry(path, (str(path),), 1)


def _in_folder(folder: Path) -> tuple[tuple[str, ...], int] | None:
    """Patterns of the recordings in a folder, else of its videos; None where it is one itself."""
    if (folder / "recording.json").is_file() or (folder / "zarr.json").is_file():
        return None
    for suffixes in ((".sd2",), sorted(VIDEO_SUFFIXES)):
        counts = {one: sum(1 for _ in folder.rglob(f"*{one}")) for one in suffixes}
        if any(counts.values()):
            # Brackets in the folder's own name are no pattern.
            below = f"{glob.escape(str(folder))}/**/*"
            patterns = tuple(f"{below}{one}" for one, count in counts.items() if count)
            return patterns, sum(counts.values())
    return None
