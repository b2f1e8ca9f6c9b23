"""Bar over the 3D view: colour of the mesh, dots, views."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QLabel, QMenu, QToolButton, QWidget

from sd2app.session.display import DisplayModel
from sd2app.widgets.inputs import Choice, action_button
from sd2app.widgets.layouts import STRETCH, row_of
from sd2app.widgets.panel import title

_COLOURS = {
    "velocity": "radial velocity",
    "range": "range",
    "visibility": "visibility",
    "plain": "plain",
}
_VIEWS = ("view_three_quarter", "view_camera", "view_sensor", "view_side", "view_top")


class SceneBar(QWidget):
    """Bar with the mesh's colour, dots and ready-made views."""

    def __init__(self, display: DisplayModel, action: Callable[[str], QAction]) -> None:
        super().__init__()
        self._display = display
        self._colour = Choice(
            "What the colour of the mesh means (1 to 4)", self, _COLOURS, display.set_mesh_colour
        )
        colour = (QLabel("colour", self), self._colour, action_button(action("dots"), "Dots"))
        parts = (title("Scene"), 8, *colour, STRETCH, _view_menu(action))
        self.setLayout(row_of(*parts, spacing_px=4, margins_px=(8, 2, 4, 2)))
        display.mesh_changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        self._colour.show_value(self._display.mesh_colour)


def _view_menu(action: Callable[[str], QAction]) -> QToolButton:
    button = QToolButton()
    button.setText("Look from")
    button.setToolTip("Where to look at the scene from")
    button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
    menu = QMenu(button)
    for name in _VIEWS:
        menu.addAction(action(name))
    button.setMenu(menu)
    return button
