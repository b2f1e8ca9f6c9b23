"""The recording that is open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QUndoStack

from sd2app.background.latest import Emit, LatestRunner
from sd2app.session.content import Content, load_content, recording_of
from sd2app.session.denoiser_choice import DenoiserChoice
from sd2app.session.tasks import Job, TaskList
from sd2core.body.camera import PinholeCamera
from sd2core.labels.spans import Labels
from sd2core.maps import DopplerMap
from sd2core.mesh.sequence import MeshSequence
from sd2core.placements.placements import Placements
from sd2core.recording.recording import Recording
from sd2core.recording.relinking import Relinked
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

if TYPE_CHECKING:
    from sd2core.fmcw.processing import Clutter
    from sd2core.io.radar import RadarCapture
    from sd2core.io.video import VideoReader


class DocumentModel(QObject):
    """One recording, its parts, and the history of its edits."""

    opened = Signal()  # another recording, or none
    changed = Signal()  # something in it, or its place on disk
    saved = Signal()  # on disk with all edits, maybe in another place than before
    noted = Signal(str)
    failed = Signal(str)

    def __init__(self, jobs: TaskList, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.undo_stack = QUndoStack(self)
        self._jobs = jobs
        self._job: Job | None = None
        self._content: Content | None = None
        self._base: Recording | None = None
        self._goes_on = False
        self._clutter: Clutter = "mean"
        self._runner = LatestRunner("open", self)
        self._runner.partial.connect(self._report)
        self._runner.finished.connect(self._receive)
        self._runner.failed.connect(self._fail)
        self._maps = LatestRunner("radar", self)
        self._maps.finished.connect(self._receive_map)
        self._maps.failed.connect(lambda error: self.failed.emit(str(error)))

    # --- what is there --------------------------------------------------------------------

    @property
    def content(self) -> Content | None:
        """All parts, None when nothing is open."""
        return self._content

    @property
    def recording(self) -> Recording | None:
        """Description of what belongs together."""
        return self._content.recording if self._content else None

    @property
    def video(self) -> VideoReader | None:
        """Open video file."""
        return self._content.video if self._content else None

    @property
    def mesh(self) -> MeshSequence | None:
        """Moving mesh or point cloud."""
        return self._content.mesh if self._content else None

    @property
    def capture(self) -> RadarCapture | None:
        """Raw radar capture, on its own clock."""
        return self._content.capture if self._content else None

    @property
    def radar_map(self) -> DopplerMap | None:
        """Doppler map of the capture, on its own clock."""
        return self._content.radar_map if self._content else None

    @property
    def timebase(self) -> Timebase | None:
        """Frames of the recording's clock: the video's, else the mesh's, else the radar's."""
        return self._content.timebase if self._content else None

    @property
    def title(self) -> str:
        """Name on the window."""
        return self._content.recording.title if self._content else ""

    @property
    def simulated(self) -> bool:
        """True if the recording is simulated, without camera and radar."""
        return self._content is not None and self._content.recording.simulated

    @property
    def labels(self) -> Labels:
        """Labels of the recording, or those that its radar file brings where it has none."""
        content = self._content
        if content is None:
            return Labels()
        recording, brought = content.recording, content.radar_labels
        if recording.unlabelled and brought is not None:
            return brought.shifted(recording.radar_offset_s)
        return recording.labelled

    @property
    def camera(self) -> PinholeCamera:
        """The camera that took the video, by default one with the usual field of view."""
        if self._content is None or self._content.video is None:
            return PinholeCamera()
        width, height = self._content.video.width, self._content.video.height
        focal_px = self._content.recording.focal_px(width, height)
        if focal_px is None:
            return PinholeCamera.default(width, height)
        return PinholeCamera(width, height, focal_px)

    @property
    def clutter(self) -> Clutter:
        """Method that removes static echoes from the capture."""
        return self._clutter

    @property
    def modified(self) -> bool:
        """True if there are unsaved edits."""
        return self._content is not None and not self.undo_stack.isClean()

    @property
    def goes_on(self) -> bool:
        """True if the opened recording is the one that was open before, with other files."""
        return self._goes_on

    # --- opening --------------------------------------------------------------------------

    def open(self, paths: Sequence[Path]) -> None:
        """Open a recording, or files that make up one, in the background."""
        self._start(None, list(paths))

    def add(self, paths: Sequence[Path]) -> None:
        """Add files to the recording that is open, or open them."""
        recording = self.recording
        self._start(replace(recording) if recording is not None else None, list(paths))

    def reload(self) -> None:
        """Read all parts again, e.g. after files were found."""
        if self.recording is not None:
            self._start(self.recording, [])

    def cancel_opening(self) -> None:
        """Stop reading; what is open stays open."""
        self._runner.cancel()
        self._end_job()

    def close(self) -> None:
        """Stop all work and let go of the files."""
        self._runner.close()
        self._maps.close()
        if self._content is not None:
            self._content.close()
            self._content = None

    def _start(self, base: Recording | None, paths: list[Path]) -> None:
        name = paths[0].name if paths else (base.title if base else "")
        clutter = self._clutter
        self._base = base

        def read(emit: Emit) -> Content:
            recording = recording_of(paths, base) if paths or base is None else base
            return load_content(recording, clutter, lambda done, total: emit((done, total)))

        self._end_job()
        self._job = self._jobs.start(f"Opening {name}", self.cancel_opening)
        self._runner.submit(read)

    def _report(self, progress: Any) -> None:
        if self._job is not None:
            self._jobs.report(self._job, *progress)

    def _receive(self, content: Content) -> None:
        self._end_job()
        before, self._content = self._content, content
        if before is not None and before.video is not content.video:
            before.close()
        self._goes_on = before is not None and content.recording is self._base
        unsaved = self._goes_on and self.modified
        if before is not None and self._goes_on:
            _keep_edits(before.recording, content.recording)
        self.undo_stack.clear()
        if unsaved:
            self.undo_stack.resetClean()
        self.opened.emit()
        self.changed.emit()
        for problem in content.problems:
            self.failed.emit(problem)
        if content.notes:
            self.noted.emit(" ".join(content.notes))

    def _fail(self, error: Exception) -> None:
        self._end_job()
        self.failed.emit(str(error))

    def _end_job(self) -> None:
        if self._job is not None:
            self._jobs.finish(self._job)
            self._job = None

    # --- changing -------------------------------------------------------------------------

    def set_radar_offset(self, offset_s: float) -> None:
        """Align the capture: time of its first frame on the recording's clock."""
        recording = self.recording
        if recording is not None and offset_s != recording.radar_offset_s:
            recording.radar_offset_s = offset_s
            self.changed.emit()

    def set_denoiser(self, choice: DenoiserChoice) -> None:
        """Denoise with another model."""
        recording = self.recording
        if recording is not None and choice != DenoiserChoice.of(recording):
            choice.put_into(recording)
            self.changed.emit()

    def set_placements(self, placements: Placements | None) -> None:
        """Plan other places for sensors, or none."""
        recording = self.recording
        if recording is not None and placements != recording.placements:
            recording.placements = placements
            self.changed.emit()

    def set_clutter(self, clutter: Clutter) -> None:
        """Remove static echoes another way."""
        if clutter == self._clutter:
            return
        self._clutter = clutter
        capture = self.capture
        self.changed.emit()
        if capture is None:
            return

        def process(emit: Emit) -> DopplerMap:
            from sd2core.fmcw.processing import doppler_map

            return doppler_map(
                capture, axis=VelocityAxis(), clutter=clutter, progress=lambda *_: emit(None)
            )

        self._maps.submit(process)

    def _receive_map(self, radar_map: DopplerMap) -> None:
        if self._content is not None:
            self._content = replace(self._content, radar_map=radar_map)
            self.changed.emit()

    # --- saving ---------------------------------------------------------------------------

    def save(self) -> None:
        """Write the recording where it came from; Sd2Error or OSError if that fails."""
        if self._content is not None and self._content.saved:
            self._content.recording.save(self._content.timebase)
            self._tell_saved()

    def save_as(self, folder: Path) -> None:
        """Make a recording folder that refers to the files where they are."""
        if self._content is None:
            return
        title = "" if not self._content.saved else self.title
        made = replace(self._content.recording, title=title).save_as(
            folder, timebase=self._content.timebase
        )
        self._content = replace(self._content, recording=made)
        self._tell_saved()

    def relink(self, folder: Path) -> Relinked | None:
        """Look for missing files under one folder, and read again what was found."""
        if self.recording is None:
            return None
        relinked = self.recording.relink(folder)
        if relinked.found:
            if self._content is not None and self._content.saved:
                self._tell_saved()
            self.reload()
        return relinked

    def read_labels_again(self) -> None:
        """Take over labels that another program has written; Sd2Error if the file is damaged."""
        if self._content is not None and self._content.saved:
            self._content.recording.read_labels_again()

    def _tell_saved(self) -> None:
        self.undo_stack.setClean()
        self.saved.emit()
        self.changed.emit()


def _keep_edits(before: Recording, after: Recording) -> None:
    """Apply edits made while files were read to what was read."""
    kept = "labels", "sensor", "placements", "radar_offset_s", "denoiser", "bundled_denoiser"
    for name in kept:
        setattr(after, name, getattr(before, name))
