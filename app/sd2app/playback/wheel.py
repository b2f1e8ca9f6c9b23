"""The wheel over whatever has the time axis of the tracks."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QWheelEvent

from sd2app.session.time_window import VisibleSpanModel
from sd2app.widgets.time_axis import TimeScale

_ZOOM_PER_NOTCH = 0.8


def turn_wheel(event: QWheelEvent, span: VisibleSpanModel, scale: TimeScale) -> None:
    """Zoom about the pointer, or pan with Shift or a sideways wheel."""
    delta = event.angleDelta()
    sideways = delta.x() or (
        delta.y() if event.modifiers() & Qt.KeyboardModifier.ShiftModifier else 0
    )
    if sideways:
        span.pan(-sideways / 120.0 * span.duration_s * 0.1)
    elif delta.y():
        anchor_s = scale.time_of(event.position().x())
        span.zoom(_ZOOM_PER_NOTCH ** (delta.y() / 120.0), anchor_s)
    event.accept()
