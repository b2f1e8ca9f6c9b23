"""What the window's plain panes hold, and the bars over them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtWidgets import QVBoxLayout

from sd2app.fit.bar import FitBar
from sd2app.labels.recovery_bar import LabelBar
from sd2app.maps.level_bar import LevelBar
from sd2app.maps.spectrum import Curve, SpectrumView
from sd2app.video.bar import VideoBar
from sd2app.video.view import VideoView

if TYPE_CHECKING:
    from sd2app.shell.file_dialogs import Dialogs
    from sd2app.shell.menus import ActionSet
    from sd2app.shell.wiring import Context

_COLOURS = ("synthetic", "denoised", "before", "real")


def video_pane(context: Context, actions: ActionSet) -> QVBoxLayout:
    """The video under its bar."""
    c = context
    layout = QVBoxLayout()
    layout.addWidget(VideoBar(c.overlay, actions))
    view = VideoView(c.video, c.document, c.playback, c.display, c.overlay, c.fit, c.fit_follower)
    layout.addWidget(view, 1)
    return layout


def spectrum_pane(context: Context, actions: ActionSet) -> QVBoxLayout:
    """The spectra of this frame over the levels of all maps."""
    c = context
    curves = tuple(Curve(track, colour) for track, colour in zip(c.tracks, _COLOURS, strict=True))
    layout = QVBoxLayout()
    layout.addWidget(SpectrumView(curves, c.playback, c.display, c.pointer), 1)
    layout.addWidget(LevelBar(c.display, c.tracks, actions["uncertain"]))
    return layout


def fit_bar(context: Context, dialogs: Dialogs) -> FitBar:
    """How far a fit is, and what can be done with it."""
    c = context
    return FitBar(
        c.fit,
        c.fit_follower,
        c.fit_offer,
        begin=dialogs.new_from_video,
        open_result=dialogs.open_fitted,
        resume=dialogs.resume_fit,
    )


def label_bar(context: Context, dialogs: Dialogs) -> LabelBar:
    """Labels that were not saved, and who else edits."""
    c = context
    return LabelBar(c.label_session, c.document, c.label_edits.restore, dialogs.recover_labels)
