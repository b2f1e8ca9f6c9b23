"""Readers of files: what each is for; those of plug-ins come after the program's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Generic, TypeVar

from sd2core.errors import Sd2Error
from sd2core.plug_ins import Group, PlugIn
from sd2core.progress import Progress, silent

if TYPE_CHECKING:
    from sd2core.io.mesh_arrays import RawMesh
    from sd2core.io.radar.capture import RadarCapture

Content = TypeVar("Content")


@dataclass(frozen=True)
class FileReader(Generic[Content]):
    """Reader of files of one format; a capture may be a folder, too.

    Parameters
    ----------
    read : callable
        Takes the path and returns a :class:`~sd2core.io.radar.capture.RadarCapture`; one of meshes
        takes a :class:`MeshHints` as well and returns a
        :class:`~sd2core.io.mesh_arrays.RawMesh`.
    suffixes : tuple of str
        How the names of such files end, in lower case.
    recognises : callable, optional
        Takes the path and tells, at little cost, if it is such a file.
    """

    read: Callable[..., Content]
    suffixes: tuple[str, ...] = ()
    recognises: Callable[[Path], bool] | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.suffixes, tuple):
            raise Sd2Error(f"The suffixes are {self.suffixes!r}", 'a tuple, such as (".abc",)')
        if not (self.suffixes or self.recognises):
            raise Sd2Error("A reader is for no files", "suffixes, or recognises")

    def fits(self, path: Path) -> bool:
        """True if a file is to be read by it."""
        if self.suffixes and not path.name.lower().endswith(self.suffixes):
            return False
        return self.recognises is None or self.recognises(path)


@dataclass(frozen=True)
class MeshHints:
    """Options of the user about a mesh file, see :func:`~sd2core.io.mesh.load_mesh`."""

    person: int | str | None = None
    image_size: tuple[int, int] | None = None
    focal_px: float | None = None
    distance_m: float | None = None
    body_model: Path | None = None
    progress: Progress = silent


MESH_FILES: Group[FileReader[RawMesh]] = Group("mesh_files", FileReader)
RADAR_FILES: Group[FileReader[RadarCapture]] = Group("radar_files", FileReader)


def plug_in_for(
    path: Path, group: Group[FileReader[Content]]
) -> tuple[PlugIn[FileReader[Content]] | None, str]:
    """Plug-in that reads a file, if there is one; without one, what is wrong with others.

    Raises Sd2Error if several would read it.
    """
    fitting, faults = [], []
    for plug_in in group.entries:
        try:
            if plug_in.use(lambda reader: reader.fits(path), bool):
                fitting.append(plug_in)
        except Sd2Error as error:
            faults.append(str(error))
    if len(fitting) > 1:
        packages = " and ".join(one.package for one in fitting)
        raise Sd2Error(f"{path} is read by plug-ins of {packages}", "one", "Uninstall the other")
    return (fitting[0] if fitting else None), " ".join(faults)


def suffixes_of(group: Group[FileReader[Content]]) -> set[str]:
    """How the names of files end that plug-ins read."""
    readers = [reader for _, reader in group.loaded() if isinstance(reader, FileReader)]
    return {suffix for reader in readers for suffix in reader.suffixes}
