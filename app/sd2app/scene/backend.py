"""The choice between the two renderers of the scene, and what they share.

``gl`` draws into the window itself (pyvistaqt's QtInteractor): best where a
GPU draws. ``image`` draws off-screen and paints the picture: with software
OpenGL the window would be composited again for every frame (12 instead of 28
frames/s), and Qt's ``offscreen`` platform has no OpenGL window at all.
``SD2_SCENE`` decides when it is set.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Literal

from PySide6.QtGui import QGuiApplication, QOffscreenSurface, QOpenGLContext

from sd2app.displays import loads

BackendName = Literal["gl", "image"]

GL_MISSING = (
    "The 3D view needs OpenGL, and {library} is not installed. "
    "On Debian or Ubuntu: sudo apt-get install libgl1 libegl1. Then start again."
)
GL_BROKEN = (
    "The 3D view needs OpenGL, and no OpenGL driver answers on this machine. "
    "On Debian or Ubuntu: sudo apt-get install libgl1-mesa-dri libegl-mesa0. Then start again."
)
_NO_WINDOW = ("offscreen", "minimal", "vnc", "linuxfb", "eglfs")
_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader", "gdi generic", "basic render")
_GL_RENDERER = 0x1F01

Prepare = Callable[[tuple[float, float], float], None]
"""Called right before a rendering with the widget's size and the pixel scale."""


class NoOpenGL(RuntimeError):
    """OpenGL does not work here; the message is for the user."""


def chosen_backend() -> BackendName:
    """``SD2_SCENE``, or what suits the machine; needs a QGuiApplication."""
    requested = os.environ.get("SD2_SCENE", "").strip().lower()
    if requested == "gl" or requested == "image":
        return "image" if _has_no_window() else requested  # type: ignore[return-value]
    if _has_no_window() or not _has_gpu_device():
        return "image"
    name = opengl_renderer()
    return "image" if name is None or is_software(name) else "gl"


def _has_no_window() -> bool:
    return QGuiApplication.platformName() in _NO_WINDOW


def _has_gpu_device() -> bool:
    """Tell if the system offers a GPU; True where that is unknown."""
    if not sys.platform.startswith("linux"):
        return True
    if any(Path("/dev").glob("nvidia[0-9]*")) or Path("/dev/dxg").exists():
        return True
    return any(Path("/dev/dri").glob("renderD*"))


def opengl_renderer() -> str | None:
    """Name of what draws for Qt, from a context without a window; None without OpenGL."""
    context = QOpenGLContext()
    surface = QOffscreenSurface()
    surface.create()
    if not (context.create() and context.makeCurrent(surface)):
        return None
    try:
        name = context.functions().glGetString(_GL_RENDERER)
    finally:
        context.doneCurrent()
    return str(name or "")


def is_software(renderer: str) -> bool:
    """True if an OpenGL renderer computes on the CPU."""
    return any(name in renderer.lower() for name in _SOFTWARE)


def missing_library(backend: BackendName) -> str | None:
    """Name of an OpenGL library that VTK would load and die without, or None."""
    if not sys.platform.startswith("linux"):
        return None
    library = "libGL.so.1" if backend == "gl" else "libEGL.so.1"
    return None if loads(library) else library
