"""The video and what is drawn over it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from PySide6.QtCore import QObject, SignalInstance
from PySide6.QtWidgets import QWidget

from sd2app.feature import Action, Feature, Shell
from sd2app.session.session import Session
from sd2app.video.overlay_settings import OverlayModel
from sd2app.video.view import LandmarksAt, VideoBar, VideoView
from sd2app.widgets.canvas import MenuPart
from sd2app.widgets.layouts import pane


class VideoFeature(Feature):
    """The picture with mesh and landmarks over it, which may differ after ``fit_signals``.

    ``offer_frame`` adds to its context menu what can be done with the frame on screen.
    """

    def __init__(
        self,
        session: Session,
        shell: Shell,
        landmarks_at: LandmarksAt,
        fit_signals: Sequence[SignalInstance],
        offer_frame: MenuPart,
        parent: QObject,
    ) -> None:
        self._session, self._shell = session, shell
        self._landmarks_at, self._fit_signals = landmarks_at, fit_signals
        self._offer_frame = offer_frame
        self.overlay = OverlayModel(session.settings, parent)
        session.video.failed.connect(shell.warn)
        self.changing = (self.overlay.changed,)
        self.closing = self.working = (session.video,)

    def actions(self) -> Sequence[Action]:
        """Mesh over the video."""
        overlay, has_mesh = self.overlay, self._session.has_mesh
        return (
            Action(
                "overlay", "View", "Mesh over the video", ("M",), "Draw the mesh over the video",
                lambda: overlay.set_style(shown=not overlay.style.shown), has_mesh,
                lambda: overlay.style.shown,
            ),
            Action(
                "overlay_dots", "View", "Mesh over the video as dots", ("Shift+M",),
                "Draw vertices over the video instead of the surface",
                lambda: overlay.set_style(as_dots=not overlay.style.as_dots),
                has_mesh, lambda: overlay.style.as_dots,
            ),
        )  # fmt: skip

    def panels(self) -> Mapping[str, QWidget]:
        """The video under its bar."""
        view = VideoView(self._session, self.overlay, self._landmarks_at, self._fit_signals)
        export = self._shell.action("export_strip")
        view.menu_parts = (self._offer_frame, lambda menu, _: menu.addAction(export))
        return {"video": pane(VideoBar(self.overlay, self._shell.action), (view, 1))}
