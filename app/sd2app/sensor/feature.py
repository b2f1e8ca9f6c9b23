"""The virtual sensor's panel, the placements of others, and the radar's time offset."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QWidget

from sd2app.accuracy.model import AccuracyModel
from sd2app.feature import Action, Feature, Shell
from sd2app.maps.model import SynthesisModel
from sd2app.sensor.alignment import AlignmentModel
from sd2app.sensor.alignment_dialog import AlignmentDialog
from sd2app.sensor.bodies_page import BodiesPage
from sd2app.sensor.panel import SensorPanel
from sd2app.sensor.placements import PlacementsModel
from sd2app.sensor.placements_page import PlacementsPage
from sd2app.sensor.things_page import ThingsPage
from sd2app.session.session import Session
from sd2app.widgets.dialogs import accepted
from sd2app.widgets.panel import InnerPages, LatePage


class SensorFeature(Feature):
    """One sensor to move, many to plan; ``make_batch`` takes the plan to a batch."""

    def __init__(
        self,
        session: Session,
        shell: Shell,
        accuracy: AccuracyModel,
        synthesis: SynthesisModel,
        make_batch: Callable[[], None],
        parent: QObject,
    ) -> None:
        self._session, self._shell, self._accuracy = session, shell, accuracy
        self._synthesis, self._make_batch = synthesis, make_batch
        self.placements = PlacementsModel(session, accuracy, parent)
        self.placements.failed.connect(shell.warn)
        came = session.maps.real.came_or_went
        align = session.aligning.changed
        self.changing = self.placements.changed, came, align, *synthesis.completeness
        self.alignment = AlignmentModel(session, synthesis, parent)
        self.closing = self.working = (self.placements, self.alignment)

    def actions(self) -> Sequence[Action]:
        """Sensor and placements."""
        edits, synthesis, placements = self._session.edits, self._synthesis, self.placements
        alignment, aligning = self.alignment, self._session.aligning
        return (
            Action(
                "sensor_to_camera", "Edit", "Sensor at the camera", ("Shift+Home",),
                "Put the sensor at the camera, looking along its axis", edits.sensor_to_camera,
            ),
            Action(
                "aim_sensor", "Edit", "Aim sensor at the body", ("A",),
                "Turn the sensor towards the body in this frame",
                self._aim, lambda: synthesis.torso_m is not None,
            ),
            Action(
                "placements", "Edit", "Placements…", ("Shift+S",),
                "Plan a grid or a cloud of sensors around the body, for a map from each",
                lambda: self._shell.bring_up("Sensor", "Placements"),
            ),
            Action(
                "things", "Edit", "Things…", (),
                "Put a box, a table, a screen, a mesh file, walls or a floor around the body",
                lambda: self._shell.bring_up("Sensor", "Things"),
            ),
            Action(
                "bodies", "Edit", "Bodies…", (),
                "Put somebody else into the scene, whose mesh is in another file",
                lambda: self._shell.bring_up("Sensor", "Bodies"),
            ),
            Action(
                "align", "Edit", "Align automatically…", (),
                "Find the time offset of the radar by the motion that mesh and radar both show",
                self._align, why_not=lambda: alignment.why_not,
            ),
            Action(
                "align_by_hand", "Edit", "Align by hand", (),
                "Show a grip on the radar's map, and on a real inertial sensor, which moves it in"
                " time; until this is chosen again, or Esc",
                aligning.toggle, checked=lambda: aligning.active,
                why_not=lambda: alignment.nothing_measured,
            ),
            Action(
                "draw_placements", "View", "Placements in the scene", (),
                "Draw the places that are planned for sensors",
                lambda: placements.set_shown(not placements.shown),
                lambda: placements.plan is not None, lambda: placements.shown,
            ),
            Action(
                "show_sensor", "View", "Sensor panel", ("S",),
                "Where the sensor is and what it sees",
                lambda: self._shell.bring_up("Sensor", "Sensor"),
            ),
        )  # fmt: skip

    def _aim(self) -> None:
        if self._synthesis.torso_m is not None:
            self._session.edits.aim_sensor(self._synthesis.torso_m)

    def _align(self) -> None:
        parent, display = self._shell.dialog_parent, self._session.display
        accepted(AlignmentDialog(self.alignment, display, parent))

    def panels(self) -> Mapping[str, QWidget]:
        """The panel at the side, of two pages."""
        shell = self._shell
        to_camera, aim = shell.action("sensor_to_camera"), shell.action("aim_sensor")
        align, radar = shell.action("align"), lambda: self.placements.radar
        sensor = SensorPanel(
            self._session, self._synthesis, radar, to_camera, aim, align, shell.warn
        )
        placements = LatePage(
            lambda: PlacementsPage(self.placements, self._accuracy, shell, self._make_batch)
        )
        things = LatePage(lambda: ThingsPage(self._session, self._synthesis, shell.warn))
        bodies = LatePage(lambda: BodiesPage(self._session, shell.warn))
        return {
            "Sensor": InnerPages(
                ("Sensor", "Where the sensor is and what it sees", sensor),
                ("Placements", "Many places around the body, for a map each", placements),
                ("Things", "What stands around the body, and walls", things),
                ("Bodies", "Who else moves in the scene", bodies),
                inset_px=8,
            )
        }
