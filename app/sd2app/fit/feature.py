"""Fitting a body to a video: dialogs, progress bar, result, and what is seen meanwhile."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QTimer, Signal
from PySide6.QtWidgets import QLabel, QWidget

from sd2app.feature import Action, Feature, Shell
from sd2app.fit.dialog import VIDEOS, NewFromVideoDialog
from sd2app.fit.model import FitModel
from sd2app.fit.request import FitRequest
from sd2app.fit.setup import FitSetupModel
from sd2app.session.session import Session
from sd2app.widgets.dialogs import Answer, accepted, ask_file, confirmed, may_delete
from sd2app.widgets.notices import Notice
from sd2app.widgets.panel import ElidedLabel, ProgressBar, StateBar, sentence
from sd2app.widgets.text import about
from sd2core.errors import Sd2Error
from sd2core.files.paths import plain_path
from sd2core.files.recording_json import CameraEntry
from sd2core.io.fitted import fitted_camera
from sd2core.mesh.bodies import Body
from sd2core.recording.recording import FILE_NAME, Recording, open_recording
from sd2core.runs.command_folder import COMMAND_IN_FOLDER


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
        fit.changed.connect(self._follow)
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

    def _follow(self) -> None:
        video, progress = self._document.video, self._fit.progress
        frame = None if progress is None or not self._fit.busy else progress.newest
        if not (self.following and self.visible) or video is None or frame is None:
            return
        self._moving = True
        try:
            self._playback.seek(video.timebase.time_of(min(frame, len(video) - 1)))
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


_STATES = {
    "running": ("Fitting a body to {video}", ("follow", "cancel")),
    "cancelling": ("Cancelling…", ("follow", "cancel")),
    "stopped": ("The fit of {video} was stopped", ("change", "resume", "discard", "close")),
    "failed": ("The fit of {video} failed", ("change", "resume", "close")),
    "finished": ("{made} is ready", ("open", "close")),
}
"""What a fit's state is called, and the buttons that are of use then."""


class FitOffer(Notice):
    """Offers to fit a body where there is a video and no mesh; ``begin`` asks what it needs."""

    def __init__(self, on_screen: FitOnScreen, begin: Callable[[], None]) -> None:
        tip = "Choose person, height and place"
        buttons = (("begin", "Fit a body…", tip, begin),)
        super().__init__("Offer of a fit", buttons, on_screen.decline)
        self._on_screen = on_screen
        on_screen.changed.connect(self._refresh)

    def _refresh(self) -> None:
        video = self._on_screen.offered
        if video is None:
            self.show_words("", "")
        else:
            text = "A body can be fitted to the person in it."
            self.show_words(f"{video.name} has no mesh", text)


class FitBar(StateBar):
    """Progress and end of a fit; hidden otherwise."""

    def __init__(self, feature: FitFeature) -> None:
        super().__init__("Fit of a body")
        self._fit, self._on_screen = fit, on_screen = feature.model, feature.on_screen
        self._title = ElidedLabel(self, "title")
        self._stage = ElidedLabel(self, "muted")
        self._reason = sentence("", "warning")
        self._bar = ProgressBar("", width_px=200)
        self._left = QLabel(self)
        self._left.setObjectName("muted")
        self._left.setMinimumWidth(self._left.fontMetrics().horizontalAdvance("about 55 min left"))
        buttons = {
            # First, so that it never comes to where another button was.
            "discard": ("Discard…", "Delete what was done", feature.discard),
            "change": ("Change…", "Choose person, height and place again", feature.new_from_video),
            "follow": ("Follow", "Show each frame as it is worked on", self._follow),
            "cancel": ("Cancel", "Stop; what is done can be continued", fit.cancel),
            "resume": ("Resume", "Continue where it stopped", feature.resume),
            "open": ("Open", "Open the new recording", feature.open_result),
            "close": ("✕", "Close this message", fit.dismiss),
        }
        parts = (self._title, (self._reason, 1), (self._stage, 1), self._bar, self._left)
        self.lay_out(parts, buttons, spacing_px=8)
        self._buttons["follow"].setCheckable(True)
        on_screen.changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        fit, state, request = self._fit, self._fit.state, self._fit.request
        self.setVisible(state != "idle")
        if state == "idle" or request is None:
            return
        words, buttons = _STATES[state]
        self.show_buttons(buttons)
        self._title.setText(words.format(video=request.video.name, made=request.folder.name))
        self._stage.setText(self._stage_text())
        self._reason.setText(fit.text)
        self._reason.setVisible(state == "failed")
        self._stage.setVisible(state != "failed")
        self._buttons["resume"].setText("Try again" if state == "failed" else "Resume")
        self._buttons["cancel"].setEnabled(state == "running")
        self._buttons["follow"].setChecked(self._on_screen.following)
        self._buttons["follow"].setEnabled(self._on_screen.visible)
        self._bar.setVisible(fit.busy)
        self._left.setVisible(fit.busy)
        self._show_progress()

    def _stage_text(self) -> str:
        progress, state = self._fit.progress, self._fit.state
        if state == "finished":
            return self._fit.notes or "A body was fitted to its video."
        if state == "stopped":
            reached = f" It had been {progress.text}." if progress and progress.stage else ""
            return f"It can be continued where it stopped.{reached}"
        return progress.text if progress is not None else ""

    def _show_progress(self) -> None:
        progress = self._fit.progress
        share = progress.share if progress is not None else None
        if share is None and progress is not None and progress.total:
            share = progress.done / progress.total  # the models, before the video is open
        self._bar.show_share(share)
        left_s = progress.left_s if progress and self._fit.state == "running" else None
        self._left.setText("" if left_s is None else f"{about(left_s)} left")

    def _follow(self) -> None:
        self._on_screen.set_following(self._buttons["follow"].isChecked())


class FitFeature(Feature):
    """A fit in a background process, from the question for its video to its recording."""

    def __init__(self, session: Session, shell: Shell, command: Sequence[str] | None) -> None:
        self._session, self._shell = session, shell
        self.model = FitModel(session.settings, session.parent, command or COMMAND_IN_FOLDER)
        self.on_screen = FitOnScreen(session, self.model, session.parent)
        self.on_screen.noted.connect(shell.note)
        self.changing = (self.model.state_changed,)
        self.closing = self.running = (self.model,)  # a fit stops, and can be continued

    def landmarks_at(self, frame: int) -> NDArray[np.float32] | None:
        """Landmarks that the fit has found in a frame of the video on screen."""
        if self.model.state == "idle" or not self.on_screen.visible:
            return None
        return self.model.landmarks_at(frame)

    def actions(self) -> Sequence[Action]:
        """A new recording from a video."""
        return (
            Action(
                "new_from_video", "File", "New from video…", ("Ctrl+N",),
                "Fit a body to the person in a video and make a recording of both",
                self.new_from_video, lambda: not self.model.busy,
            ),
        )  # fmt: skip

    def bars(self) -> Sequence[QWidget]:
        """Progress of the fit, and what can be done with it."""
        return (FitBar(self),)

    def notices(self) -> Sequence[Notice]:
        """Offer of a fit."""
        return (FitOffer(self.on_screen, self.new_from_video),)

    def attach(self) -> None:
        """Follow the fit again: staying elsewhere was a wish about the recording before."""
        self.on_screen.set_following(True)

    def new_from_video(self, video: Path | None = None) -> None:
        """Ask for the settings of a fit, begin it, and show its video.

        The video is that of a fit that was stopped or failed, or the one that is open where
        it has no mesh; else it is asked for.
        """
        window, model = self._shell.dialog_parent, self.model
        video = video or self.on_screen.offered
        if model.state in ("stopped", "failed") and model.request is not None:
            video = model.request.video
        if video is None:
            video = ask_file(window, "Video of a person", VIDEOS)
            if video is None:
                return
        setup = FitSetupModel(window)
        setup.choose_video(video, self._session.document.recording)
        dialog = NewFromVideoDialog(setup, self._session.display.palette, window)
        request = setup.request() if accepted(dialog) and setup.ready else None
        setup.close()
        setup.deleteLater()
        if request is not None:
            self._begin(request)

    def _begin(self, request: FitRequest) -> None:
        if self._shell.attempt(lambda: (self.model.start(request), True)) is None:
            return
        if not self.on_screen.visible and self._shell.may_discard():
            self._session.document.open([request.to_open])

    def resume(self) -> None:
        """Continue a stopped fit; where nothing else is open, its video is."""
        if self._shell.attempt(lambda: (self.model.resume(), True)) is None:
            return
        if not self._session.has_content() and self.model.busy and self.model.request:
            self._session.document.open([self.model.request.to_open])

    def discard(self) -> None:
        """Ask whether what was done may be deleted, and delete it."""
        request, progress = self.model.request, self.model.progress
        if request is None:
            return
        reached = f" It had been {progress.text}." if progress and progress.stage else ""
        what = (
            f"What the fit of {request.video.name} has done is deleted and cannot be brought"
            f" back.{reached} Resume would continue it from there."
        )
        if may_delete(self._shell.dialog_parent, "Discard this fit?", what):
            self.model.discard()

    def open_result(self) -> None:
        """Open the recording of a finished fit."""
        if self._shell.may_discard():
            self.on_screen.open_result()

    def may_close(self) -> bool:
        """Ask whether a fit under way may stop with the window."""
        request = self.model.request
        if not self.model.busy or request is None:
            return True
        words = (
            f"A body is being fitted to {request.video.name}. It stops with the window and can"
            " be continued when the program is started again."
        )
        return confirmed(self._shell.dialog_parent, "Stop the fit?", words, Answer.Ok)
