"""Pairs made of recordings in a background process."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from sd2app.background.run_monitor import CommandRun
from sd2core.cli.pairs import Recordings
from sd2core.errors import Sd2Error
from sd2core.files.paths import remove
from sd2core.options.records import words_of
from sd2core.recording.recording import is_recording, open_recording
from sd2core.runs.command_folder import COMMAND, CommandFolder


class PairRun(CommandRun):
    """Run that makes pairs."""

    stop_patience_s = 3.0


class PairMaker(QObject):
    """Runs ``sd2 pairs recordings`` once at a time, with ``command``.

    Pairs are kept in ``folder``, which is made on demand.
    """

    changed = Signal()  # making pairs began or ended
    made = Signal(object)  # path of a finished store
    failed = Signal(str)  # why there is none

    def __init__(
        self, folder: Path, parent: QObject | None = None, command: Sequence[str] = COMMAND
    ) -> None:
        super().__init__(parent)
        self._folder = folder
        self._command = (*command, "--folder")
        self._run: PairRun | None = None
        self.out: Path | None = None  # store that is being made
        self.cancelling = False  # it has been asked to end

    def make(self, place: Path, *, limbs: bool = False) -> None:
        """Make pairs of a recording, or of all recordings in a folder; with ``limbs`` also split.

        Raises Sd2Error if there is none with a mesh and a radar capture, some are being made, or
        it cannot be started; OSError if the folder cannot be read, or that of the pairs not be
        made.
        """
        if self.out is not None:
            raise Sd2Error(f"{self.out.stem} is being made already", "one at a time", "Wait for it")
        recordings = usable_recordings(place)
        self._folder.mkdir(parents=True, exist_ok=True)
        out = _free(self._folder, place.stem)
        folder = CommandFolder(out.with_name(f".{out.stem}"))
        command = Recordings(recordings=tuple(recordings), out=out, limbs=limbs)
        words = words_of("pairs recordings", command)
        try:
            process = folder.start(words, {"what": "pairs"}, self._command, {})
        except Sd2Error:
            folder.discard()
            raise
        self._run = run = PairRun(folder.path, self, process=process)
        self.out, self.cancelling = out, False
        run.ended.connect(self._end)
        self.changed.emit()

    def cancel(self) -> None:
        """Cancel, and remove the unfinished pairs."""
        if self._run is not None and not self.cancelling:
            self.cancelling = True
            self._run.stop()
            self.changed.emit()

    def close(self) -> None:
        """End the process at once."""
        if self._run is not None:
            self._run.kill()
            self._let_go(self._run)

    def _end(self) -> None:
        out, run = self.out, self._run
        assert out is not None
        assert run is not None
        run.close()
        if run.phase == "finished":
            self.out = None  # it is kept
        self._let_go(run)
        if run.phase == "finished":
            self.made.emit(out)
        elif not self.cancelling:
            lines = run.text.splitlines() or [f"{out.stem} could not be made."]
            self.failed.emit(lines[-1].removeprefix("sd2: "))
        self.cancelling = False
        self.changed.emit()

    def _let_go(self, run: PairRun) -> None:
        """Forget the process, and remove what it left."""
        out, self._run, self.out = self.out, None, None
        run.deleteLater()
        run.folder.discard()
        if out is not None and out.exists():
            remove(out)


def usable_recordings(place: Path) -> list[Path]:
    """The recording itself, or those in a folder that have a mesh and a radar capture.

    Raises Sd2Error if there is none.
    """
    folders = [place] if is_recording(place) else sorted(place.iterdir())
    usable = []
    for folder in folders:
        if is_recording(folder):
            try:
                recording = open_recording(folder)
            except Sd2Error:
                continue  # damaged: the others are still of use
            if recording.mesh is not None and recording.radar is not None:
                usable.append(folder)
    if not usable:
        raise Sd2Error(
            f"{place} holds no recording with a mesh and a radar capture",
            "a recording (.sd2), or a folder of some",
        )
    return usable


def _free(folder: Path, name: str) -> Path:
    path, number = folder / f"{name}.zarr", 2
    while path.exists():
        path, number = folder / f"{name}-{number}.zarr", number + 1
    return path
