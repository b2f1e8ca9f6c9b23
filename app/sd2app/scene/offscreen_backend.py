"""Draws off-screen, by GPU or software, and paints the picture."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import vtkmodules.vtkRenderingOpenGL2 as opengl
from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QImage, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QWidget
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkLogger, vtkObject, vtkUnsignedCharArray
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow

from sd2app.background.latest import delayed

GL_BROKEN = (
    "The 3D view needs OpenGL, and no OpenGL driver answers on this machine. "
    "On Debian or Ubuntu: sudo apt-get install libgl1-mesa-dri libegl-mesa0. Then start again."
)
_IDLE_MS = 160
_SUPERSAMPLING = 2
_MAX_PIXELS = 4_000_000
Prepare = Callable[[tuple[float, float], float], None]
"""Called right before a rendering with the widget's size and the pixel scale."""


class NoOpenGL(RuntimeError):
    """OpenGL does not work here; the message is for the user."""


class ImageBackend(QWidget):
    """A widget whose paint event renders when something changed.

    Qt merges the updates of one turn of the event loop and paints nothing that
    is hidden, so rendering here is coalesced and free while invisible. When
    nothing has moved for a moment the picture is drawn again with
    supersampling.
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        # Before the widget: one that was made half must not remain in its parent.
        window = _off_screen_window()
        super().__init__(parent)
        self._window: vtkRenderWindow | None = window
        self.renderer = vtkRenderer()
        window.AddRenderer(self.renderer)
        self._pixels = vtkUnsignedCharArray()
        self._prepare: Prepare | None = None
        self._picture: QImage | None = None
        self._dirty = True
        self._fine = False
        self.renderings = 0  # number of times the scene was rendered
        self._idle = delayed(self._refine, _IDLE_MS, self)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)

    def start(self, prepare: Prepare) -> None:
        """Draw from now on."""
        self._prepare = prepare
        self.request_render()

    def request_render(self) -> None:
        """Draw again in the next turn of the event loop, once, if visible."""
        self._dirty = True
        self._fine = False
        self.update()

    def shut_down(self) -> None:
        """Release everything of VTK; the widget stays, blank."""
        self._idle.stop()
        self._prepare = None
        self._picture = None
        if self._window is not None:
            self.renderer.RemoveAllViewProps()
            self._window.RemoveRenderer(self.renderer)
            self._window.Finalize()
            self._window = None

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Render again in the new size."""
        self.request_render()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Render if something changed, then paint the picture."""
        if self._prepare is not None and self._window is not None and self._dirty:
            self._picture = self._rendered(self._prepare, self._window)
            self._dirty = False
            if not self._fine:
                self._idle.start()
        painter = QPainter(self)
        if self._picture is None:
            painter.fillRect(self.rect(), self.palette().window())
            return
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.drawImage(self.rect(), self._picture)

    def _refine(self) -> None:
        if self.isVisible():
            self._fine = True
            self._dirty = True
            self.update()

    def _rendered(self, prepare: Prepare, window: vtkRenderWindow) -> QImage:
        ratio = self.devicePixelRatioF()
        size = QSize(max(self.width(), 1), max(self.height(), 1))
        target = QSize(round(size.width() * ratio), round(size.height() * ratio))
        factor = _SUPERSAMPLING if self._fine else 1
        if factor**2 * target.width() * target.height() > _MAX_PIXELS:
            factor = 1
        width, height = factor * target.width(), factor * target.height()
        window.SetSize(width, height)
        prepare((size.width(), size.height()), factor * ratio)
        window.Render()
        self.renderings += 1
        window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, self._pixels, 0)
        rows = vtk_to_numpy(self._pixels).reshape(height, width, 4)
        upright = np.ascontiguousarray(rows[::-1])  # OpenGL counts rows from below
        picture = QImage(upright.data, width, height, 4 * width, QImage.Format.Format_RGBX8888)
        if factor == 1:
            return picture.copy()
        return picture.scaled(
            target, Qt.AspectRatioMode.IgnoreAspectRatio, Qt.TransformationMode.SmoothTransformation
        )


def _off_screen_window() -> vtkRenderWindow:
    """Make a window that needs no screen; NoOpenGL where no driver would draw in it."""
    uses_egl = sys.platform.startswith("linux") and hasattr(opengl, "vtkEGLRenderWindow")
    # Left to itself VTK tries the X server first and complains when there is none.
    window = opengl.vtkEGLRenderWindow() if uses_egl else vtkRenderWindow()
    window.SetOffScreenRendering(True)
    window.SetMultiSamples(0)
    with _quiet_vtk():
        if not window.SupportsOpenGL():
            raise NoOpenGL(GL_BROKEN)
    return window


@contextmanager
def _quiet_vtk() -> Iterator[None]:
    # What VTK prints about a missing driver helps no user; the view says it in words.
    heard, warned = vtkLogger.GetCurrentVerbosityCutoff(), vtkObject.GetGlobalWarningDisplay()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    vtkObject.GlobalWarningDisplayOff()
    try:
        yield
    finally:
        vtkObject.SetGlobalWarningDisplay(warned)
        vtkLogger.SetStderrVerbosity(heard)
