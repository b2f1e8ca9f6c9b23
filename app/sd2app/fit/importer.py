"""Import of a finished fit as a recording, opened where nothing else is in use."""

from __future__ import annotations

from PySide6.QtCore import QObject, QTimer, Signal

from sd2app.fit.clock import FitFollower
from sd2app.fit.model import FitModel
from sd2app.fit.request import FitRequest
from sd2app.fit.result import make_recording
from sd2app.session.document import DocumentModel
from sd2app.settings import Settings
from sd2core.errors import Sd2Error


class FitTaker(QObject):
    """Makes the recording as soon as its mesh is there.

    Signals
    -------
    noted : str
        What the fit had to say, once its recording is on screen.
    """

    noted = Signal(str)

    def __init__(
        self,
        fit: FitModel,
        follower: FitFollower,
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
