"""Planned placements of further sensors: positions, coverage, cost of their maps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol

from PySide6.QtCore import QObject, Signal

from sd2app.accuracy.model import AccuracyModel
from sd2app.background.latest import Emit, LatestRunner
from sd2app.session.document import DocumentModel
from sd2app.session.sensor import SensorModel
from sd2core.mesh.sequence import MeshSequence
from sd2core.placements.body_extent import BodyExtent, SensorCoverage
from sd2core.placements.placements import Place, PlacementCost, Placements
from sd2core.radar_config import PAPER_RADAR, RadarConfig
from sd2core.sensor import VelocityAxis, VirtualSensor


@dataclass(frozen=True, eq=False)
class Planned:
    """The places of a plan around one body, with a sensor per place."""

    places: tuple[Place, ...] = ()
    sensors: tuple[VirtualSensor, ...] = ()
    coverage: SensorCoverage | None = None  # what each sees; None while it is computed


class PlanEdits(Protocol):
    """Undoable edits of the plan."""

    def plan_placements(self, placements: Placements | None) -> None:
        """Plan other places, or none."""

    def type_placements(self, placements: Placements | None) -> None:
        """Plan other places while they are typed."""

    def end_typing_placements(self) -> None:
        """End typing: all of it is one step in the history."""

    def place_sensor(self, sensor: VirtualSensor, text: str) -> None:
        """Place the sensor."""


class _Wish(NamedTuple):
    mesh: MeshSequence
    plan: Placements


class PlacementsModel(QObject):
    """Plan of the open recording; its placements are computed in the background."""

    changed = Signal()  # places, their coverage or their cost
    current_changed = Signal()  # the sensor is at another of them, or elsewhere
    failed = Signal(str)

    def __init__(
        self,
        document: DocumentModel,
        sensor: SensorModel,
        trade: AccuracyModel,
        edits: PlanEdits,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._document = document
        self._sensor = sensor
        self._trade = trade
        self.edits = edits
        self._shown = True
        self._wish: _Wish | None = None
        self._body: tuple[MeshSequence, BodyExtent] | None = None
        self._planned = Planned()
        self._runner = LatestRunner("placements", self)
        self._runner.partial.connect(self._receive)
        self._runner.finished.connect(self._receive)
        self._runner.failed.connect(self._fail)
        document.opened.connect(self._follow)
        document.changed.connect(self._follow)
        sensor.changed.connect(self.current_changed)
        trade.plan_changed.connect(self.changed)

    # --- what is planned ------------------------------------------------------------------

    @property
    def plan(self) -> Placements | None:
        """The recording's plan."""
        recording = self._document.recording
        return recording.placements if recording is not None else None

    @property
    def possible(self) -> bool:
        """True if there is a body to place sensors around."""
        return self._document.mesh is not None

    @property
    def busy(self) -> bool:
        """True while placements are being computed."""
        return self._runner.busy

    @property
    def planned(self) -> Planned:
        """Placements of the plan; empty until they are computed."""
        return self._planned

    @property
    def radar(self) -> RadarConfig:
        """Radar whose limits hold: that of the recording's capture, or the paper's."""
        capture = self._document.capture
        return PAPER_RADAR if capture is None else capture.config

    @property
    def current(self) -> int | None:
        """Index of the placement that the sensor is at; None elsewhere."""
        position = self._sensor.sensor.position_m
        for number, sensor in enumerate(self._planned.sensors):
            if sensor.position_m == position:
                return number
        return None

    @property
    def cost(self) -> PlacementCost | None:
        """Cost of one map per placement with the plan in use; None while there is no plan."""
        in_use = self._trade.in_use
        if in_use is None or not self._planned.sensors:
            return None
        return PlacementCost(
            len(self._planned.sensors), self._trade.frames, in_use.cost_ms, VelocityAxis().bins
        )

    @property
    def shown(self) -> bool:
        """True while the placements are drawn in the scene."""
        return self._shown

    # --- requests -------------------------------------------------------------------------

    def set_shown(self, shown: bool) -> None:
        """Draw the places in the scene, or not."""
        if shown != self._shown:
            self._shown = shown
            self.changed.emit()

    def use(self, number: int) -> None:
        """Put the sensor at one of the places."""
        sensors = self._planned.sensors
        if 0 <= number < len(sensors):
            view_deg = self._sensor.sensor.field_of_view_deg
            sensor = replace(sensors[number], field_of_view_deg=view_deg)
            self.edits.place_sensor(sensor, "Sensor to placement")

    def step(self, by: int) -> None:
        """Put the sensor at the next place, or the one before; from elsewhere at the first."""
        count = len(self._planned.sensors)
        if count:
            current = self.current
            self.use(0 if current is None else (current + by) % count)

    def close(self) -> None:
        """Stop computing placements."""
        self._runner.close()

    # --- following ------------------------------------------------------------------------

    def _follow(self) -> None:
        mesh, plan = self._document.mesh, self.plan
        wish = _Wish(mesh, plan) if mesh is not None and plan is not None else None
        if wish == self._wish:
            return
        if wish is None or self._wish is None or wish.mesh is not self._wish.mesh:
            self._planned = Planned()  # places of another body say nothing of this one
        self._wish = wish
        if wish is None:
            self._runner.cancel()
        else:
            known = self._body
            self._runner.submit(lambda emit: _compute_view(wish, known, emit))
        self.changed.emit()

    def _receive(self, result: Any) -> None:
        self._body, self._planned = result
        self.changed.emit()

    def _fail(self, error: Exception) -> None:
        self._planned = Planned()
        self.failed.emit(str(error))
        self.changed.emit()


def _compute_view(
    wish: _Wish, known: tuple[MeshSequence, BodyExtent] | None, emit: Emit
) -> tuple[tuple[MeshSequence, BodyExtent], Planned]:
    """Compute in the background: the places first, then what they see."""
    body = known if known is not None and known[0] is wish.mesh else None
    if body is None:
        body = (wish.mesh, BodyExtent.of(wish.mesh))
    places = wish.plan.places()
    sensors = tuple(place.sensor(body[1].target_m) for place in places)
    emit((body, Planned(places, sensors)))
    coverage = body[1].coverage(sensors, lambda done, total: emit(None))
    return body, Planned(places, sensors, coverage)
