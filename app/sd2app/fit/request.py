"""Request for a fit: video, choices and folder; on disk until the recording is made."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

from pydantic import TypeAdapter

from sd2core.cli.fit import Fit
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.paths import free_path, plain_path, remove
from sd2core.files.texts import read_json
from sd2core.options.fitting import meshes_of
from sd2core.options.records import words_of
from sd2core.recording.recording import FILE_NAME, SUFFIX, open_recording

REQUEST_NAME = "fit-request.json"
RUN_NAME = "fit-run"
LOCK_NAME = "fit.lock"
"""File of earlier versions."""
MESH_NAME = "mesh.zarr"
_VERSION = 1
_SAME_FOCAL_PX = 0.01


@dataclass(frozen=True)
class Person:
    """A rectangle around the person in one frame, in pixels of the upright picture."""

    frame: int
    x: int
    y: int
    width: int
    height: int

    @property
    def box(self) -> tuple[float, float, float, float]:
        """The rectangle: left, top, width, height."""
        return self.x, self.y, self.width, self.height


@dataclass(frozen=True)
class FitRequest:
    """One body from one video."""

    video: Path
    folder: Path  # the recording NAME.sd2: to be made, or one of this video without a mesh
    stature_m: float | None = None  # None: estimated
    focal_px: float | None = None  # upright picture; None: from the file, or usual field of view
    person: Person | None = None  # None: the one seen best
    people: tuple[int, ...] = ()  # or people by their numbers, see `sd2 fit --people list`
    mesh_name: str = MESH_NAME  # in the folder

    @property
    def meshes(self) -> list[Path]:
        """The meshes to be written, one of each person."""
        return meshes_of(self.folder / self.mesh_name, self.people)

    @property
    def mesh(self) -> Path:
        """The first of them."""
        return self.meshes[0]

    @property
    def made(self) -> bool:
        """True if all are written."""
        return all(mesh.exists() for mesh in self.meshes)

    @property
    def partials(self) -> list[Path]:
        """Partial results of a stopped fit, from which it continues."""
        return [mesh.with_name(f"{mesh.name}.partial") for mesh in self.meshes]

    @property
    def run(self) -> Path:
        """Folder of the process."""
        return self.folder / RUN_NAME

    def arguments(self) -> list[str]:
        """Command line of the request, whose progress can be followed."""
        # A mesh of this name in the folder is of a fit before.
        out = self.folder / self.mesh_name
        command = replace(self.command(out), overwrite=True, progress_json=True)
        return words_of("fit", command)

    def command(self, out: Path) -> Fit:
        """Options of ``sd2 fit`` for the same mesh at any place."""
        person = self.person
        return Fit(
            video=self.video,
            out=out,
            stature_m=None if self.stature_m is None else round(self.stature_m, 3),
            focal_px=None if self.focal_px is None else round(self.focal_px, 2),
            person_box=None if person is None else person.box,
            person_frame=None if person is None else person.frame,
            people=tuple(map(str, self.people)),
        )

    def asks_the_same(self, other: FitRequest) -> bool:
        """True if the work of the other request can be continued for this one."""
        focal_px, other_px = self.focal_px or 0.0, other.focal_px or 0.0
        there = replace(other, folder=self.folder, mesh_name=self.mesh_name)
        same = replace(there, focal_px=self.focal_px) == self
        return same and abs(focal_px - other_px) < _SAME_FOCAL_PX

    def save(self) -> None:
        """Keep it in its folder, which is made; what was done for other choices goes."""
        kept = read_request(self.folder)
        if kept is not None and not self.asks_the_same(kept):
            kept.remove_partials()
        self.folder.mkdir(exist_ok=True)
        content = _REQUEST.dump_python(self, mode="json", exclude={"folder"})
        text = json.dumps(content | {"version": _VERSION}, indent=2)
        atomic_write_text(self.folder / REQUEST_NAME, text + "\n")

    def forget(self) -> None:
        """Remove what was kept; the recording is made."""
        for name in (REQUEST_NAME, LOCK_NAME):
            (self.folder / name).unlink(missing_ok=True)
        remove(self.run)

    def remove_partials(self) -> None:
        """Remove partial results, and of several people the meshes that were done before."""
        for partial in self.partials:
            remove(partial)
        if len(self.people) > 1 and not self.made:
            for mesh in self.meshes:
                remove(mesh)

    def discard(self) -> None:
        """Remove all that a stopped fit has left."""
        self.remove_partials()
        self.forget()
        if self.folder.is_dir() and not any(self.folder.iterdir()):
            self.folder.rmdir()

    @property
    def to_open(self) -> Path:
        """Path that shows the video: the recording where there is one, or the file."""
        return self.folder if (self.folder / FILE_NAME).exists() else self.video

    @property
    def unfinished(self) -> bool:
        """True if there is a fit to continue, or a mesh without its recording."""
        return (self.folder / REQUEST_NAME).exists() and self.video.exists()


_REQUEST = TypeAdapter(FitRequest)


def read_request(folder: Path) -> FitRequest | None:
    """The request that a folder keeps; None where there is none that can be read."""
    try:
        content = read_json(folder / REQUEST_NAME)
        known = content["version"] == _VERSION
        return (
            _REQUEST.validate_python({**content, "folder": plain_path(folder)}) if known else None
        )
    except (Sd2Error, ValueError, KeyError, TypeError):
        return None


def settled(request: FitRequest) -> FitRequest:
    """The request with full paths, its folder a recording that can take the mesh.

    Raises Sd2Error if the folder cannot be made, or is a recording of something else.
    """
    folder = plain_path(request.folder)
    if folder.suffix != SUFFIX:
        folder = folder.with_name(folder.name + SUFFIX)
    video = plain_path(request.video)
    if not folder.parent.is_dir():
        raise Sd2Error(f"The folder {folder.parent} does not exist", "an existing folder")
    if folder.exists() and not folder.is_dir():
        raise Sd2Error(f"{folder} is a file", "the name of a new recording")
    if (folder / FILE_NAME).exists():
        recording = open_recording(folder)
        if recording.video is None or plain_path(recording.video) != video:
            raise Sd2Error(
                f"{folder} is a recording of something else", "a new name", "Choose another name"
            )
        if recording.mesh is not None:
            raise Sd2Error(
                f"{folder} has a mesh already", "a new name", "Save the new recording elsewhere"
            )
    kept = read_request(folder)
    if kept is not None and kept.video == video:
        return replace(request, video=video, folder=folder, mesh_name=kept.mesh_name)
    # An existing mesh belongs to the user.
    name = free_path(folder, MESH_NAME, "fitted", reserved=FILE_NAME).name
    return replace(request, video=video, folder=folder, mesh_name=name)
