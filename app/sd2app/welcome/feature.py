"""The start page, and the tour of the sample."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QMainWindow

from sd2app.feature import Action, Feature, Shell
from sd2app.session.session import Session
from sd2app.welcome.callout import TourCallout
from sd2app.welcome.pictures import RecordingPictures
from sd2app.welcome.start_page import StartPage
from sd2app.welcome.tour import Step, TourModel
from sd2core.files.resources import is_bundled


class WelcomeFeature(Feature):
    """Ways to begin.

    Parameters
    ----------
    session : Session
    shell : Shell
    steps : sequence of Step
        Of the tour.
    open_sample : callable
    open_recent : callable
        Opens what was open together.
    pictures : Path
        Folder of the pictures of recordings.
    parent : QObject
    """

    def __init__(
        self,
        session: Session,
        shell: Shell,
        steps: Sequence[Step],
        open_sample: Callable[[], object],
        open_recent: Callable[[Sequence[Path]], object],
        pictures: Path,
        parent: QObject,
    ) -> None:
        self._session, self._shell, self._open_recent = session, shell, open_recent
        self.pictures = RecordingPictures(session, pictures, parent)
        self.tour = TourModel(steps, session.settings, self._sample_is_open, open_sample, parent)
        self.changing, self.closing = (self.tour.changed,), (self.pictures,)

    def actions(self) -> Sequence[Action]:
        """The start page and the tour."""
        shell, document = self._shell, self._session.document
        return (
            Action(
                "start_page", "File", "Start page", (),
                "Ways to begin, and what was open lately; what is open stays open",
                lambda: shell.show_start(not shell.starts),
                lambda: document.content is not None, checked=lambda: shell.starts,
            ),
            Action(
                "tour", "Help", "Tour of the sample", (),
                "Small steps by your own hand, from the first look to a trained model; goes on"
                " where you left it",
                self.tour.begin,
            ),
        )  # fmt: skip

    def start_page(self) -> StartPage:
        """Page to begin on."""
        settings, action = self._session.settings, self._shell.action
        back = partial(self._shell.show_start, False)
        return StartPage(settings, self.pictures, self.tour, action, self._open_recent, back)

    def callout(self, window: QMainWindow, label_key: Callable[[], str]) -> TourCallout:
        """The tour on a window."""
        return TourCallout(self.tour, window, self._shell.action, label_key)

    def attach(self) -> None:
        """Go on with the tour, or let it rest."""
        self.tour.follow_document()

    def _sample_is_open(self) -> bool:
        recording = self._session.document.recording
        return recording is not None and is_bundled(recording.folder)
