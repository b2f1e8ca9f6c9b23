"""Planned placements of further sensors: positions, coverage, cost of maps, fields of a form."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal, get_args

from PySide6.QtCore import QObject, Signal

from sd2app.accuracy.measurements import InUse
from sd2app.accuracy.model import AccuracyModel
from sd2app.background.latest import Emit, LatestRunner, ReportingModel
from sd2app.session.session import Session
from sd2app.widgets.text import bytes_text, counted, duration_text, seconds
from sd2core.errors import Sd2Error
from sd2core.files.number_lists import format_numbers, parse_interval, parse_numbers, parse_quantity
from sd2core.mesh.sequence import MeshSequence
from sd2core.placements.body_extent import BodyExtent, SensorCoverage
from sd2core.placements.placements import (
    Place,
    PlacementCloud,
    PlacementCost,
    PlacementGrid,
    Placements,
)
from sd2core.radar_config import PAPER_RADAR, RadarConfig, range_in_words
from sd2core.sensor import VelocityAxis, VirtualSensor

_SHORT_S = 10.0
"""Time up to which the cost of all maps is said exactly."""


@dataclass(frozen=True, eq=False)
class Planned:
    """The places of a plan around one body, with a sensor per place."""

    places: tuple[Place, ...] = ()
    sensors: tuple[VirtualSensor, ...] = ()
    coverage: SensorCoverage | None = None  # what each sees; None while it is computed


class PlacementsModel(ReportingModel):
    """Plan of the open recording; its placements are computed in the background."""

    changed = Signal()  # places, their coverage or their cost
    current_changed = Signal()  # the sensor is at another of them, or elsewhere

    def __init__(self, session: Session, accuracy: AccuracyModel, parent: QObject) -> None:
        super().__init__(parent)
        self._document, self._sensor = session.document, session.sensor
        self._accuracy = accuracy
        self.edits = session.edits
        self.planned = Planned()  # empty until the places are computed
        self.shown = True  # in the scene
        self._asked: tuple[MeshSequence, Placements] | None = None
        self._extent_of = lru_cache(maxsize=1)(BodyExtent.of)
        self._runner = LatestRunner("placements", self, self._receive, self._fail)
        self._runner.partial.connect(self._receive)
        self._document.opened.connect(self._follow)
        self._document.changed.connect(self._follow)
        self._sensor.changed.connect(self.current_changed)
        accuracy.plan_changed.connect(self.changed)

    @property
    def plan(self) -> Placements | None:
        """The recording's plan."""
        recording = self._document.recording
        return recording.placements if recording is not None else None

    @property
    def file_name(self) -> str:
        """Proposed name of a file of the plan."""
        return self._document.file_name("-placements.json")

    @property
    def possible(self) -> bool:
        """True if there is a body to place sensors around."""
        return self._document.mesh is not None

    @property
    def radar(self) -> RadarConfig:
        """Radar whose limits hold: that of the recording's capture, or the paper's."""
        capture = self._document.capture
        return PAPER_RADAR if capture is None else capture.config

    @property
    def current(self) -> int | None:
        """Index of the placement that the sensor is at; None elsewhere."""
        position, places = self._sensor.sensor.position_m, self.planned.sensors
        return next((k for k, one in enumerate(places) if one.position_m == position), None)

    @property
    def cost(self) -> PlacementCost | None:
        """Cost of one map per placement with the plan in use; None while there is no plan."""
        in_use = self._accuracy.in_use
        if in_use is None or not self.planned.sensors:
            return None
        return PlacementCost(
            len(self.planned.sensors), self._accuracy.frames, in_use.cost_ms, VelocityAxis().bins
        )

    def set_shown(self, shown: bool) -> None:
        """Draw the places in the scene, or not."""
        if shown != self.shown:
            self.shown = shown
            self.changed.emit()

    def use(self, number: int) -> None:
        """Put the sensor at one of the places."""
        sensors = self.planned.sensors
        if 0 <= number < len(sensors):
            sensor = replace(sensors[number], beam=self._sensor.sensor.beam)
            self.edits.place_sensor(sensor, "Sensor to placement")

    def step(self, by: int) -> None:
        """Put the sensor at the next place, or the one before; from elsewhere at the first."""
        count = len(self.planned.sensors)
        if count:
            current = self.current
            self.use(0 if current is None else (current + by) % count)

    def _follow(self) -> None:
        mesh, plan = self._document.mesh, self.plan
        before, asked = self._asked, (mesh, plan) if mesh is not None and plan is not None else None
        if asked == before:
            return
        self._asked = asked
        if asked is None or before is None or asked[0] is not before[0]:
            self.planned = Planned()  # places of another body say nothing of this one
        if asked is None:
            self._runner.cancel()
        else:
            self._runner.submit(lambda emit: self._plan_around(*asked, emit))
        self.changed.emit()

    def _plan_around(self, mesh: MeshSequence, plan: Placements, emit: Emit) -> Planned:
        """Compute in the background: the places first, then what they see."""
        body, places = self._extent_of(mesh), plan.places()
        sensors = tuple(place.sensor(body.target_m) for place in places)
        emit(Planned(places, sensors))
        coverage = body.coverage(sensors, lambda done, total: emit(None))
        return Planned(places, sensors, coverage)

    def _receive(self, planned: Planned) -> None:
        self.planned = planned
        self.changed.emit()

    def _fail(self, error: Exception) -> None:
        self.planned = Planned()
        super()._fail(error)
        self.changed.emit()


def count_text(model: PlacementsModel) -> str:
    """Number of placements."""
    if model.plan is None:
        return ""
    count = len(model.planned.places)
    return counted(count, "placement") if count else "Computing the placements…"


def limit_facts(model: PlacementsModel) -> list[tuple[str, str]]:
    """Number of placements with each problem."""
    coverage, radar = model.planned.coverage, model.radar
    if coverage is None:
        return []
    words = {
        "inside": "In the body",
        "out_of_range": f"Beyond R max {radar.range_max_m:.1f} m",
        "aliasing": f"Faster than ±{radar.v_max_mps:.2f} m/s",
    }
    problems = coverage.problems(radar).items()
    return [(words[name], f"{int(some.sum()):,}") for name, some in problems if some.any()]


def limits_text(model: PlacementsModel) -> str:
    """Limits of the radar, and if the placements keep within them."""
    coverage, radar = model.planned.coverage, model.radar
    if coverage is None:
        return "Looking at what they see…" if model.planned.places else ""
    # Unbroken, or a line could end within the unit.
    v_max = f"±{radar.v_max_mps:.2f}\N{NO-BREAK SPACE}m/\N{WORD JOINER}s"
    where = f"{radar.name}: {range_in_words(radar.range_max_m)}, {v_max}."
    if not coverage.beyond(radar).any():
        return f"All within the limits of the radar. {where}"
    return f"Beyond the radar, part of the body is seen at another range or velocity. {where}"


def current_text(model: PlacementsModel) -> str:
    """Number of the placement that the sensor is at."""
    current, places = model.current, model.planned.places
    if current is None:
        return "The sensor is elsewhere"
    return f"{current + 1:,} of {len(places):,}: {places[current].words}"


def cost_text(cost: PlacementCost) -> str:
    """Cost in one line."""
    time = seconds(cost.total_s) if cost.total_s < _SHORT_S else duration_text(cost.total_s)
    return f"{counted(cost.maps, 'map')} in about {time}, {bytes_text(cost.total_bytes)}"


def cost_source_text(cost: PlacementCost, in_use: InUse) -> str:
    """Explanation of the estimated cost."""
    return (
        f"{counted(cost.frames, 'frame')} each, with the plan in use on this machine: {in_use}."
        " Bytes before compression."
    )


Kind = Literal["none", "grid", "cloud"]
Name = Literal["range", "azimuth", "elevation", "count", "seed"]
NAMES: tuple[Name, ...] = get_args(Name)

_UNITS: dict[Name, str] = {"range": "m", "azimuth": "°", "elevation": "°"}
_WITH_UNIT = re.compile(r"[^,:\s]+\s*[^\W\d]+|[^,:\s]+\s*°")
"""A number and letters behind it."""

_FIRST: dict[Kind, Placements | None] = {
    "none": None,
    "grid": PlacementGrid((1.0, 2.0, 3.0, 4.0), (-60.0, -30.0, 0.0, 30.0, 60.0)),
    "cloud": PlacementCloud(100, (1.0, 4.0), (-60.0, 60.0), (-10.0, 40.0)),
}
"""First plan of each kind."""


class PlacementFields(QObject):
    """Typed fields of a plan of placements; valid ones become the plan.

    Another plan, as after an undo or in another recording, takes the place of what was typed.
    """

    changed = Signal()

    def __init__(self, placements: PlacementsModel, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._placements = placements
        self._last = dict(_FIRST)
        self._plan: Placements | None = None
        self.texts: dict[Name, str] = {}  # of the fields that this kind of plan has
        self.problem = ""  # why the typed values are no plan; empty when they are
        placements.changed.connect(self._follow)
        self._follow()

    @property
    def kind(self) -> Kind:
        """Kind of the plan."""
        return "none" if self._plan is None else _kind(self._plan)

    def set_kind(self, kind: Kind) -> None:
        """Plan something else; what was typed for a kind comes back with it."""
        if kind != self.kind:
            self._placements.edits.plan_placements(self._last[kind])

    def set_text(self, name: Name, text: str) -> None:
        """Type into a field; :meth:`end` makes it one step."""
        if name not in self.texts or text == self.texts[name]:
            return
        self.texts[name] = text
        try:
            plan = _plan_of(self.kind, self.texts)
        except Sd2Error as error:
            self.problem = str(error)
            self.changed.emit()
            return
        self.problem = ""
        # What was typed stays as it was typed.
        self._plan = self._last[self.kind] = plan
        self._placements.edits.type_placements(plan)
        self.changed.emit()

    def end(self) -> None:
        """End typing: one step in the history."""
        self._placements.edits.end_drag()

    def _follow(self) -> None:
        plan = self._placements.plan
        if plan == self._plan:
            return
        self._plan = plan
        self.problem = ""
        self.texts = {} if plan is None else _texts_of(plan)
        if plan is not None:
            self._last[_kind(plan)] = plan
        self.changed.emit()


def _kind(plan: Placements) -> Kind:
    return "grid" if isinstance(plan, PlacementGrid) else "cloud"


def _texts_of(plan: Placements) -> dict[Name, str]:
    if isinstance(plan, PlacementGrid):
        return {
            "range": format_numbers(plan.ranges_m),
            "azimuth": format_numbers(plan.azimuths_deg),
            "elevation": format_numbers(plan.elevations_deg),
        }
    return {
        "range": _interval_text(plan.range_m),
        "azimuth": _interval_text(plan.azimuth_deg),
        "elevation": _interval_text(plan.elevation_deg),
        "count": str(plan.count),
        "seed": str(plan.seed),
    }


def _plan_of(kind: Kind, texts: dict[Name, str]) -> Placements:
    around = [_plain(texts[name], unit) for name, unit in _UNITS.items()]
    if kind == "grid":
        ranges_m, azimuths_deg, elevations_deg = map(parse_numbers, around)
        return PlacementGrid(ranges_m, azimuths_deg, elevations_deg)
    range_m, azimuth_deg, elevation_deg = map(parse_interval, around)
    count, seed = (_whole(name, texts[name]) for name in ("count", "seed"))
    return PlacementCloud(count, range_m, azimuth_deg, elevation_deg, seed)


def _plain(text: str, unit: str) -> str:
    """Numbers without their units: ``1, 250 cm`` as ``1, 2.5``; what is no number stays."""

    def value_of(match: re.Match[str]) -> str:
        try:
            return repr(parse_quantity(match[0], unit))
        except Sd2Error:
            return match[0]

    return _WITH_UNIT.sub(value_of, text)


def _whole(name: str, text: str) -> int:
    digits = text.strip()
    if not (digits.isascii() and digits.isdigit() and len(digits) < 20):
        raise Sd2Error(f"{text!r} is the {name}", "a whole number")
    return int(digits)


def _interval_text(interval: tuple[float, float]) -> str:
    low, high = (format_numbers([edge]) for edge in interval)
    return low if low == high else f"{low}:{high}"
