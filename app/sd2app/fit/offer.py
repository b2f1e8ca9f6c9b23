"""The offer to fit a body where there is a video and no mesh."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QObject, Signal

from sd2app.fit.model import FitModel
from sd2app.session.document import DocumentModel


class FitOffer(QObject):
    """Offer that stands until it is accepted, declined, or a mesh exists."""

    changed = Signal()

    def __init__(
        self, document: DocumentModel, fit: FitModel, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._document = document
        self._fit = fit
        self._declined: set[Path] = set()
        document.changed.connect(self.changed)
        fit.changed.connect(self.changed)

    @property
    def video(self) -> Path | None:
        """The video that is offered, None where there is nothing to offer."""
        content = self._document.content
        if content is None or content.video is None or content.recording.mesh is not None:
            return None
        video = content.recording.video
        if video is None or video in self._declined or self._fit.state != "idle":
            return None
        return video

    def decline(self) -> None:
        """Offer no more for this video."""
        if self.video is not None:
            self._declined.add(self.video)
            self.changed.emit()
