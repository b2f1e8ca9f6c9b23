"""Import of a finished fit as a recording, opened where nothing else is in use."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal

from sd2app.fit.clock import FitPlayback
from sd2app.fit.model import FitModel
from sd2app.fit.request import FitRequest
from sd2app.session.document import DocumentModel
from sd2app.settings import Settings
from sd2core.errors import Sd2Error
from sd2core.files.paths import plain_path
from sd2core.files.recording_json import CameraEntry
from sd2core.io.fitted import fitted_camera
from sd2core.recording.recording import FILE_NAME, Recording, open_recording


class FitResultImporter(QObject):
    """Makes the recording as soon as its mesh is there."""

    noted = Signal(str)  # remarks of the fit, once its recording is on screen

    def __init__(
        self,
        fit: FitModel,
        follower: FitPlayback,
        document: DocumentModel,
        settings: Settings,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._fit = fit
        self._follower = follower
        self._document = document
        self._settings = settings
        self._notes = ""
        fit.finished.connect(self._take)
        document.opened.connect(self._tell)

    def open_result(self) -> None:
        """Open the recording that was made."""
        request = self._fit.request
        if request is None or self._fit.state != "finished":
            return
        self._notes = " ".join(self._fit.notes)
        self._fit.dismiss()
        self._document.open([request.folder])

    def _take(self, request: FitRequest) -> None:
        recording = self._document.recording
        try:
            made = make_recording(request, self._fit.picture_size, recording)
        except (Sd2Error, OSError) as error:
            self._fit.report_failure(str(error))
            return
        self._settings.add_recent(made.folder)
        waiting = self._follower.on_screen and recording is not None and recording.mesh is None
        if recording is not None and recording.folder == made.folder:
            # Saving what is open must not take the mesh away again.
            recording.mesh, recording.camera = made.mesh, made.camera
        if self._document.content is None or (waiting and not self._document.modified):
            self.open_result()

    def _tell(self) -> None:
        if self._notes:
            notes, self._notes = self._notes, ""
            # After what opening has to say.
            QTimer.singleShot(0, self, lambda: self.noted.emit(notes))


def make_recording(
    request: FitRequest, size: tuple[int, int] | None, base: Recording | None
) -> Recording:
    """Record video, written mesh and camera of a request; ``size`` is (width, height) upright.

    ``base`` is the open recording: where it is of the same video and has no mesh, its radar,
    labels and sensor are taken along. Raises Sd2Error or OSError if it cannot be written.
    """
    camera = camera_of(request, size)
    if (request.folder / FILE_NAME).exists():
        recording = open_recording(request.folder)
        recording.mesh, recording.camera = request.mesh, camera
        recording.save()
    elif base is not None and awaits(base, request.video):
        title = request.folder.stem
        recording = replace(base, mesh=request.mesh, camera=camera, title=title)
        recording = recording.save_as(request.folder)
    else:
        recording = Recording.create(
            request.folder, video=request.video, mesh=request.mesh, camera=camera
        )
    request.forget()
    return recording


def awaits(recording: Recording, video: Path) -> bool:
    """True if a recording is of this video and has no mesh."""
    if recording.video is None or recording.mesh is not None:
        return False
    return plain_path(recording.video) == plain_path(video)


def camera_of(request: FitRequest, size: tuple[int, int] | None) -> CameraEntry | None:
    """The camera that the body was fitted with, as the mesh says."""
    stated = fitted_camera(request.mesh)
    if stated is not None:
        return stated
    if request.focal_px is None:
        return None
    width, height = size or (None, None)
    return CameraEntry(focal_px=request.focal_px, width=width, height=height, source="user")
