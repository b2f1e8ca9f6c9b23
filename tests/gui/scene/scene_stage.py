"""A scene view over small stand-ins for the models that compute."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from PySide6.QtCore import QObject, QPoint, Signal
from PySide6.QtGui import QColor

from sd2app.sensor.placements import Planned
from sd2app.session.display import DisplayModel
from sd2app.session.playback import PlaybackModel
from sd2app.session.sensor import SensorModel
from sd2app.session.session import Mode
from sd2core.maps import OF
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.vertex_parts import VertexParts
from sd2core.placements.body_extent import SensorCoverage
from sd2core.placements.placements import Place
from sd2core.radar_config import PAPER_RADAR
from sd2core.timebase import Timebase


class Document(QObject):
    """A recording with a mesh, or none."""

    opened = Signal()
    changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.mesh: MeshSequence | None = None
        self.recording: Any = None


class Synthesis(QObject):
    """Scattering as the test wants it."""

    frame_changed = Signal()
    v_max_mps = 2.0

    def __init__(self) -> None:
        super().__init__()
        self.frame: Any = None
        self.asked = 0

    def __getattribute__(self, name: str) -> Any:
        if name == "frame":
            super().__setattr__("asked", super().__getattribute__("asked") + 1)
        return super().__getattribute__(name)


class Placements(QObject):
    """Planned places as the test wants them, and which was picked."""

    changed = Signal()
    radar = PAPER_RADAR
    shown = True

    def __init__(self) -> None:
        super().__init__()
        self.planned = Planned()
        self.picked: list[int] = []

    def use(self, number: int) -> None:
        self.picked.append(number)


class Inertial(QObject):
    """Inertial sensors by their places, and which vertices were clicked."""

    changed = Signal()
    current = None

    def __init__(self) -> None:
        super().__init__()
        self.vertices: dict[str, int] = {}
        self.clicked: list[int] = []

    def place_at(self, vertex: int) -> str:
        return str(vertex)

    def place(self, vertex: int) -> None:
        self.clicked.append(vertex)


class Limbs(QObject):
    """Two parts of the two plates, and what was picked."""

    changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.parts: tuple[str, ...] = ()
        self.vertex_parts: VertexParts | None = None
        self.persons: tuple[str, ...] = ()
        self.picked: list[tuple[str | None, bool]] = []

    def part_of(self, vertex: int, body: int = 0) -> str | None:
        known = self.vertex_parts
        if known is None:
            return None
        its = (known, *known.others)[body]
        return OF.join([*self.persons[body : body + 1], its.names[its.numbers[vertex]]])

    def pick(self, part: str | None, *, adds: bool) -> None:
        self.picked.append((part, adds))


class Drag:
    """Edits of the sensor by a drag, which are written down."""

    def __init__(self, sensor: SensorModel, log: list[str]) -> None:
        self._sensor, self._log = sensor, log

    def begin_sensor_drag(self) -> None:
        self._log.append("begin")
        self._sensor.set_dragging(True)

    def drag_sensor(self, position_m: tuple[float, float, float]) -> None:
        self._log.append("drag")
        self._sensor.set_sensor(replace(self._sensor.sensor, position_m=position_m))

    def end_drag(self) -> None:
        self._log.append("end")
        self._sensor.set_dragging(False)

    def begin_scene_drag(self, number: int) -> None:
        self._log.append(f"take {number}")

    def drag_in_scene(self, by_m: tuple[float, float, float]) -> None:
        self._log.append("move")


@dataclass
class Stage:
    """The view with everything it follows."""

    view: Any
    document: Document
    playback: PlaybackModel
    sensor: SensorModel
    display: DisplayModel
    synthesis: Synthesis
    placements: Placements
    inertial: Inertial
    placing: Mode
    limbs: Limbs
    log: list[str]

    def open(self, mesh: MeshSequence | None) -> None:
        """Show another recording."""
        self.document.mesh, self.document.recording = mesh, "a recording"
        if mesh is not None:
            self.playback.set_timebase(mesh.timebase)
        self.document.opened.emit()

    def scatter(self, velocity_mps: Any, visible: Any) -> None:
        """Hand the view other velocities and visibility; vertex N is N metres away."""
        self.synthesis.frame = SimpleNamespace(
            velocity_mps=np.asarray(velocity_mps, np.float32),
            visible=np.asarray(visible, bool),
            range_m=np.arange(len(visible), dtype=np.float32),
        )
        self.synthesis.frame_changed.emit()

    def plan(self, places: tuple[Place, ...], beyond: tuple[bool, ...] | None = None) -> None:
        """Plan places around (0, 0, 2)."""
        sensors = tuple(place.sensor((0.0, 0.0, 2.0)) for place in places)
        coverage = None
        if beyond is not None:
            nothing = np.zeros(len(places))
            coverage = SensorCoverage(np.array(beyond), nothing, nothing)
        self.placements.planned = Planned(places, sensors, coverage)
        self.placements.changed.emit()

    def marker_middles_m(self) -> list[tuple[float, float, float]]:
        """Inside every marker, away from its edges."""
        return [
            tuple(np.add(sensor.position_m, np.multiply(0.03, sensor.boresight)).tolist())
            for sensor in self.placements.planned.sensors
        ]

    def pixel_of(self, point_m: tuple[float, float, float]) -> QPoint:
        """Where in the view a point is."""
        x, y, _ = self.view.scene.pose.project(point_m)[0]
        return QPoint(round(x), round(y))

    def colour_at(self, point_m: tuple[float, float, float]) -> QColor:
        """Colour of the picture where a point is."""
        picture = self.view.grab().toImage()
        return picture.pixelColor(self.pixel_of(point_m))


def two_plates(frames: int = 1) -> MeshSequence:
    """A left and a right square 2 m ahead, facing the camera; frame k is k/10 m nearer."""
    square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * 0.25
    left = np.column_stack([np.add(square, (-0.4, 0.0)), np.full(4, 2.0)])
    vertices = np.concatenate([left, np.add(left, (0.8, 0.0, 0.0))])
    faces = np.array([(0, 1, 2), (0, 2, 3)])
    steps = np.arange(frames)[:, None, None] * (0.0, 0.0, -0.1)
    return MeshSequence(
        (vertices + steps).astype(np.float32),
        np.concatenate([faces, faces + 4])[:, ::-1],
        Timebase.regular(frames, 10.0),
    )


LEFT, RIGHT = (-0.4, 0.0, 2.0), (0.4, 0.0, 2.0)
