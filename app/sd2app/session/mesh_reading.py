"""Reading of the open recording's mesh, again where its file or the way to read it changes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import BackgroundModel, Emit
from sd2app.session.content import OfferedCure, offers_of, words_of
from sd2app.session.tasks import ListedRunner, TaskList
from sd2core.errors import Sd2Error, of_the_system
from sd2core.io.bodies import with_bodies
from sd2core.mesh.bodies import Body
from sd2core.mesh.sequence import MeshSequence
from sd2core.recording.edited import MESH
from sd2core.recording.recording import Recording

_KEPT = 2
"""Meshes that are kept: that on screen, and the one that an undo brings back."""


@dataclass(frozen=True, eq=False)
class ReadMesh:
    """A mesh, or none and why it could not be read, and the recording's fields that say which."""

    fields: dict[str, Any]
    mesh: MeshSequence | None
    offers: tuple[OfferedCure, ...] = ()
    problem: str = ""


def mesh_fields(recording: Recording) -> dict[str, Any]:
    """Fields of a recording on which its mesh depends."""
    return {name: getattr(recording, name) for name in MESH}


def read_mesh(asked: Recording, emit: Emit) -> ReadMesh:
    """Read the mesh of a recording, whose camera it may bring; ``emit`` gets how much is read."""
    try:
        asked.learn_camera()
        mesh = asked.load_mesh(lambda done, total: emit((done, total)))
    except (Sd2Error, OSError) as error:
        told = error if isinstance(error, Sd2Error) else of_the_system(error)
        return ReadMesh(mesh_fields(asked), None, offers_of([told]), told.words)
    return ReadMesh(mesh_fields(asked), mesh, offers_of(mesh.findings))


class MeshReader(BackgroundModel):
    """Reads meshes in the background, and keeps the last ones."""

    ready = Signal(object)  # ReadMesh of the fields that were followed
    failed = Signal(str)

    def __init__(self, jobs: TaskList, parent: QObject) -> None:
        super().__init__(parent)
        self._kept: list[ReadMesh] = []  # the newest first
        self._jobs = jobs
        self._bodies: list[tuple[Body, ListedRunner]] = []  # and what reads the file of each
        self._runner = ListedRunner("mesh", jobs, self, self._receive, self._say)

    def reset(self, read: ReadMesh) -> None:
        """Begin with the mesh of another recording."""
        for runner in self.findChildren(ListedRunner):
            runner.cancel()
        self._kept = [read]

    def keep(self, read: ReadMesh) -> None:
        """Have a mesh ready, the last but one no more."""
        others = [one for one in self._kept if one.fields != read.fields]
        self._kept = [read, *others][:_KEPT]

    def read(
        self, recording: Recording, fields: Mapping[str, Any], then: Callable[..., object]
    ) -> None:
        """Read a mesh by other fields, and call ``then`` with all that it depends on.

        It is then kept, so that it is there at once where these fields are followed.
        """

        def take(read: ReadMesh) -> None:
            if read.mesh is not None:
                self.keep(read)
                then(read.fields)

        self._submit(replace(recording, **fields), take)

    def read_body(self, mesh: MeshSequence, body: Body, then: Callable[[], object]) -> None:
        """Read the file of another body beside a mesh, and call ``then``: it is then at hand."""
        runner = ListedRunner("body", self._jobs, self, lambda _: then(), self._say)
        for done in (runner.finished, runner.failed):
            done.connect(lambda _: runner.close())
        self._bodies.append((body, runner))
        runner.submit(lambda emit: with_bodies(mesh, [body]), f"Reading {body.file_name}")

    def awaits(self, body: Body) -> bool:
        """True while the file of a body is read."""
        return any(one == body and runner.busy for one, runner in self._bodies)

    def follow(self, recording: Recording) -> None:
        """Say that the mesh of a recording's fields is ready, at once or once it is read."""
        fields = mesh_fields(recording)
        kept = next((one for one in self._kept if one.fields == fields), None)
        if kept is not None or recording.mesh is None:
            self._runner.cancel()
            self._tell(kept or ReadMesh(fields, None))
        else:
            self._submit(replace(recording), self._tell)

    def _submit(self, asked: Recording, take: Callable[[ReadMesh], object]) -> None:
        name = "" if asked.mesh is None else asked.mesh.name
        self._runner.submit(lambda emit: (take, read_mesh(asked, emit)), f"Reading {name}")

    def _receive(self, result: tuple[Callable[[ReadMesh], object], ReadMesh]) -> None:
        take, read = result
        take(read)
        if read.problem:
            self.failed.emit(read.problem)

    def _say(self, error: Exception) -> None:
        self.failed.emit(words_of(error))

    def _tell(self, read: ReadMesh) -> None:
        self.keep(read)
        self.ready.emit(read)
