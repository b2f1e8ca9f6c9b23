"""What of the labels is under the pointer."""

from __future__ import annotations

from typing import Literal, NamedTuple

from sd2app.labels.model import LabelsModel
from sd2app.labels.rows import LabelRows
from sd2app.widgets.time_axis import GUTTER_PX, TimeScale
from sd2core.labels.spans import Span

_EDGE_PX = 5.0


class Grip(NamedTuple):
    """What a hand takes hold of, and where."""

    part: Literal["start", "end", "span", "nothing", "name"]
    x_px: float
    track: str
    span: Span | None = None


def grip_at(
    labels: LabelsModel, rows: LabelRows, scale: TimeScale, x_px: float, y_px: float
) -> Grip | None:
    """What is at a place of the timeline; edges of what is selected go first."""
    row = rows.row_at(y_px)
    if row is None:
        return None
    if x_px < GUTTER_PX:
        return Grip("name", x_px, row.name)
    arrays = labels.arrays
    reach_s = _EDGE_PX * scale.seconds_per_px
    time_s, lane = scale.time_of(x_px), row.lane_at(y_px)
    near = [
        arrays.spans[one]
        for one in arrays.within(time_s - reach_s, time_s + reach_s)
        if arrays.spans[one].track == row.name and arrays.lanes[one] == lane
    ]
    near.sort(key=lambda one: not labels.is_selected(one.id))
    for span in near:
        # The middle third of a short span is for moving it.
        edge_s = min(reach_s, span.duration_s / 3)
        inside = span.start_s <= time_s < span.end_s
        if abs(time_s - span.start_s) <= (edge_s if inside else reach_s):
            return Grip("start", x_px, row.name, span)
        if abs(time_s - span.end_s) <= (edge_s if inside else reach_s):
            return Grip("end", x_px, row.name, span)
    held = next((one for one in near if one.start_s <= time_s < one.end_s), None)
    return Grip("nothing" if held is None else "span", x_px, row.name, held)


def words(grip: Grip) -> str:
    """What to say of it beside the pointer."""
    span = grip.span
    if span is None:
        return grip.track if grip.part == "name" else ""
    lines = [f"{span.label}: {span.start_s:.3f} to {span.end_s:.3f} s ({span.duration_s:.3f} s)"]
    lines += [span.note] if span.note else []
    return "\n".join(lines)
