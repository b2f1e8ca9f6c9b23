"""Landmarks drawn over the video while a body is fitted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen

from sd2app.widgets.canvas import clipped
from sd2core.body.track import LANDMARKS

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
