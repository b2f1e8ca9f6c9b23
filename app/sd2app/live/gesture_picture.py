"""Pictures of a body that makes a gesture: from the bundled sample, where it has the gesture."""

from __future__ import annotations

from functools import cache

from PySide6.QtCore import QRectF
from PySide6.QtGui import QColor, QPainter

from sd2app.widgets.mesh_painting import draw_mesh
from sd2core.body.camera import PinholeCamera
from sd2core.files.resources import resource_path
from sd2core.mesh.sequence import MeshSequence
from sd2core.recording.recording import open_recording

_AROUND_S = 0.2
"""Of the body before and after a gesture."""
_CAMERA = PinholeCamera()
"""What the sample was drawn through."""


@cache
def _sample() -> tuple[MeshSequence, dict[str, tuple[float, float]]]:
    """Body of the sample, and begin and end of the first of each gesture."""
    recording = open_recording(resource_path("swipes.sd2"))
    spans = {one.label: (one.start_s, one.end_s) for one in reversed(recording.labelled.spans)}
    return recording.load_mesh(), spans


def prepare_pictures() -> None:
    """Read the body, which takes a second, before it is wanted."""
    _sample()


def has_picture(gesture: str) -> bool:
    """True if a body can be shown that makes a gesture."""
    return bool(gesture) and gesture in _sample()[1]


def draw_gesture(
    painter: QPainter, room: QRectF, gesture: str, time_s: float, colour: QColor
) -> None:
    """Draw a body that makes a gesture again and again, as in a mirror.

    Parameters
    ----------
    painter : QPainter
    room : QRectF
        Where; the body fills its height.
    gesture : str
        One that has a picture.
    time_s : float
        Of a clock that goes on.
    colour : QColor
    """
    mesh, spans = _sample()
    start_s, end_s = spans[gesture]
    shown_s = start_s - _AROUND_S + time_s % (end_s - start_s + 2 * _AROUND_S)
    box = QRectF(0.0, 0.0, room.height() * _CAMERA.width / _CAMERA.height, room.height())
    box.moveCenter(-room.center())
    box.moveTop(room.top())
    painter.save()
    painter.setClipRect(room)
    painter.scale(-1.0, 1.0)  # who sees it does the same on the same side
    draw_mesh(painter, box, mesh, shown_s, _CAMERA, colour, 1.0)
    painter.restore()
