"""Tables of the scores of many clips, each figure beside its target."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sd2core.compare.joints import JOINTS
from sd2core.compare.measures import correlation, rms
from tools.fitting.clip_score import ClipScore, Pair, StrokeScore, pooled
from tools.fitting.measures import coverage
from tools.fitting.real_score import RealScore

Reach = tuple[str, float] | None
"""``"<="`` or ``">="`` and what is wanted."""


@dataclass(frozen=True)
class Row:
    """One figure.

    Parameters
    ----------
    value : float
        NaN when nothing could be measured.
    unit : str
        Empty for a ratio.
    reach : (str, float) or None
        ``"<="`` or ``">="`` and what is wanted.
    upper : float
        Upper end of a range that is wanted, with ``reach`` its lower end.
    """

    what: str
    value: float
    unit: str = ""
    reach: Reach = None
    upper: float = math.inf
    detail: str = ""

    @property
    def met(self) -> bool | None:
        """True if the value meets its target; None without a target or a value."""
        if self.reach is None or not math.isfinite(self.value):
            return None
        sign, wanted = self.reach
        return self.value <= wanted if sign == "<=" else wanted <= self.value <= self.upper

    @property
    def wanted(self) -> str:
        """The reach in words."""
        if self.reach is None:
            return ""
        if math.isfinite(self.upper):
            return f"{self.reach[1]:g} to {self.upper:g}"
        return f"{'≤' if self.reach[0] == '<=' else '≥'} {self.reach[1]:.3g}"


def reach_table(scores: Sequence[ClipScore], real: Sequence[RealScore] = ()) -> list[Row]:
    """The figures that the fit is judged by.

    Parameters
    ----------
    scores : sequence of ClipScore
        Of clips whose motion is known.
    real : sequence of RealScore
        Of real videos.
    """
    strokes = [stroke for score in scores for stroke in score.strokes]
    fast = [stroke for stroke in strokes if stroke.speed == "fast"]
    residuals = [one.residual_m for one in scores if one.residual_m is not None]
    rows = [
        Row(
            "fit residual: joints to the landmarks found, in the picture, mean",
            100.0 * _mean(residuals),
            "cm",
            ("<=", 3.0),
            detail="at the joint's depth" if residuals else "no landmarks are kept",
        )
    ]
    limits: dict[str, tuple[Reach, Reach]] = {
        "hand": (("<=", 0.215), (">=", 0.957)),
        "wrist": (None, None),
        "elbow": (None, (">=", 0.8)),
    }
    for limb, (error, same) in limits.items():
        pair = pooled([stroke.velocity[limb] for stroke in strokes])
        what = f"{limb}s during gestures, line-of-sight velocity"
        detail = f"true RMS {rms(pair.truth):.2f} m/s, {len(strokes)} gestures"
        value = pair.error if strokes else math.nan
        rows.append(Row(f"{what}: RMS error", value, "m/s", error, detail=detail))
        rows.append(Row(f"{what}: correlation", pair.correlation, "", same))
    for name, kept in (
        ("along the line of sight", [stroke.velocity["hand"].peak_kept for stroke in fast]),
        ("in space", [stroke.tempo["hand"].peak_kept for stroke in fast]),
    ):
        detail = f"median of {len(kept)}; least {min(kept):.2f}" if kept else ""
        rows.append(
            Row(
                f"fast swipes: peak hand speed kept, {name}",
                _median(kept),
                "",
                (">=", 0.85),
                detail=detail,
            )
        )
    still = [score for score in scores if score.kind == "still"]
    worst = max((score.vertex_velocity_mps for score in still), default=math.nan)
    rows.append(
        Row(
            "who stands still: false velocity, RMS over vertices",
            worst,
            "m/s",
            ("<=", 0.015),
            detail=", ".join(f"{one.name} {one.vertex_velocity_mps:.3f}" for one in still),
        )
    )
    rows.append(
        Row(
            "Doppler map of the gestures, relative L1",
            _map_l1(strokes),
            "",
            ("<=", 0.40),
            detail="fitted against true mesh, after smoothing",
        )
    )
    rows += _edge_rows(scores)
    rows += _walk_rows(scores) + _captured_rows(scores) + _coverage_rows(scores)
    stated = [one for one in scores if one.stated_l1 is not None and not one.quiet]
    if stated:
        within = [one.map_l1 <= (one.stated_l1 or 0.0) for one in stated]
        what = "clips whose map is as near to the truth as it states"
        rows.append(Row(what, _mean(within), "", (">=", 0.6), 0.8, f"{len(stated)} clips"))
    rows += _unseen_rows(scores)
    taken = [one.seconds_per_frame for one in scores if one.seconds_per_frame is not None]
    worked = [one.processor_s_per_frame for one in scores if one.processor_s_per_frame is not None]
    detail = f"with the program's start; processor time {_mean(worked):.3f} s/frame"
    rows.append(
        Row(
            "time for a fit",
            _mean(taken),
            "s/frame",
            ("<=", 1.0 / 30.0),
            detail=detail if taken else "",
        )
    )
    rows += _place_rows(scores)
    return rows + _real_rows(real)


def gesture_table(scores: Sequence[ClipScore]) -> list[dict[str, Any]]:
    """Figures per gesture and speed, and of each over all speeds."""
    strokes = [stroke for score in scores for stroke in score.strokes]
    table = []
    labels = list(dict.fromkeys(stroke.stroke.label for stroke in strokes))
    speeds = [one for one in ("slow", "normal", "fast") if any(s.speed == one for s in strokes)]
    for label in labels:
        for speed in (*speeds, "all"):
            some = [
                stroke
                for stroke in strokes
                if stroke.stroke.label == label and speed in (stroke.speed, "all")
            ]
            if not some:
                continue
            hand = pooled([stroke.velocity["hand"] for stroke in some])
            elbow = pooled([stroke.velocity["elbow"] for stroke in some])
            table.append(
                {
                    "gesture": label,
                    "speed": speed,
                    "count": len(some),
                    "hand_rms_mps": hand.error,
                    "hand_true_rms_mps": rms(hand.truth),
                    "hand_correlation": hand.correlation,
                    "elbow_rms_mps": elbow.error,
                    "elbow_true_rms_mps": rms(elbow.truth),
                    "elbow_correlation": elbow.correlation,
                    "peak_kept": _median([stroke.velocity["hand"].peak_kept for stroke in some]),
                    "map_l1": _map_l1(some),
                }
            )
    return table


def clip_table(scores: Sequence[ClipScore]) -> list[dict[str, Any]]:
    """Figures per clip."""
    return [
        {
            "clip": one.name,
            "frames": one.frames,
            "joint_distance_m": float(one.distance_m.mean()),
            "joint_distance_from_pelvis_m": float(one.aligned_m.mean()),
            "velocity_rms_mps": one.velocity.error,
            "velocity_correlation": one.velocity.correlation,
            "spread_ratio": one.spread,
            "peak_kept": one.velocity.peak_kept,
            "vertex_velocity_rms_mps": one.vertex_velocity_mps,
            "map_l1": one.map_l1,
            "plain_l1": one.plain_l1,
            "stated_l1": one.stated_l1,
            "edge_velocity_ratio": _ratio(one.edge[0], one.middle[0]),
            "edge_place_ratio": _ratio(one.edge[1], one.middle[1]),
            "silhouette_overlap": one.overlap,
            "sigma_coverage": None
            if one.sigma is None
            else coverage(one.sigma.truth, one.sigma.fitted),
            "residual_m": one.residual_m,
            "seconds_per_frame": one.seconds_per_frame,
            "processor_s_per_frame": one.processor_s_per_frame,
            "notes": list(one.notes),
        }
        for one in scores
    ]


def as_dict(scores: Sequence[ClipScore], real: Sequence[RealScore] = ()) -> dict[str, Any]:
    """All tables, for JSON."""
    return {
        "reach": [
            {
                "what": row.what,
                "value": row.value,
                "unit": row.unit,
                "wanted": row.wanted,
                "met": row.met,
                "detail": row.detail,
            }
            for row in reach_table(scores, real)
        ],
        "gestures": gesture_table(scores),
        "clips": clip_table(scores),
        "real": [one.as_dict() for one in real],
    }


def _edge_rows(scores: Sequence[ClipScore]) -> list[Row]:
    rows = []
    for number, name in enumerate(("line-of-sight velocity", "place")):
        ratio = _ratio(
            rms(np.array([one.edge[number] for one in scores])),
            rms(np.array([one.middle[number] for one in scores])),
        )
        each = {one.name: _ratio(one.edge[number], one.middle[number]) for one in scores}
        each = {clip: value for clip, value in each.items() if math.isfinite(value)}
        worst = max(each, key=lambda clip: each[clip], default="")
        rows.append(
            Row(
                f"error at both ends over the middle, {name}",
                ratio if scores else math.nan,
                "",
                ("<=", 1.5),
                detail=f"worst clip: {worst} {each[worst]:.2f}" if each else "",
            )
        )
    return rows


def _walk_rows(scores: Sequence[ClipScore]) -> list[Row]:
    rows = []
    for one in scores:
        if one.kind == "walk":
            what = f"{one.name}, all joints, line-of-sight velocity"
            rows.append(Row(f"{what}: RMS error", one.velocity.error, "m/s", ("<=", 0.28)))
            rows.append(Row(f"{what}: correlation", one.velocity.correlation, "", (">=", 0.88)))
    return rows


def _captured_rows(scores: Sequence[ClipScore]) -> list[Row]:
    """Clips with the motion of real people, but those in which nothing moves."""
    moving = [one for one in scores if one.kind == "captured" and not one.quiet]
    clips = {one.name: one.velocity for one in moving}
    if not clips:
        return []
    spread = {one.name: one.spread for one in moving}
    narrow, wide = min(spread, key=lambda k: spread[k]), max(spread, key=lambda k: spread[k])
    what = f"motion of real people, all joints, {len(clips)} clips"
    errors = {name: velocity.error for name, velocity in clips.items()}
    same = {name: velocity.correlation for name, velocity in clips.items()}
    worst, least = max(errors, key=lambda k: errors[k]), min(same, key=lambda k: same[k])
    median, median_same = _median(list(errors.values())), _median(list(same.values()))
    return [
        Row(f"{what}: median RMS error", median, "m/s", ("<=", 0.22)),
        Row(f"{what}: worst", errors[worst], "m/s", ("<=", 0.35), detail=worst),
        Row(f"{what}: median correlation", median_same, "", (">=", 0.90)),
        Row(f"{what}: least", same[least], "", (">=", 0.80), detail=least),
        Row(
            f"{what}: median spread of the joints' velocities within a frame, fitted over true",
            _median(list(spread.values())),
            "",
            (">=", 0.9),
            1.1,
        ),
        Row(f"{what}: least spread", spread[narrow], "", (">=", 0.9), 1.1, narrow),
        Row(f"{what}: greatest spread", spread[wide], "", (">=", 0.9), 1.1, wide),
        Row(
            f"{what}: Doppler map, relative L1, median",
            _median([one.map_l1 for one in moving]),
            "",
            ("<=", 0.50),
        ),
    ]


_KINDS = {
    "gestures": ("swipes",),
    "walks and turns": ("walk", "turn"),
    "motion of real people": ("captured",),
}


def _coverage_rows(scores: Sequence[ClipScore]) -> list[Row]:
    """Share of errors within one and two standard deviations, for each kind of clip."""
    rows = []
    for name, kinds in _KINDS.items():
        known = [one.sigma for one in scores if one.sigma is not None and one.kind in kinds]
        if not known:
            continue
        both = pooled(known)
        within = coverage(both.truth, both.fitted)
        twice = coverage(both.truth, 2.0 * both.fitted)
        detail = f"{len(both.truth)} joints in frames"
        what = "of the velocity covers"
        rows.append(Row(f"{name}: 1σ {what}", within, "", (">=", 0.60), 0.75, detail))
        rows.append(Row(f"{name}: 2σ {what}", twice, "", (">=", 0.90)))
    return rows + _joint_rows([one.sigma for one in scores if one.sigma is not None])


def _joint_rows(known: Sequence[Pair]) -> list[Row]:
    """How σ of each joint fits its errors, over all clips in which it moves."""
    if not known:
        return []
    sigma, errors = pooled(list(known))
    cover = {
        joint: coverage(errors[:, row], sigma[:, row])
        for row, joint in enumerate(JOINTS)
        if np.isfinite(errors[:, row]).any()
    }
    least, most = min(cover, key=lambda k: cover[k]), max(cover, key=lambda k: cover[k])
    there = np.isfinite(errors) & (sigma > 0) & (errors != 0)
    same = correlation(np.log(sigma[there]), np.log(np.abs(errors[there])))
    return [
        Row("1σ of a joint's velocity covers: least", cover[least], "", (">=", 0.5), 0.8, least),
        Row("1σ of a joint's velocity covers: most", cover[most], "", (">=", 0.5), 0.8, most),
        Row("correlation of the logarithms of σ and error", same, "", (">=", 0.5)),
    ]


def _unseen_rows(scores: Sequence[ClipScore]) -> list[Row]:
    """Limbs while they are out of the picture."""
    clips = [one for one in scores if len(one.unseen.truth)]
    if not clips:
        return []
    both = pooled([one.unseen for one in clips])
    each = ", ".join(f"{one.name} {rms(one.unseen.fitted):.2f}" for one in clips)
    rows = [
        Row(
            "limbs out of the picture, velocity against what they hang on: RMS",
            rms(both.fitted),
            "m/s",
            detail=f"true {rms(both.truth):.2f} m/s; {each}",
        )
    ]
    known = [one.unseen_sigma for one in clips if one.unseen_sigma is not None]
    if known:
        sigma = pooled(known)
        what = "limbs out of the picture"
        rows.append(Row(f"{what}: 1σ covers", coverage(sigma.truth, sigma.fitted)))
        rows.append(Row(f"{what}: 2σ covers", coverage(sigma.truth, 2.0 * sigma.fitted)))
    return rows


def _place_rows(scores: Sequence[ClipScore]) -> list[Row]:
    return [
        Row("joints: mean distance", _mean([one.distance_m.mean() for one in scores]), "m"),
        Row(
            "joints: mean distance from the pelvis",
            _mean([one.aligned_m.mean() for one in scores]),
            "m",
        ),
        Row(
            "silhouette overlap with the true body",
            _mean([one.overlap for one in scores]),
            "",
            detail="simulated clips",
        ),
    ]


def _real_rows(real: Sequence[RealScore]) -> list[Row]:
    if not real:
        return []
    names = ", ".join(f"{one.name} {one.overlap:.2f}" for one in real)
    return [
        Row(
            "real videos: silhouette overlap with the landmark model's mask",
            _mean([one.overlap for one in real]),
            "",
            (">=", 0.80),
            detail=names,
        ),
        Row(
            "real videos: landmarks to joints in the picture, mean",
            100.0 * _mean([one.reprojection_m for one in real]),
            "cm",
            ("<=", 3.0),
            detail=", ".join(f"{one.name} {one.reprojection_px:.1f} px" for one in real),
        ),
    ]


def _map_l1(strokes: Sequence[StrokeScore]) -> float:
    total = sum(stroke.map_total for stroke in strokes)
    return sum(stroke.map_difference for stroke in strokes) / total if total > 0 else math.nan


def _ratio(ends: float, middle: float) -> float:
    if middle == 0:
        return 1.0 if ends == 0 else math.inf
    return float(ends / middle)


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if len(values) else math.nan


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if len(values) else math.nan


__all__ = ["Pair", "Row", "as_dict", "clip_table", "gesture_table", "reach_table"]
