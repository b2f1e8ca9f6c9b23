"""The tables of a scored fit as text and as Markdown."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from tools.fitting.clip_score import ClipScore
from tools.fitting.real_score import RealScore
from tools.fitting.report import clip_table, gesture_table, reach_table

_GESTURES = (
    ("gesture", "gesture"),
    ("speed", "speed"),
    ("count", "n"),
    ("hand_true_rms_mps", "hand: true RMS (m/s)"),
    ("hand_rms_mps", "error RMS (m/s)"),
    ("hand_correlation", "correlation"),
    ("peak_kept", "peak kept"),
    ("elbow_rms_mps", "elbow: error RMS (m/s)"),
    ("elbow_correlation", "correlation"),
    ("map_l1", "map L1"),
)
_CLIPS = (
    ("clip", "clip"),
    ("joint_distance_m", "joints (m)"),
    ("joint_distance_from_pelvis_m", "from pelvis (m)"),
    ("velocity_rms_mps", "velocity error RMS (m/s)"),
    ("velocity_correlation", "correlation"),
    ("map_l1", "map L1"),
    ("edge_velocity_ratio", "ends: velocity"),
    ("edge_place_ratio", "ends: place"),
    ("silhouette_overlap", "silhouette"),
    ("sigma_coverage", "1σ covers"),
    ("residual_m", "residual (m)"),
    ("seconds_per_frame", "s/frame"),
)
_REAL = (
    ("name", "video"),
    ("overlap", "silhouette, mean"),
    ("overlap_least", "least"),
    ("reprojection_px", "landmarks (px)"),
    ("reprojection_m", "(m)"),
    ("residual_m", "residual (m)"),
    ("residual_near_m", "with 0.7 of the focal length"),
    ("residual_far_m", "with 1.5 of it"),
)


def as_text(scores: Sequence[ClipScore], real: Sequence[RealScore] = ()) -> str:
    """For a terminal."""
    parts = []
    for heading, rows in _tables(scores, real):
        widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
        lines = [
            "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
            for row in rows
        ]
        parts.append("\n".join([heading, *(f"  {line}" for line in lines)]))
    return "\n\n".join(parts)


def as_markdown(scores: Sequence[ClipScore], real: Sequence[RealScore] = ()) -> str:
    """For docs/fitting.md."""
    parts = []
    for heading, rows in _tables(scores, real):
        lines = [f"**{heading}**", ""]
        for number, row in enumerate(rows):
            lines.append("| " + " | ".join(row) + " |")
            if number == 0:
                lines.append("|" + "---|" * len(row))
        parts.append("\n".join(lines))
    return "\n\n".join(parts) + "\n"


def _tables(
    scores: Sequence[ClipScore], real: Sequence[RealScore]
) -> list[tuple[str, list[list[str]]]]:
    reach = [["what", "measured", "wanted", "met", "remarks"]]
    for row in reach_table(scores, real):
        value = f"{_number(row.value)} {row.unit}".strip()
        met = {None: "", True: "yes", False: "no"}[row.met]
        reach.append([row.what, value, row.wanted, met, row.detail])
    tables = [("Reach", reach)]
    for heading, columns, rows in (
        ("Gestures", _GESTURES, gesture_table(scores)),
        ("Clips", _CLIPS, clip_table(scores)),
        ("Real videos", _REAL, [one.as_dict() for one in real]),
    ):
        if rows:
            body = [[_cell(row[key]) for key, _ in columns] for row in rows]
            tables.append((heading, [[name for _, name in columns], *body]))
    return tables


def _cell(value: Any) -> str:
    return _number(value) if isinstance(value, float) else "" if value is None else str(value)


def _number(value: float) -> str:
    if not math.isfinite(value):
        return "–" if math.isnan(value) else "∞"
    return f"{value:.3f}" if abs(value) < 10 else f"{value:.1f}"
