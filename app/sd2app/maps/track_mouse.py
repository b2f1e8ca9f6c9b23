"""Plots over the time axis of a session, and the mouse of maps and tracks under their titles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QMouseEvent

from sd2app.maps.arrangement import HEADER_PX
from sd2app.session.session import Session
from sd2app.session.undo import Offset
from sd2app.widgets.canvas import Overlay, TimePlot, ZoomedPlot

_CURSORS = {
    "seek": Qt.CursorShape.CrossCursor,
    "offset": Qt.CursorShape.SizeHorCursor,
    "fold": Qt.CursorShape.PointingHandCursor,
    "": Qt.CursorShape.ArrowCursor,
}


class SessionPlot(TimePlot):
    """Plot that follows the clock, the theme, and what other features draw over it."""

    def __init__(self, session: Session, overlays: Sequence[Overlay] = ()) -> None:
        super().__init__(session.span)
        self._session, self._overlays = session, tuple(overlays)
        self._span, self._playback, self._pointer = session.span, session.playback, session.pointer
        self._display = session.display
        self._grab: tuple[str, float] | None = None  # what is dragged, and from which pixel
        self.follow(self._playback.frame_changed)
        drawn = [signal for overlay in overlays for signal in overlay.changed]
        for signal in (self._display.theme_changed, *drawn):
            signal.connect(self.redraw)


class SeekingPlot(SessionPlot):
    """Plot on which a click or drag seeks."""

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Seek while the left button is down."""
        if event.buttons() & Qt.MouseButton.LeftButton:
            self._playback.seek(self.scale.time_of(event.position().x()))

    mouseMoveEvent = mousePressEvent


class TrackMouse(ZoomedPlot, SessionPlot):
    """Click or drag seeks, the middle button and the wheel move and scale the time axis.

    A drag from where :meth:`use_of` says ``"offset"`` moves what was measured in time.
    """

    OFFSET: ClassVar[Offset]
    """What such a drag moves."""

    def use_of(self, place: QPointF) -> str:
        """Use of the left button at a place: a key of the cursors."""
        raise NotImplementedError

    def point_at(self, place: QPointF) -> None:
        """Read what is under the pointer."""
        raise NotImplementedError

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Start to drag the cursor, the time axis or the alignment."""
        place = event.position()
        if event.button() == Qt.MouseButton.MiddleButton:
            self._grab = ("pan", place.x())
        elif event.button() == Qt.MouseButton.LeftButton:
            use = self.use_of(place)
            if use == "seek":
                self._session.playback.seek(self.scale.time_of(place.x()))
            elif use == "offset":
                self._session.edits.begin_offset_drag(self.OFFSET)
            else:
                return
            self._grab = (use, place.x())

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag what is held, and read what is under the pointer."""
        place = event.position()
        self.point_at(place)
        if self._grab is None:
            self.setCursor(_CURSORS[self.use_of(place)])
            return
        what, start_x = self._grab
        if what == "seek":
            self._session.playback.seek(self.scale.time_of(place.x()))
        elif what == "pan":
            self._session.span.pan((start_x - place.x()) * self.scale.seconds_per_px)
            self._grab = ("pan", place.x())
        else:
            self._session.edits.drag_offset((place.x() - start_x) * self.scale.seconds_per_px)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End the drag."""
        if self._grab is not None and self._grab[0] == "offset":
            self._session.edits.end_offset_drag()
        self._grab = None

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Show the whole recording."""
        if event.position().y() >= HEADER_PX:
            self._session.span.fit()

    def leaveEvent(self, event: object) -> None:
        """Clear the reading under the pointer."""
        self._session.pointer.leave()
        self.update()
