"""Draws into the window with a GPU, through pyvistaqt's QtInteractor."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget
from vtkmodules.vtkRenderingCore import vtkRenderer

from sd2app.plain_imports import imports_of_qt
from sd2app.scene.backend import (
    GL_MISSING,
    NoOpenGL,
    Prepare,
    is_software,
    missing_library,
    opengl_renderer,
)


class InteractorBackend:
    """A QtInteractor without its own interaction; the view handles the mouse.

    pyvistaqt takes 1.7 s to import (matplotlib.pyplot), so that happens here
    and not with the module.
    """

    def __init__(self, parent: QWidget) -> None:
        library = missing_library("gl")
        if library is not None:
            raise NoOpenGL(GL_MISSING.format(library=library))
        driver = opengl_renderer()
        with imports_of_qt():  # it takes all of Qt's names at once
            from pyvistaqt import QtInteractor

        self._interactor: Any = QtInteractor(parent, auto_update=False, multi_samples=0)
        # It would keep drops and the window's keys to itself.
        self._interactor.setAcceptDrops(False)
        self._interactor.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._interactor.setMouseTracking(True)
        self.renderer: vtkRenderer = self._interactor.renderer
        # A pass over the whole picture: free on a GPU, 40 ms on a CPU.
        self.renderer.SetUseFXAA(driver is not None and not is_software(driver))
        self._prepare: Prepare | None = None
        self._observer = self.renderer.AddObserver("StartEvent", self._before_rendering)

    @property
    def widget(self) -> QWidget:
        """The QtInteractor."""
        return self._interactor

    def start(self, prepare: Prepare) -> None:
        """Draw from now on."""
        self._prepare = prepare
        self.request_render()

    def request_render(self) -> None:
        """Draw again in the next turn of the event loop, once, if visible."""
        self._interactor.update()

    def shut_down(self) -> None:
        """Release everything of VTK."""
        self._prepare = None
        self.renderer.RemoveObserver(self._observer)
        self._interactor.close()

    def _before_rendering(self, *_: object) -> None:
        if self._prepare is not None:
            widget = self._interactor
            self._prepare((widget.width(), widget.height()), widget.devicePixelRatioF())
