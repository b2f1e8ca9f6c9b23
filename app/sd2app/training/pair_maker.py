"""Pairs made of recordings in a background process."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from sd2app.background.line_process import Ending, LineProcess
from sd2app.background.run_command import COMMAND
from sd2core.errors import Sd2Error
from sd2core.files.paths import remove
from sd2core.recording.recording import is_recording, open_recording


class PairMaker(QObject):
    """Runs ``sd2 pairs recordings`` once at a time, with ``command``.

    Pairs are kept in ``folder``, which is made on demand.
    """

    changed = Signal()  # making pairs began or ended
    made = Signal(object)  # path of a finished store
    failed = Signal(str)  # why there is none

    def __init__(
        self,
        folder: Path,
        parent: QObject | None = None,
        command: Sequence[str] = COMMAND,
    ) -> None:
        super().__init__(parent)
        self._folder = folder
        self._command = tuple(command)
        self._process: LineProcess | None = None
        self._out: Path | None = None
        self._cancelled = False

    @property
    def out(self) -> Path | None:
        """Store that is being made."""
        return self._out

    @property
    def cancelling(self) -> bool:
        """True once it has been asked to end."""
        return self._out is not None and self._cancelled

    def make(self, place: Path) -> None:
        """Make pairs of a recording, or of all recordings in a folder.

        Raises Sd2Error if there is none with a mesh and a radar capture, or some are being made;
        OSError if the folder cannot be read, or that of the pairs not be made.
        """
        if self._out is not None:
            raise Sd2Error(
                f"{self._out.stem} is being made already", "one at a time", "Wait for it"
            )
        recordings = usable_recordings(place)
        self._folder.mkdir(parents=True, exist_ok=True)
        self._out = _free(self._folder, place.stem)
        self._cancelled = False
        self._process = LineProcess(self)
        self._process.ended.connect(self._end)
        words = ["pairs", "recordings", *map(str, recordings), "--out", str(self._out)]
        self._process.start([*self._command, *words])
        self.changed.emit()

    def cancel(self) -> None:
        """Cancel, and remove the unfinished pairs."""
        if self._process is not None and not self._cancelled:
            self._cancelled = True
            self._process.stop()
            self.changed.emit()

    def close(self) -> None:
        """End the process at once."""
        if self._process is not None:
            self._process.close()
            self._clear_up()

    def _end(self, ending: Ending) -> None:
        out = self._out
        assert out is not None
        if ending.code == 0:
            self._process, self._out = None, None
            self.made.emit(out)
        else:
            self._clear_up()
            if not self._cancelled:
                self.failed.emit(ending.reason(f"{out.stem} could not be made."))
        self.changed.emit()

    def _clear_up(self) -> None:
        out, self._process, self._out = self._out, None, None
        if out is not None and out.exists():
            remove(out)


def usable_recordings(place: Path) -> list[Path]:
    """The recording itself, or those in a folder that have a mesh and a radar capture.

    Raises Sd2Error if there is none.
    """
    folders = [place] if is_recording(place) else sorted(place.iterdir())
    found = []
    for folder in folders:
        if is_recording(folder):
            try:
                recording = open_recording(folder)
            except Sd2Error:
                continue  # damaged: the others are still of use
            if recording.mesh is not None and recording.radar is not None:
                found.append(folder)
    if not found:
        raise Sd2Error(
            f"{place} holds no recording with a mesh and a radar capture",
            "a recording (.sd2), or a folder of some",
        )
    return found


def _free(folder: Path, name: str) -> Path:
    path, number = folder / f"{name}.zarr", 2
    while path.exists():
        path, number = folder / f"{name}-{number}.zarr", number + 1
    return path
