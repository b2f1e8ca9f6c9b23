"""Placements in words: how many, what is wrong with some, and what their maps cost."""

from __future__ import annotations

from sd2app.accuracy.text import InUse
from sd2app.sensor.placements import PlacementsModel
from sd2app.widgets.text import bytes_text, counted, duration_text, seconds
from sd2core.placements.placements import PlacementCost

_SHORT_S = 10.0


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
    facts = (
        ("In the body", coverage.inside),
        (f"Beyond R max {radar.range_max_m:.1f} m", coverage.out_of_range(radar)),
        (f"Faster than ±{radar.v_max_mps:.2f} m/s", coverage.aliasing(radar)),
    )
    return [(name, f"{int(some.sum()):,}") for name, some in facts if some.any()]


def limits_text(model: PlacementsModel) -> str:
    """Limits of the radar, and if the placements keep within them."""
    coverage, radar = model.planned.coverage, model.radar
    if coverage is None:
        return "Looking at what they see…" if model.planned.places else ""
    where = f"{radar.name}: {radar.range_max_m:.1f} m, ±{radar.v_max_mps:.2f} m/s."
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
