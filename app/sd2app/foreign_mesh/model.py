"""A mesh of another program as it is read by what the user says of it, before it is taken."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PySide6.QtCore import QObject

from sd2app.background.latest import LatestRunner
from sd2app.session.content import OfferedCure, ReadMesh, camera_of, notes_of, read_mesh
from sd2app.session.video_frames import VideoFrames
from sd2core.body.camera import PinholeCamera
from sd2core.errors import Cure
from sd2core.files.recording_json import MeshReading
from sd2core.io.fitted import fitted_camera
from sd2core.io.mesh_models import persons_in
from sd2core.mesh.sequence import MeshSequence
from sd2core.recording.recording import Recording


def is_foreign(mesh: Path) -> bool:
    """True for a mesh that ``sd2 fit`` has not made."""
    return fitted_camera(mesh) is None


class MeshPreview(VideoFrames):
    """The mesh of a recording that is not open yet, and one frame of its video.

    Its ``mesh_reading`` and ``camera`` are tried out here; the recording stays as it is.
    """

    def __init__(self, recording: Recording, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.recording, self._camera = replace(recording), recording.camera
        self.persons: dict[str, int] = {}  # with their numbers of frames; empty while unknown
        self.mesh: MeshSequence | None = None  # as it is read now; None while it cannot be
        self.mesh_problem = ""
        self.offers: tuple[OfferedCure, ...] = ()
        self._loader = LatestRunner("mesh to look at", self, self._take_mesh, self._refuse)
        self._read()
        if recording.video is not None:
            self.open_video(recording.video)

    @property
    def read_as(self) -> MeshReading:
        """How the mesh is read."""
        return self.recording.mesh_reading

    @property
    def loading(self) -> bool:
        """True while the mesh is being read."""
        return self._loader.busy

    @property
    def camera(self) -> PinholeCamera:
        """The camera by which the mesh is laid over the picture."""
        return camera_of(self.recording, self.reader)

    @property
    def notes(self) -> str:
        """Notes on what was assumed or repaired, or is unlikely and has no remedy."""
        return "" if self.mesh is None else "\n\n".join(notes_of(self.mesh))

    @property
    def someone(self) -> bool:
        """True if a person is in the frame."""
        return self.mesh is not None and self.mesh.person_at(self.time_s) is not None

    @property
    def taken(self) -> ReadMesh | None:
        """The mesh as it would be taken; None while there is none."""
        return None if self.mesh is None or self.loading else self._seen

    def first_frame(self) -> int:
        """The middle frame, or the one in the middle of those in which the mesh has somebody."""
        middle, mesh, reader = super().first_frame(), self.mesh, self.reader
        if mesh is None or reader is None:
            return middle
        frames = np.flatnonzero(mesh.presence.present)
        if not frames.size or mesh.person_at(reader.timebase.time_of(middle)) is not None:
            return middle
        return reader.timebase.nearest_frame(float(mesh.times_s[frames[len(frames) // 2]]))

    def change(self, **settings: Any) -> None:
        """Read it another way: fields of :class:`MeshReading`, None as the file says."""
        self._read_as(self.read_as.model_copy(update=settings))

    def accept(self, cure: Cure) -> None:
        """Read it with a setting that puts it right."""
        self._read_as(self.read_as.cured(cure))

    def set_faces(self, path: Path) -> None:
        """Take the triangles of another file."""
        self.recording.faces = path
        self._read()

    def _read_as(self, reading: MeshReading) -> None:
        if reading == self.read_as:
            return
        self.recording.mesh_reading = reading
        # A camera that is known would hide the focal length that is typed.
        self.recording.camera = self._camera if reading.focal_px is None else None
        self._read()

    def _read(self) -> None:
        asked, path, known = replace(self.recording), self.recording.mesh, self.persons
        assert path is not None
        self._loader.submit(lambda emit: (asked, known or persons_in(path), read_mesh(asked, emit)))
        self.changed.emit()

    def _take_mesh(self, seen: tuple[Recording, dict[str, int], ReadMesh]) -> None:
        asked, self.persons, self._seen = seen
        self.mesh, self.mesh_problem = self._seen.mesh, self._seen.problem
        self.offers = self._seen.offers
        if self.mesh is not None:
            self.recording = asked
            if not self.someone and self.frame == super().first_frame():
                self.show_frame(self.first_frame())  # the user has not looked elsewhere
        self.changed.emit()
