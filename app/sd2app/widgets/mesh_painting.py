"""A mesh painted over the picture it was fitted to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF
from PySide6.QtGui import QColor, QImage, QPainter

from sd2core.body.camera import PinholeCamera
from sd2core.figures.surface import Frame, shade_mesh
from sd2core.numerics.compiled import kernels_ready


def draw_mesh(
    painter: QPainter,
    box: QRectF,
    vertices_m: NDArray[np.floating],
    faces: NDArray[np.int32] | None,
    camera: PinholeCamera,
    colour: QColor,
    opacity: float,
) -> None:
    """Draw a mesh over a picture that is on the screen already.

    ``box`` is the place of the camera's whole picture. ``vertices_m``, shape (V, 3), are in the
    camera's frame; without ``faces``, shape (F, 3), and while the kernels are being compiled,
    they are drawn as dots. ``opacity`` is from 0 to 1.
    """
    if box.width() < 1 or box.height() < 1:
        return
    width = max(round(box.width() * painter.device().devicePixelRatioF()), 1)
    zoom = width / camera.width
    frame = Frame(0.0, 0.0, width, max(round(camera.height * zoom), 1), zoom)
    light = shade_mesh(vertices_m, faces if kernels_ready() else None, camera, frame)
    pixels = tinted(light, (colour.red(), colour.green(), colour.blue()), opacity)
    height, width = light.shape
    form = QImage.Format.Format_ARGB32_Premultiplied
    painter.drawImage(box, QImage(pixels.data, width, height, 4 * width, form))


def tinted(
    light: NDArray[np.float32], colour: tuple[int, int, int], opacity: float
) -> NDArray[np.uint32]:
    """A lit mesh as premultiplied ``0xAARRGGBB``, transparent beside it; (H, W)."""
    # One colour for each of 256 lightnesses: a look-up is cheaper than three products.
    steps = np.arange(256, dtype=np.float64)[:, None] / 255 * opacity
    red, green, blue = np.rint(steps * colour).astype(np.uint32).T
    table = (np.uint32(round(255 * opacity)) << 24) | (red << 16) | (green << 8) | blue
    table[0] = 0  # beside the mesh; on it the darkest is a third
    pixels: NDArray[np.uint32] = table[np.rint(light * 255).astype(np.uint8)]
    return pixels
