"""A plan of placements as fields to type into."""

from __future__ import annotations

import re
from typing import Literal, get_args

from PySide6.QtCore import QObject, Signal

from sd2app.sensor.placements import PlacementsModel
from sd2core.errors import Sd2Error
from sd2core.files.number_lists import format_numbers, parse_interval, parse_numbers, parse_quantity
from sd2core.placements.placements import PlacementCloud, PlacementGrid, Placements

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
