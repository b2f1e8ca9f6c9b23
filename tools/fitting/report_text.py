"""The tables of a scored fit as text and as Markdown."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from sd2core.files.tables import markdown_table, text_table
from tools.fitting.clip_score import ClipScore
from tools.fitting.real_score import RealScore
from tools.fitting.report import Row, clip_table, gesture_table, reach_table

Table = list[list[str]]

_GESTURES = (
    ("gesture", "gesture"),
    ("speed", "speed"),
    ("count", "n"),
    ("hand_true_rms_mps", "hand: true RMS (m/s)"),
    ("hand_rms_mps", "error RMS (m/s)"),
    ("hand_correlation", "correlation"),
    ("peak_kept", "peak kept"),
    ("map_l1", "map L1"),
)
_CLIPS = (
    ("clip", "clip"),
    ("joint_distance_m", "joints (m)"),
    ("velocity_rms_mps", "velocity error RMS (m/s)"),
    ("velocity_correlation", "correlation"),
    ("spread_ratio", "spread"),
    ("peak_kept", "peak kept"),
    ("map_l1", "map L1"),
    ("plain_l1", "plain"),
    ("stated_l1", "stated"),
)
_REAL = (
    ("name", "video"),
    ("overlap", "silhouette"),
    ("reprojection_m", "landmarks (m)"),
)


def as_text(scores: Sequence[ClipScore], real: Sequence[RealScore] = ()) -> str:
    """For a terminal."""
    reach = [["what", "measured", "wanted", "met", "remarks"]]
    for row in reach_table(scores, real):
        met = {None: "", True: "yes", False: "no"}[row.met]
        reach.append([row.what, _measured(row), row.wanted, met, row.detail])
    parts = []
    for heading, rows in _tables(reach, gesture_table(scores), scores, real):
        parts.append("\n".join([heading, *(f"  {line}" for line in text_table(rows, ()))]))
    return "\n\n".join(parts)


def as_markdown(scores: Sequence[ClipScore], real: Sequence[RealScore] = ()) -> str:
    """For docs/fitting.md: what has a target, in bold where missed, and gestures at all speeds."""
    reach = [["what", "measured", "wanted"]]
    for row in reach_table(scores, real):
        if row.reach is not None:
            mark = "**" if row.met is False else ""
            reach.append([row.what, f"{mark}{_measured(row)}{mark}", row.wanted])
    gestures = [one for one in gesture_table(scores) if one["speed"] == "all"]
    parts = []
    for heading, rows in _tables(reach, gestures, scores, real):
        parts.append("\n".join([f"**{heading}**", "", *markdown_table(rows)]))
    return "\n\n".join(parts) + "\n"


def _tables(
    reach: Table,
    gestures: Sequence[dict[str, Any]],
    scores: Sequence[ClipScore],
    real: Sequence[RealScore],
) -> list[tuple[str, Table]]:
    tables = [("Reach", reach)]
    for heading, columns, rows in (
        ("Gestures", _GESTURES, gestures),
        ("Clips", _CLIPS, clip_table(scores)),
        ("Real videos", _REAL, [one.as_dict() for one in real]),
    ):
        if rows:
            body = [[_cell(row[key]) for key, _ in columns] for row in rows]
            tables.append((heading, [[name for _, name in columns], *body]))
    return tables


def _measured(row: Row) -> str:
    return f"{_number(row.value)} {row.unit}".strip()


def _cell(value: Any) -> str:
    return _number(value) if isinstance(value, float) else "" if value is None else str(value)


def _number(value: float) -> str:
    if not math.isfinite(value):
        return "–" if math.isnan(value) else "∞"
    return f"{value:.3f}" if abs(value) < 10 else f"{value:.1f}"
