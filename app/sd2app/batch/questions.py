"""Questions of the window of batches: files, folders, placements, results to open."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QApplication, QFileDialog, QWidget

from sd2app.batch.model import BatchModel
from sd2app.batch.run import Result
from sd2app.denoise.model import DenoiseModel
from sd2app.feature import Shell
from sd2app.sensor.placements import PlacementsModel
from sd2app.session.saving import saved_first
from sd2app.session.session import Session
from sd2app.widgets.dialogs import Answer, ask_file, ask_folder, ask_new, confirmed, show_in_files
from sd2app.widgets.text import counted, quoted
from sd2core.denoise.card import ModelCard
from sd2core.errors import Sd2Error
from sd2core.files.paths import plain_path
from sd2core.io.kinds import kind_of
from sd2core.placements.placements import Placements, read_placements
from sd2core.recording.recording import is_recording, open_recording

T = TypeVar("T")
_FILES = (
    "Recordings, videos, meshes (*.mp4 *.mkv *.mov *.avi *.webm *.npz *.zip *.obj *.ply *.glb"
    " *.pkl recording.json zarr.json);;All files (*)"
)
_PLACEMENTS = "Placements (*.json *.toml);;All files (*)"
_OWN, _PLANNED, _FILE = range(3)
_PLAN_HERE = "the open recording"
_PLAN_BEFORE = "what was planned before"


class BatchQuestions(QObject):
    """Dialogs, followed by calls of the models; ``denoiser`` is that of the open recording."""

    warned = Signal(str)  # what went wrong; empty when something else is tried

    def __init__(
        self,
        batch: BatchModel,
        session: Session,
        shell: Shell,
        placements: PlacementsModel,
        denoiser: DenoiseModel,
    ) -> None:
        super().__init__(batch)
        self._batch, self._session, self.shell = batch, session, shell
        self._placements, self._denoiser = placements, denoiser
        self._opening: tuple[Result, set[Path]] | None = None
        placements.changed.connect(self._follow_plan)
        session.document.opened.connect(self._place_sensor)
        session.document.failed.connect(lambda _: self._forget_result())

    def place_as_planned(self) -> None:
        """Put sensors where the open recording plans them, in a batch that is being set up."""
        placements = self._placements.plan
        if placements is not None and self._batch.run is None:
            self._batch.setup.set_placements(placements, _PLAN_HERE)

    def begin_as_open(self) -> None:
        """Begin a set-up with what is open: recording, planned places, denoiser.

        Recordings and places that were chosen before stay.
        """
        content, setup = self._session.document.content, self._batch.setup
        if self._batch.run is not None or content is None:
            return
        if not setup.data and content.saved:
            setup.add(content.recording.folder)
        if setup.placements is None:
            self.place_as_planned()
        card = self._denoiser.card
        for name, one in self.models.items():
            if card is not None and one.path == card.path:
                self.choose_model(name)

    # --- setting up -----------------------------------------------------------------------

    def add_files(self) -> None:
        """Let the user choose recordings, videos or meshes."""
        names, _ = QFileDialog.getOpenFileNames(self._over, "Recordings to work on", "", _FILES)
        self._batch.setup.add(*map(Path, names))

    def add_folder(self) -> None:
        """Let the user choose a folder of recordings, videos or meshes."""
        if path := ask_folder(self._over, "A recording, or a folder of some"):
            self._batch.setup.add(path)

    @property
    def models(self) -> Mapping[str, ModelCard]:
        """Denoisers by name or file."""
        return self._denoiser.by_name()

    def choose_model(self, name: str) -> None:
        """Denoise with another model, from the maps that it takes."""
        card = self.models.get(name)
        if card is not None:
            self._batch.setup.set_value("limbs", bool(card.parts))
        self._batch.setup.set_value("model", name)

    def placement_choices(self) -> Sequence[str]:
        """Choices of sensor placements in words."""
        placements, setup = self._placements.plan, self._batch.setup
        here = "As planned in the open recording"
        if placements is not None:
            here += f" ({_count_text(placements)})"
        chosen = setup.placements
        file = "Of a file…"
        if chosen is not None and setup.placed != _PLAN_HERE:
            file = f"Of {setup.placed} ({_count_text(chosen)})"
        return ("Where each recording has its own", here, file)

    def placement_index(self) -> int:
        """Index of the current choice."""
        if self._batch.setup.placements is None:
            return _OWN
        return _PLANNED if self._batch.setup.placed == _PLAN_HERE else _FILE

    def choose_placements(self, index: int) -> None:
        """Put sensors where one of the choices says."""
        setup = self._batch.setup
        if index == _OWN:
            setup.set_placements(None)
        elif index == _PLANNED:
            placements = self._placements.plan
            if placements is None:
                self.warned.emit("The open recording plans no placements: Edit → Placements… does.")
            setup.set_placements(placements, _PLAN_HERE)
        elif path := ask_file(self._over, "Placements", _PLACEMENTS):
            read = self._attempt(lambda: read_placements(path))
            if read is not None:
                setup.set_placements(read, path.name)
        self._batch.changed.emit()  # the choice goes back where nothing was chosen

    def _follow_plan(self) -> None:
        """Follow the plan of the open recording, if that was chosen."""
        setup, placements = self._batch.setup, self._placements.plan
        if setup.placements is None or setup.placed != _PLAN_HERE:
            return
        if placements is None:
            setup.set_placements(setup.placements, _PLAN_BEFORE)
        elif placements != setup.placements:
            setup.set_placements(placements, _PLAN_HERE)

    def choose_out(self) -> None:
        """Let the user choose the folder of the results."""
        start = str(self._batch.setup.out or "")
        if folder := ask_new(self._over, "Folder of the results", start):
            self._batch.setup.set_out(folder)

    def save_plan(self) -> Path | None:
        """Let the user choose a file for the plan; return it if it is written."""
        kinds = "Plan of a batch (*.toml)"
        out = self._batch.setup.out
        name = "plan.toml" if out is None else f"{out.name}.toml"
        path = ask_new(self._over, "Save plan", name, kinds, ".toml")
        return None if path is None else self._attempt(lambda: self._write_plan(path))

    def _write_plan(self, path: Path) -> Path:
        from sd2core.batch.plan_file import write_plan

        write_plan(path, self._batch.setup.plan())
        return path

    def copy_command(self) -> None:
        """Let the user save the plan, and copy the command that works on it."""
        if path := self.save_plan():
            QApplication.clipboard().setText(quoted(self._batch.words(path)))

    def start(self) -> None:
        """Start what is set up; what is open and part of it is saved first, if the user wants."""
        document, recording = self._session.document, self._session.document.recording
        paths = [plain_path(one.path) for one in self._batch.setup.data]
        opened = None if recording is None else plain_path(recording.folder)
        if (
            opened is not None
            and {opened, *opened.parents} & {*paths}
            and not saved_first(document, self.shell, "A batch works on what is saved.")
        ):
            return
        words = (
            f"{self._batch.setup.out} holds a batch of other recordings. Its data set and its list"
            " of results are replaced."
        )
        if not self._attempt(lambda: self._batch.replaces) or confirmed(
            self._over, "Replace a batch?", words, Answer.Yes, Answer.Cancel
        ):
            self._attempt(self._batch.start)

    # --- a batch that is there ------------------------------------------------------------

    def open_batch(self) -> None:
        """Let the user choose a batch in another folder, such as one started in a terminal."""
        if path := ask_folder(self._over, "Folder of a batch"):
            self._attempt(lambda: self._batch.open_run(path))

    def resume(self) -> None:
        """Resume the batch in view."""
        self._attempt(self._batch.resume)

    def open_folder(self) -> None:
        """Show the folder of the results."""
        if self._batch.run is not None:
            show_in_files(self._batch.run.path)

    def open_result(self, row: int) -> None:
        """Open a recording in the window, with the sensor where a result says."""
        result = self._batch.results.rows[row]
        paths = self._attempt(lambda: paths_of(result))
        if paths is not None and self.shell.may_discard():
            self.shell.open_paths(paths)
            self._opening = (result, set(map(plain_path, paths)))

    def _place_sensor(self) -> None:
        recording, opening = self._session.document.recording, self._opening
        self._opening = None
        if recording is None or opening is None:
            return
        result, paths = opening
        # Something else may have been opened meanwhile.
        if paths & {recording.folder, recording.video, recording.mesh}:
            self._session.edits.place_sensor(result.sensor, "Sensor to placement")

    def _forget_result(self) -> None:
        self._opening = None

    @property
    def _over(self) -> QWidget:
        """Parent of the file choosers."""
        return QApplication.activeWindow() or self.shell.dialog_parent

    def _attempt(self, work: Callable[[], T]) -> T | None:
        """Result of ``work``; an error is said, and None returned."""
        self.warned.emit("")
        try:
            return work()
        except (Sd2Error, OSError) as error:
            self.warned.emit(str(error))
            return None


def paths_of(result: Result) -> list[Path]:
    """Files to open for a result: the recording, or a video with its mesh.

    Raises Sd2Error if the recording is damaged.
    """
    source = Path(result.source)
    if is_recording(source):
        recording = open_recording(source)
        video = recording.video if recording.mesh is None else None
    else:
        video = source if kind_of(source) == "video" else None
    return [source] if video is None else [video, Path(result.mesh)]


@lru_cache(maxsize=8)
def _count_text(placements: Placements) -> str:
    # There may be ten thousand, and this is asked for whenever something changes.
    return counted(len(placements.places()), "placement")
