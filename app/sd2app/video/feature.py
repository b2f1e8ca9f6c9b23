"""The video and what is drawn over it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QPointF, QRectF, QSignalBlocker, Qt, Signal, SignalInstance
from PySide6.QtGui import QAction, QColor, QPainter, QPen
from PySide6.QtWidgets import QSlider, QWidget

from sd2app.feature import Action, Feature, Shell
from sd2app.session.session import Session
from sd2app.settings import Settings, StoredChoices
from sd2app.widgets.canvas import Canvas, MenuPart, clipped
from sd2app.widgets.inputs import action_button
from sd2app.widgets.layouts import STRETCH, pane, row_of
from sd2app.widgets.mesh_painting import draw_mesh, paint_picture
from sd2app.widgets.panel import title
from sd2core.body.track import LANDMARKS


@dataclass(frozen=True)
class OverlayStyle:
    """Style of the mesh over the video."""

    shown: bool = True
    opacity: float = 0.5  # from 0 (invisible) to 1 (it hides the person)
    as_dots: bool = False  # vertices instead of the surface


class OverlayModel(QObject):
    """Choices that change no data and are the user's own, not the recording's."""

    changed = Signal()

    def __init__(self, settings: Settings, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._stored = StoredChoices(settings, "overlay", vars(OverlayStyle()))
        if not 0 <= self._stored["opacity"] <= 1:
            self._stored.set("opacity", OverlayStyle.opacity)

    @property
    def style(self) -> OverlayStyle:
        """Style of the mesh."""
        return OverlayStyle(**{name: self._stored[name] for name in self._stored.defaults})

    def set_style(self, **changes: float) -> None:
        """Change some of it, and remember it."""
        if "opacity" in changes:
            changes["opacity"] = min(max(changes["opacity"], 0.0), 1.0)
        changed = [self._stored.set(name, value) for name, value in changes.items()]
        if any(changed):
            self.changed.emit()


_LIMBS = (
    ("shoulder", "elbow"),
    ("elbow", "wrist"),
    ("wrist", "index"),
    ("wrist", "pinky"),
    ("wrist", "thumb"),
    ("shoulder", "hip"),
    ("hip", "knee"),
    ("knee", "ankle"),
    ("ankle", "heel"),
    ("heel", "foot_index"),
    ("mouth", "eye"),
    ("eye", "ear"),
)
_ACROSS = ("shoulder", "hip", "mouth")
_LEFT, _RIGHT, _MIDDLE = "#4aa3ff", "#ff9d3d", "#f2f4f7"
_EDGE = "#101418"
_FAINTEST = 0.2


def bones() -> list[tuple[int, int, str]]:
    """Pairs of landmarks that are joined, each with its colour."""
    lines = [
        (LANDMARKS.index(f"{a}.{side}"), LANDMARKS.index(f"{b}.{side}"), colour)
        for a, b in _LIMBS
        for side, colour in (("L", _LEFT), ("R", _RIGHT))
    ]
    lines += [
        (LANDMARKS.index(f"{name}.L"), LANDMARKS.index(f"{name}.R"), _MIDDLE) for name in _ACROSS
    ]
    return lines


_BONES = bones()


def draw_landmarks(
    painter: QPainter, points: NDArray[np.float32], box: QRectF, size: tuple[int, int]
) -> None:
    """Draw a skeleton: the person's left blue, their right orange, hidden landmarks faint.

    ``points``, shape (33, 3), holds x and y in pixels of the picture and visibility from 0 to 1.
    The picture of ``size`` (width, height) fills ``box`` on the widget.
    """
    scale = box.width() / size[0], box.height() / size[1]
    places = [QPointF(box.x() + x * scale[0], box.y() + y * scale[1]) for x, y, _ in points]
    visibility = np.clip(points[:, 2], 0.0, 1.0)
    known = np.asarray(np.isfinite(points).all(axis=1))
    with clipped(painter, box):
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        # The dark edge first, so that the lines stand out on any picture.
        for width, edge in ((5.0, True), (2.5, False)):
            for a, b, colour in _BONES:
                if known[a] and known[b]:
                    strength = max(float(min(visibility[a], visibility[b])), _FAINTEST)
                    painter.setPen(_pen(_EDGE if edge else colour, width, strength))
                    painter.drawLine(places[a], places[b])


def _pen(colour: str, width: float, strength: float) -> QPen:
    shade = QColor(colour)
    shade.setAlphaF(strength)
    pen = QPen(shade, width)
    pen.setCapStyle(Qt.PenCapStyle.RoundCap)
    return pen


_OPACITY_STEPS = 20


LandmarksAt = Callable[[int], NDArray[np.float32] | None]
"""Landmarks of the person in a frame, while they are being found; None: none are shown."""


class VideoView(Canvas):
    """Fits the picture into the space there is."""

    USUAL_PX = 427, 320

    def __init__(
        self,
        session: Session,
        overlay: OverlayModel,
        landmarks_at: LandmarksAt,
        fit_signals: Sequence[SignalInstance],
    ) -> None:
        super().__init__()
        self.setAccessibleName("Video")
        self._session, self._overlay, self._landmarks_at = session, overlay, landmarks_at
        self.setMinimumSize(200, 150)
        self.follow(
            session.video.frame_changed,
            session.display.theme_changed,
            session.document.changed,
            overlay.changed,
            *fit_signals,
        )
        self._beyond = False  # the clock is before the first frame, or after the last one
        session.playback.frame_changed.connect(self._follow_clock)
        session.document.changed.connect(self._follow_clock)

    def _follow_clock(self) -> None:
        playback, reader = self._session.playback, self._session.video.reader
        now_s = playback.timebase.time_of(playback.frame)
        beyond = reader is not None and not reader.timebase.covers(now_s)
        if beyond != self._beyond:
            self._beyond = beyond
            self.update()

    def paint(self, painter: QPainter) -> None:
        """Paint the picture, or why there is none."""
        colours, video = self._session.display.palette, self._session.video
        painter.fillRect(self.rect(), QColor(colours.well))
        if video.picture is None or self._beyond:
            painter.setPen(QColor(colours.muted))
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, self._absence())
            return
        height, width = video.picture.shape[:2]
        box = paint_picture(painter, self.rect(), video.picture)
        if self._overlay.style.shown:
            self._paint_mesh(painter, box)
        # Landmarks of this frame, until the mesh takes their place.
        if self._session.document.mesh is None:
            landmarks = self._landmarks_at(video.shown_frame)
            if landmarks is not None:
                draw_landmarks(painter, landmarks, box, (width, height))

    def _absence(self) -> str:
        recording = self._session.document.recording
        if recording is None:
            return ""
        if self._beyond:
            return "No video at this time"
        if self._session.video.reader is not None:
            return "Reading the first frame…"
        if recording.video is None:
            return "No video in this recording"
        return "The video cannot be shown"

    def _paint_mesh(self, painter: QPainter, box: QRectF) -> None:
        s, style, reader = self._session, self._overlay.style, self._session.video.reader
        if reader is None:
            return
        # Dots cover little: they have to be stronger to be seen at all.
        opacity = style.opacity**0.5 if style.as_dots else style.opacity
        draw_mesh(
            painter,
            box,
            s.document.mesh,
            reader.timebase.time_of(s.video.shown_frame),
            s.document.camera,
            QColor(s.display.palette.overlay),
            opacity,
            as_dots=style.as_dots,
        )


class VideoBar(QWidget):
    """Bar with the mesh's visibility, dots or surface, and opacity."""

    def __init__(self, overlay: OverlayModel, action: Callable[[str], QAction]) -> None:
        super().__init__()
        self._overlay = overlay
        self._mesh = action("overlay")
        self._slider = QSlider(Qt.Orientation.Horizontal, self)
        self._slider.setRange(1, _OPACITY_STEPS)
        self._slider.setFixedWidth(80)
        self._slider.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self._slider.setAccessibleName("Opacity of the mesh over the video")
        self._slider.valueChanged.connect(
            lambda value: overlay.set_style(opacity=value / _OPACITY_STEPS)
        )
        mesh, dots = (
            action_button(self._mesh, "Mesh"),
            action_button(action("overlay_dots"), "As dots"),
        )
        parts = (title("Video"), STRETCH, mesh, self._slider, dots)
        self.setLayout(row_of(*parts, spacing_px=4, margins_px=(8, 2, 4, 2)))
        overlay.changed.connect(self._refresh)
        self._mesh.changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        style = self._overlay.style
        with QSignalBlocker(self._slider):
            self._slider.setValue(round(style.opacity * _OPACITY_STEPS))
        self._slider.setEnabled(self._mesh.isEnabled() and style.shown)
        self._slider.setToolTip(f"Opacity of the mesh over the video: {style.opacity:.0%}")


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
    ) -> None:
        self._session, self._shell = session, shell
        self._landmarks_at, self._fit_signals = landmarks_at, fit_signals
        self._offer_frame = offer_frame
        self.overlay = OverlayModel(session.settings, session.parent)
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
