"""Pairs made of recordings in a background process."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import ClassVar

from PySide6.QtCore import QObject, Signal

from sd2app.background.run_monitor import CommandRun
from sd2app.background.runs import Runs
from sd2app.settings import Settings
from sd2core.cli.pairs import Recordings
from sd2core.errors import Sd2Error
from sd2core.files.paths import remove
from sd2core.options.records import words_of
from sd2core.recording.recording import is_recording, open_recording
from sd2core.runs.command_folder import COMMAND


class PairRun(CommandRun):
    """Run that makes pairs."""

    stop_patience_s = 3.0


class PairMaker(Runs[PairRun]):
    """Runs ``sd2 pairs recordings`` once at a time, with ``command``.

    Pairs are kept in ``folder``, which is made on demand.
    """

    monitor, remembered = PairRun, "run"
    environment: ClassVar = {}

    made = Signal(object)  # path of a finished store

    def __init__(
        self, folder: Path, parent: QObject | None = None, command: Sequence[str] = COMMAND
    ) -> None:
        super().__init__(Settings.forgetful(), folder, parent, (*command, "--folder"))

    @property
    def out(self) -> Path | None:
        """Store that is being made."""
        return None if self.run is None else self.run.out

    def candidates(self) -> Iterable[Path]:
        """None: those of another window are its own."""
        return ()

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
        words = words_of(
            "pairs recordings", Recordings(recordings=tuple(recordings), out=out, limbs=limbs)
        )
        self.start_command(out.with_name(f".{out.stem}"), words, what="pairs", out=str(out))

    def close(self) -> None:
        """End the process at once."""
        if self.run is not None:
            self.run.kill()
            self._clear_up(self.run)
        super().close()

    def say_ended(self, run: PairRun) -> None:
        """Say what was made, or why it was not, unless it was cancelled."""
        self._clear_up(run)
        if run.phase == "finished":
            self.made.emit(run.out)
        elif run.phase != "stopped":
            lines = run.text.splitlines() or [f"{run.out.stem} could not be made."]
            self.failed.emit(lines[-1].removeprefix("sd2: "))

    def _clear_up(self, run: PairRun) -> None:
        """Forget the process, and remove what it left."""
        self.select(None)
        run.folder.discard()
        if run.phase != "finished" and run.out.exists():
            remove(run.out)


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
