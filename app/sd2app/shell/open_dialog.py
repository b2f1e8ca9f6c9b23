"""One dialog for files and folders that are opened as a whole, and how meshes were read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from PySide6.QtWidgets import QDialog, QFileDialog, QWidget

from sd2app.fit.request import REQUEST_NAME
from sd2app.settings import Settings
from sd2app.widgets.dialogs import accepted
from sd2core.errors import Sd2Error
from sd2core.files.recording_json import MeshReading
from sd2core.io.kinds import MESH_SUFFIXES, RADAR_SUFFIXES, VIDEO_SUFFIXES, kind_of
from sd2core.io.readers import MESH_FILES, RADAR_FILES, suffixes_of
from sd2core.recording.recording import Recording

_NAME = "mesh_readings"


def keep_reading(settings: Settings, paths: Sequence[Path], recording: Recording) -> None:
    """Remember how the mesh of files that were opened together is read, while they are listed."""
    content = {
        "reading": recording.mesh_reading.model_dump(mode="json", exclude_none=True),
        "faces": None if recording.faces is None else str(recording.faces),
    }
    kept, key = settings.table(_NAME), _key(paths)
    if kept.get(key) != content:
        listed = {key, *map(_key, settings.recent)}
        kept = {one: value for one, value in kept.items() if one in listed}
        settings.keep_table(_NAME, kept | {key: content})


def kept_reading(settings: Settings, paths: Sequence[Path]) -> dict[str, Any] | None:
    """Fields of a recording by which the mesh was read; None where that is not known."""
    content = settings.table(_NAME).get(_key(paths), {})
    try:
        faces, reading = content["faces"], MeshReading.model_validate(content["reading"])
        return {"mesh_reading": reading, "faces": None if faces is None else Path(faces)}
    except (TypeError, KeyError, ValueError):
        return None


def _key(paths: Sequence[Path]) -> str:
    return "\n".join(map(str, paths))


_OTHERS = {".npz", ".zip", ".csv", ".tsv", ".sto"}
_SUFFIXES = VIDEO_SUFFIXES | MESH_SUFFIXES | RADAR_SUFFIXES | _OTHERS
_CLOSED = ("recording.json", REQUEST_NAME, "zarr.json", "radar.npy")
"""Files of folders into which nobody has to look."""
_KINDS = ("recording", "mesh", "radar")


class OpenDialog(QFileDialog):
    """Files, and folders that are a recording, a capture or a mesh.

    A double click on such a folder chooses it, one on any other looks into it. ``radar`` shows
    no files but those of radars.
    """

    def __init__(
        self, parent: QWidget, title: str, folder: Path | None, *, radar: bool = False
    ) -> None:
        if radar:
            words, suffixes = "Radar captures", RADAR_SUFFIXES | suffixes_of(RADAR_FILES)
        else:
            words = "Recordings, videos, meshes, radar, inertial sensors"
            suffixes = _SUFFIXES | suffixes_of(MESH_FILES) | suffixes_of(RADAR_FILES)
        endings = " ".join(f"*{one}" for one in sorted(suffixes))
        files = f"{words} ({endings} recording.json);;All files (*)"
        super().__init__(parent, title, str(folder or ""), files)
        # Those of the systems know either files or folders.
        self.setOption(QFileDialog.Option.DontUseNativeDialog)
        self.setFileMode(QFileDialog.FileMode.ExistingFiles)
        self.directoryEntered.connect(self._enter)
        self.paths: list[Path] = []

    def accept(self) -> None:
        """Choose what is selected; look into a folder that cannot be opened."""
        chosen = [Path(name) for name in self.selectedFiles()]
        if any(path.is_dir() for path in chosen) and all(map(can_be_opened, chosen)):
            self._choose(chosen)
        else:
            super().accept()

    def done(self, result: int) -> None:
        """Take the files."""
        if result and not self.paths:
            self.paths = [Path(name) for name in self.selectedFiles()]
        super().done(result)

    def _enter(self, folder: str) -> None:
        if any((Path(folder) / name).is_file() for name in _CLOSED):
            self._choose([Path(folder)])

    def _choose(self, paths: list[Path]) -> None:
        self.paths = paths
        self.done(QDialog.DialogCode.Accepted)


def can_be_opened(path: Path) -> bool:
    """True for a file, and for a folder that is a recording, a capture, a mesh or a begun fit."""
    if path.is_file() or (path / REQUEST_NAME).is_file():
        return True
    try:
        return kind_of(path) in _KINDS
    except (Sd2Error, OSError):
        return False


def ask_to_open(
    parent: QWidget, title: str, folder: Path | None, *, radar: bool = False
) -> list[Path]:
    """Let the user choose files and folders, or radars' alone; none where it is cancelled."""
    dialog = OpenDialog(parent, title, folder, radar=radar)
    accepted(dialog)
    return dialog.paths
