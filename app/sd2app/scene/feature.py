"""The 3D view of mesh, sensor and camera; VTK is loaded when the view is made."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import QPointF
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QMenu, QWidget

from sd2app.feature import Action, Feature, Shell
from sd2app.imu.model import ImuModel
from sd2app.maps.limbs import LimbsModel
from sd2app.maps.model import SynthesisModel
from sd2app.scene.camera import Preset
from sd2app.sensor.placements import PlacementsModel
from sd2app.session.display import DisplayModel, MeshColour
from sd2app.session.session import Session
from sd2app.widgets.canvas import MenuPart
from sd2app.widgets.inputs import Choice, action_button
from sd2app.widgets.layouts import STRETCH, pane, row_of
from sd2app.widgets.panel import outlined, title

if TYPE_CHECKING:
    from sd2app.scene.view import SceneView

_COLOURS: tuple[tuple[MeshColour, str, str], ...] = (
    ("velocity", "Colour by radial velocity",
     "Blue recedes, red approaches, grey is hidden or still"),
    ("range", "Colour by range", "Distance from the sensor in metres"),
    ("visibility", "Colour by visibility", "What the sensor sees, and what is hidden from it"),
    ("plain", "Plain mesh", "One colour"),
)  # fmt: skip
_VIEWS: tuple[tuple[str, Preset, str, str], ...] = (
    ("view_three_quarter", "overview", "overview", "See sensor, camera and body"),
    ("view_camera", "camera", "from the camera", "See what the camera sees"),
    ("view_sensor", "sensor", "from the sensor", "See what the sensor sees"),
    ("view_side", "side", "from the side", "See sensor and body sideways"),
    ("view_top", "top", "from above", "See sensor and body from above"),
)


class SceneBar(QWidget):
    """Bar over the 3D view: colour of the mesh, dots and ready-made views."""

    def __init__(self, display: DisplayModel, action: Callable[[str], QAction]) -> None:
        super().__init__()
        texts = {colour: colour for colour, *_ in _COLOURS}
        tip = "What the colour of the mesh means (1 to 4)"
        colour = Choice(tip, self, texts, display.set_mesh_colour)
        views = QMenu(self)
        views.addActions([action(name) for name, *_ in _VIEWS])
        look = outlined("Look from", "Where to look at the scene from", views, self, look="")
        dots = action_button(action("dots"), "As dots")
        parts = (title("Scene"), 8, colour, dots, STRETCH, look)
        self.setLayout(row_of(*parts, spacing_px=4, margins_px=(8, 2, 4, 2)))
        display.mesh_changed.connect(lambda: colour.show_value(display.mesh_colour))
        colour.show_value(display.mesh_colour)


class SceneFeature(Feature):
    """Colour of the mesh, where one looks from, and the sensor to be dragged.

    ``offer_frame`` adds to the context menu what can be done with the frame on screen.
    """

    def __init__(
        self,
        session: Session,
        shell: Shell,
        synthesis: SynthesisModel,
        placements: PlacementsModel,
        inertial: ImuModel,
        limbs: LimbsModel,
        offer_frame: MenuPart,
    ) -> None:
        self._session, self._shell = session, shell
        self._offer_frame = offer_frame
        self._synthesis, self._placements, self._inertial = synthesis, placements, inertial
        self._limbs = limbs
        self.view: SceneView | None = None
        self.changing = (session.display.mesh_changed,)

    @property
    def busy(self) -> bool:
        """True until the view is there."""
        return self.view is None

    def actions(self) -> Sequence[Action]:
        """Colours, dots and views."""
        display, has_mesh = self._session.display, self._session.has_mesh
        colours = (
            Action(
                f"colour_{colour}", "View", text, (f"Alt+{number}",), tip,
                partial(display.set_mesh_colour, colour), has_mesh,
                partial(self._shows, colour),
            )
            for number, (colour, text, tip) in enumerate(_COLOURS, start=1)
        )  # fmt: skip
        dots = Action(
            "dots", "View", "Vertices as dots", ("D",), "Draw vertices instead of the surface",
            lambda: display.set_as_dots(not display.as_dots), has_mesh, lambda: display.as_dots,
        )  # fmt: skip
        views = (
            Action(
                name, "View", f"Scene: {text}", (f"Ctrl+{number}",), tip,
                partial(self._look_from, preset), has_mesh,
            )
            for number, (name, preset, text, tip) in enumerate(_VIEWS, start=1)
        )  # fmt: skip
        return (*colours, dots, *views)

    def _shows(self, colour: MeshColour) -> bool:
        return self._session.display.mesh_colour == colour

    def _look_from(self, preset: Preset) -> None:
        if self.view is not None:
            self.view.set_view(preset)

    def make_view(self) -> QWidget:
        """The 3D view under its bar."""
        from sd2app.scene.view import SceneView

        self.view = view = SceneView(
            self._session, self._synthesis, self._placements, self._inertial, self._limbs
        )
        export = self._shell.action("export_strip")
        view.menu_parts = (
            view.offer_value,
            self._offer_inertial,
            self._offer_frame,
            lambda menu, _: menu.addAction(export),
        )
        return pane(SceneBar(self._session.display, self._shell.action), (self.view, 1))

    def _offer_inertial(self, menu: QMenu, place: QPointF) -> None:
        """Offer to place an inertial sensor at a place of the body, or to remove the one there."""
        assert self.view is not None
        if not self.view.inertial_hand.offer(menu, place.x(), place.y()):
            menu.addAction(self._shell.action("place_inertial"))

    def close(self) -> None:
        """Release VTK."""
        if self.view is not None:
            self.view.close()
