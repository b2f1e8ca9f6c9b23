"""The 3D view of mesh, sensor and camera; VTK is loaded when the view is made."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from PySide6.QtCore import SignalInstance
from PySide6.QtWidgets import QVBoxLayout, QWidget

from sd2app.feature import Action, Feature, Shell
from sd2app.maps.model import SynthesisModel
from sd2app.scene.bar import SceneBar
from sd2app.scene.camera import Preset
from sd2app.sensor.placements import PlacementsModel
from sd2app.session.display import MeshColour
from sd2app.session.session import Session

if TYPE_CHECKING:
    from sd2app.scene.view import SceneView


class SceneFeature(Feature):
    """Colour of the mesh, where one looks from, and the sensor to be dragged."""

    def __init__(
        self,
        session: Session,
        shell: Shell,
        synthesis: SynthesisModel,
        placements: PlacementsModel,
    ) -> None:
        self._session, self._shell = session, shell
        self._synthesis, self._placements = synthesis, placements
        self.view: SceneView | None = None

    @property
    def busy(self) -> bool:
        """True until the view is there."""
        return self.view is None

    def actions(self) -> Sequence[Action]:
        """Colours and views."""
        display, there = self._session.display, self._there
        return (
            self._colour(
                "colour_velocity", "Colour by radial velocity", "Alt+1",
                "Blue recedes, red approaches, grey is hidden or still", "velocity",
            ),
            self._colour(
                "colour_range", "Colour by range", "Alt+2", "Distance from the sensor in metres",
                "range",
            ),
            self._colour(
                "colour_visibility", "Colour by visibility", "Alt+3",
                "What the sensor sees, and what is hidden from it", "visibility",
            ),
            self._colour("colour_plain", "Plain mesh", "Alt+4", "One colour", "plain"),
            Action(
                "dots", "View", "Vertices as dots", ("D",), "Draw vertices instead of the surface",
                lambda: display.set_as_dots(not display.as_dots), there, lambda: display.as_dots,
            ),
            self._look(
                "view_three_quarter", "overview", "overview", "Ctrl+1",
                "See sensor, camera and body",
            ),
            self._look(
                "view_camera", "from the camera", "camera", "Ctrl+2", "See what the camera sees"
            ),
            self._look(
                "view_sensor", "from the sensor", "sensor", "Ctrl+3", "See what the sensor sees"
            ),
            self._look(
                "view_side", "from the side", "side", "Ctrl+4", "See sensor and body sideways"
            ),
            self._look("view_top", "from above", "top", "Ctrl+5", "See sensor and body from above"),
        )  # fmt: skip

    def _colour(self, name: str, text: str, key: str, tip: str, colour: MeshColour) -> Action:
        display = self._session.display
        return Action(
            name, "View", text, (key,), tip,
            lambda: display.set_mesh_colour(colour), self._there,
            lambda: display.mesh_colour == colour,
        )  # fmt: skip

    def _look(self, name: str, text: str, view: Preset, key: str, tip: str) -> Action:
        def look() -> None:
            if self.view is not None:
                self.view.set_view(view)

        return Action(name, "View", f"Scene: {text}", (key,), tip, look, self._there)

    def _there(self) -> bool:
        return self._session.has_mesh

    def make_view(self) -> QWidget:
        """The 3D view under its bar."""
        from sd2app.scene.view import SceneView

        s, pane = self._session, QWidget()
        self.view = SceneView(s, self._synthesis, self._placements)
        layout = QVBoxLayout(pane)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(SceneBar(s.display, self._shell.action))
        layout.addWidget(self.view, 1)
        return pane

    def changes(self) -> Sequence[SignalInstance]:
        """Colour and dots."""
        return (self._session.display.mesh_changed,)

    def close(self) -> None:
        """Release VTK."""
        if self.view is not None:
            self.view.close()
