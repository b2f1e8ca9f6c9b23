"""Interface of the two renderers of the scene."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from PySide6.QtWidgets import QWidget
from vtkmodules.vtkRenderingCore import vtkRenderer

Prepare = Callable[[tuple[float, float], float], None]
"""Called right before a rendering with the widget's size and the pixel scale."""


class NoOpenGL(RuntimeError):
    """OpenGL does not work here; the message is for the user."""


class Backend(Protocol):
    """A widget that shows what its renderer holds."""

    name: str
    renderer: vtkRenderer

    @property
    def widget(self) -> QWidget:
        """Shows the picture; who filters its events handles the mouse."""

    def start(self, prepare: Prepare) -> None:
        """Draw from now on."""

    def request_render(self) -> None:
        """Draw again in the next turn of the event loop, once, if visible."""

    def shut_down(self) -> None:
        """Release everything of VTK; the widget stays, blank."""
