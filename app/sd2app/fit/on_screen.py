"""A fit and the open recording: what is offered, what the clock follows, and the result."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, QTimer, Signal

from sd2app.fit.model import FitModel
from sd2app.fit.request import FitRequest
from sd2app.session.session import Session
from sd2core.errors import Sd2Error
from sd2core.files.paths import plain_path
from sd2core.files.recording_json import CameraEntry
from sd2core.io.fitted import fitted_camera
from sd2core.mesh.bodies import Body
from sd2core.recording.recording import FILE_NAME, Recording, open_recording


class FitOnScreen(QObject):
    """Offers a fit where there is a video and no mesh, shows its frames, and opens its result.

    The clock follows the frame under way until the user moves it. The recording is made as soon
    as its mesh is there, and opened where nothing else is in use.
    """

    changed = Signal()
    noted = Signal(str)  # remarks of the fit, once its recording is on screen

    def __init__(self, session: Session, fit: FitModel, parent: QObject) -> None:
        super().__init__(parent)
        self._settings, self._document = session.settings, session.document
        self._playback, self._fit = session.playback, fit
        self._declined: set[Path] = set()
        self.following = True
        self._moving = False
        self._notes = ""
        fit.advanced.connect(self._follow)
        fit.state_changed.connect(self._restart)
        fit.finished.connect(self._take)
        for signal in (fit.changed, session.document.changed):
            signal.connect(self.changed)
        for signal in (session.playback.frame_changed, session.playback.playing_changed):
            signal.connect(self._notice)
        session.document.opened.connect(self._tell)

    @property
    def offered(self) -> Path | None:
        """Video to which a body could be fitted; None where there is nothing to offer."""
        content = self._document.content
        if content is None or content.video is None or content.recording.mesh is not None:
            return None
        video = content.recording.video
        if video is None or video in self._declined or self._fit.state != "idle":
            return None
        return video

    def decline(self) -> None:
        """Offer no more for this video."""
        if self.offered is not None:
            self._declined.add(self.offered)
            self.changed.emit()

    @property
    def visible(self) -> bool:
        """True if the window shows the video of the fit."""
        request, recording = self._fit.request, self._document.recording
        if request is None or recording is None or recording.video is None:
            return False
        return plain_path(recording.video) == request.video

    @property
    def under_way(self) -> str:
        """Sentence on the run that makes the mesh of the video on screen; empty without one."""
        if not (self._fit.busy and self.visible):
            return ""
        return "A body is being fitted to this video: its synthetic Doppler comes with it."

    def set_following(self, following: bool) -> None:
        """Follow the frame under way, or stop following."""
        if following != self.following:
            self.following = following
            self.changed.emit()

    def _follow(self, frame: int) -> None:
        video = self._document.video
        if not (self.following and self.visible) or video is None or frame >= len(video):
            return
        self._moving = True
        try:
            self._playback.seek(video.timebase.time_of(frame))
        finally:
            self._moving = False

    def _restart(self) -> None:
        if self._fit.state == "running":
            self.set_following(True)

    def _notice(self) -> None:
        if not self._moving and self._fit.busy and self._document.content is not None:
            self.set_following(False)

    def open_result(self) -> None:
        """Open the recording that was made."""
        request = self._fit.request
        if request is None or self._fit.state != "finished":
            return
        self._notes = self._fit.notes
        self._fit.dismiss()
        self._document.open([request.folder])

    def _take(self, request: FitRequest) -> None:
        recording, progress = self._document.recording, self._fit.progress
        try:
            made = make_recording(request, progress.size if progress else None, recording)
        except (Sd2Error, OSError) as error:
            self._fit.report_failure(str(error))
            return
        self._settings.add_recent(made.folder)
        waiting = self.visible and recording is not None and recording.mesh is None
        if recording is not None and recording.folder == made.folder:
            # Saving what is open must not take the mesh away again.
            recording.mesh, recording.camera = made.mesh, made.camera
            recording.bodies, recording.subject = made.bodies, made.subject
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
    labels and sensor are taken along. People but the first are other bodies of its scene; all
    are called by their numbers, unless the recording says who the first is.
    Raises Sd2Error or OSError if it cannot be written.
    """
    camera = fitted_camera(request.mesh)
    if camera is None and request.focal_px is not None:
        width, height = size or (None, None)
        camera = CameraEntry(focal_px=request.focal_px, width=width, height=height, source="user")
    # With the video's name: data sets take recordings of one name for one person.
    names = [f"person {number} of {request.video.stem}" for number in request.people]
    others = zip(request.meshes[1:], names[1:], strict=True)
    bodies = tuple(Body(str(mesh), person=name) for mesh, name in others)
    given: dict[str, Any] = {"mesh": request.mesh, "camera": camera}
    if bodies:
        given["subject"] = names[0]
    if (request.folder / FILE_NAME).exists():
        recording = _with_meshes(open_recording(request.folder), given, bodies)
        recording.save()
    elif base is not None and _awaits_mesh(base, request.video):
        recording = _with_meshes(replace(base, title=request.folder.stem), given, bodies)
        recording = recording.save_as(request.folder)
    else:
        recording = Recording.create(request.folder, video=request.video, bodies=bodies, **given)
    request.forget()
    return recording


def _with_meshes(
    recording: Recording, given: dict[str, Any], bodies: tuple[Body, ...]
) -> Recording:
    """Copy of a recording with the meshes that it awaited; its subject stays."""
    kept = {"subject": recording.subject} if recording.subject else {}
    return replace(recording, bodies=(*recording.bodies, *bodies), **given | kept)


def _awaits_mesh(recording: Recording, video: Path) -> bool:
    """True if a recording is of this video and has no mesh."""
    if recording.video is None or recording.mesh is not None:
        return False
    return plain_path(recording.video) == plain_path(video)
