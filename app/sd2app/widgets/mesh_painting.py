"""Pictures, and a mesh painted over the picture it was fitted to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRect, QRectF
from PySide6.QtGui import QColor, QImage, QPainter

from sd2core.body.camera import PinholeCamera
from sd2core.figures.surface import Frame, shade_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import kernels_ready

_GREY = 56
"""Grey value of the ground without a picture."""


def paint_picture(
    painter: QPainter, room: QRect, picture: NDArray[np.uint8], *, enlarge: bool = True
) -> QRectF:
    """Paint RGB or RGBA (H, W, 3 or 4) in the middle of a room, as large as it fits.

    Returns where it is.
    """
    height, width, channels = picture.shape
    scale = min(room.width() / width, room.height() / height)
    scale = scale if enlarge else min(scale, 1.0)
    box = QRectF(0, 0, width * scale, height * scale)
    box.moveCenter(QRectF(room).center())
    form = QImage.Format.Format_RGB888 if channels == 3 else QImage.Format.Format_RGBA8888
    pixels = np.ascontiguousarray(picture)
    painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
    painter.drawImage(box, QImage(pixels.data, width, height, channels * width, form))
    return box


def no_picture(camera: PinholeCamera) -> NDArray[np.uint8]:
    """A grey ground in place of a camera's picture, RGB (H, W, 3)."""
    return np.full((camera.height, camera.width, 3), _GREY, np.uint8)


def draw_mesh(
    painter: QPainter,
    box: QRectF,
    mesh: MeshSequence | None,
    time_s: float,
    camera: PinholeCamera,
    colour: QColor,
    opacity: float,
    *,
    as_dots: bool = False,
) -> None:
    """Draw the person of a moment over a picture that is on the screen already.

    ``box`` is the place of the camera's whole picture. Vertices are drawn as dots if so chosen,
    without faces, and while the kernels are being compiled. ``opacity`` is from 0 to 1.
    """
    frame = None if mesh is None else mesh.person_at(time_s)
    if mesh is None or frame is None or box.width() < 1 or box.height() < 1:
        return
    width = max(round(box.width() * painter.device().devicePixelRatioF()), 1)
    zoom = width / camera.width
    part = Frame(0.0, 0.0, width, max(round(camera.height * zoom), 1), zoom)
    faces = None if as_dots or not kernels_ready() else mesh.faces
    light = shade_mesh(mesh.frame(frame), faces, camera, part)
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
    return table[np.rint(light * 255).astype(np.uint8)]
