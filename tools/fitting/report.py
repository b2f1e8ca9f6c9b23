"""The tables of a scored fit, as text, Markdown and CSV; each figure beside what is wanted."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sd2core.compare.joints import JOINTS
from sd2core.compare.measures import correlation, rms
from sd2core.files.tables import markdown_table, text_table
from tools.fitting.clip_score import ClipScore, StrokeScore, pooled
from tools.fitting.measures import coverage
from tools.fitting.real_score import RealScore

Table = list[list[str]]

_FIGURES = ["joints (m)", "velocity error RMS (m/s)", "correlation", "spread", "peak kept"]
_FIGURES += ["map L1", "plain", "stated"]

_KINDS = {
    "gestures": ("swipes",),
    "walks and turns": ("walk", "turn"),
    "motion of real people": ("captured",),
}


@dataclass(frozen=True)
class Row:
    """One figure, NaN when nothing could be measured, and between what it is wanted."""

    what: str
    value: float
    unit: str = ""
    least: float = -math.inf
    most: float = math.inf
    detail: str = ""

    @property
    def met(self) -> bool | None:
        """True if the value is as wanted; None if nothing is wanted or measured."""
        if not self.wanted or not math.isfinite(self.value):
            return None
        return self.least <= self.value <= self.most

    @property
    def wanted(self) -> str:
        """What is wanted in words."""
        if math.isfinite(self.least) and math.isfinite(self.most):
            return f"{self.least:g} to {self.most:g}"
        if math.isfinite(self.most):
            return f"≤ {self.most:.3g}"
        return f"≥ {self.least:.3g}" if math.isfinite(self.least) else ""

    @property
    def measured(self) -> str:
        """The value with its unit."""
        return f"{_number(self.value)} {self.unit}".strip()


def as_text(scores: Sequence[ClipScore], real: Sequence[RealScore] = ()) -> str:
    """Tables for a terminal."""
    reach = [["what", "measured", "wanted", "met", "remarks"]]
    for row in reach_rows(scores, real):
        met = {None: "", True: "yes", False: "no"}[row.met]
        reach.append([row.what, row.measured, row.wanted, met, row.detail])
    tables = _tables(reach, scores, real, ("slow", "normal", "fast", "all"))
    return "\n\n".join(
        "\n".join([heading, *(f"  {line}" for line in text_table(rows, ()))])
        for heading, rows in tables.items()
    )


def as_markdown(scores: Sequence[ClipScore], real: Sequence[RealScore] = ()) -> str:
    """Tables for docs/fitting.md: what is wanted, in bold where missed, gestures at all speeds.

    Of the clips it has medians; :func:`as_csv` has each of them.
    """
    reach = [["what", "measured", "wanted"]]
    for row in reach_rows(scores, real):
        if row.wanted:
            mark = "**" if row.met is False else ""
            reach.append([row.what, f"{mark}{row.measured}{mark}", row.wanted])
    tables = _tables(reach, scores, real, ("all",)) | {"Clips, medians": _kind_table(scores)}
    del tables["Clips"]
    return (
        "\n\n".join(
            "\n".join([f"**{heading}**", "", *markdown_table(rows)])
            for heading, rows in tables.items()
        )
        + "\n"
    )


def as_csv(scores: Sequence[ClipScore]) -> str:
    """Every clip, for docs/fitting-clips.csv."""
    rows = [[one.name, one.kind, *map(str, _clip_figures(one))] for one in scores]
    return "".join(f"{','.join(row)}\n" for row in (["clip", "kind", *_FIGURES], *rows))


def _tables(
    reach: Table, scores: Sequence[ClipScore], real: Sequence[RealScore], speeds: Sequence[str]
) -> dict[str, Table]:
    videos = ["video", "silhouette", "landmarks (m)"]
    tables = {
        "Gestures": list(_gesture_rows(scores, speeds)),
        "Clips": [
            ["clip", *_FIGURES],
            *([one.name, *_numbers(*_clip_figures(one))] for one in scores),
        ],
        "Real videos": [
            videos,
            *([one.name, *_numbers(one.overlap, one.reprojection_m)] for one in real),
        ],
    }
    return {"Reach": reach} | {name: rows for name, rows in tables.items() if len(rows) > 1}


def _gesture_rows(scores: Sequence[ClipScore], speeds: Sequence[str]) -> Iterator[list[str]]:
    hand_headings = ["hand: true RMS (m/s)", "error RMS (m/s)", "correlation", "peak kept"]
    yield ["gesture", "speed", "n", *hand_headings, "map L1"]
    strokes = [stroke for score in scores for stroke in score.strokes]
    for label in dict.fromkeys(stroke.stroke.label for stroke in strokes):
        for speed in speeds:
            some = [
                one for one in strokes if one.stroke.label == label and speed in (one.speed, "all")
            ]
            if some:
                hand = pooled([stroke.velocity["hand"] for stroke in some])
                kept = _median([stroke.velocity["hand"].peak_kept for stroke in some])
                figures = (rms(hand.truth), hand.error, hand.correlation, kept, _map_l1(some))
                yield [label, speed, str(len(some)), *_numbers(*figures)]


def _clip_figures(one: ClipScore) -> list[float]:
    velocity = one.velocity
    of_velocity = velocity.error, velocity.correlation, one.spread, velocity.peak_kept
    stated = math.nan if one.stated_l1 is None else one.stated_l1
    figures = float(one.distance_m.mean()), *of_velocity, one.map_l1, one.plain_l1, stated
    return [round(figure, 3) for figure in figures]


def _kind_table(scores: Sequence[ClipScore]) -> Table:
    """Medians over the clips of a kind in which something moves."""
    rows = [["clips", "number", *_FIGURES]]
    for name, kinds in _KINDS.items():
        own = [_clip_figures(one) for one in scores if one.kind in kinds and not one.quiet]
        if own:
            medians = [f"{median:.2g}" for median in np.median(own, axis=0)]
            rows.append([name, str(len(own)), *medians])
    return rows


def reach_rows(scores: Sequence[ClipScore], real: Sequence[RealScore] = ()) -> Iterator[Row]:
    """Figures that the fit is judged by, of clips whose motion is known and of real videos."""
    residuals = [one.residual_m for one in scores if one.residual_m is not None]
    detail = "at the joint's depth" if residuals else "no landmarks are kept"
    what = "fit residual: joints to the landmarks found, in the picture, mean"
    yield Row(what, 100.0 * _mean(residuals), "cm", most=3.0, detail=detail)
    yield from _stroke_rows([stroke for score in scores for stroke in score.strokes], scores)
    yield from _edge_rows(scores)
    for one in scores:
        if one.kind == "walk":
            what = f"{one.name}, all joints, line-of-sight velocity"
            yield Row(f"{what}: RMS error", one.velocity.error, "m/s", most=0.28)
            yield Row(f"{what}: correlation", one.velocity.correlation, least=0.88)
    yield from _captured_rows(scores)
    yield from _coverage_rows(scores)
    stated = [one for one in scores if one.stated_l1 is not None and not one.quiet]
    if stated:
        within = [one.map_l1 <= (one.stated_l1 or 0.0) for one in stated]
        what = "clips whose map is as near to the truth as it states"
        yield Row(what, _mean(within), "", 0.6, 0.8, f"{len(stated)} clips")
    yield from _unseen_rows(scores)
    taken = [one.seconds_per_frame for one in scores if one.seconds_per_frame is not None]
    worked = [one.processor_s_per_frame for one in scores if one.processor_s_per_frame is not None]
    detail = f"with the program's start; processor time {_mean(worked):.3f} s/frame"
    detail = detail if taken else ""
    yield Row("time for a fit", _mean(taken), "s/frame", most=1.0 / 30.0, detail=detail)
    yield Row("joints: mean distance", _mean([one.distance_m.mean() for one in scores]), "m")
    aligned_m = _mean([one.aligned_m.mean() for one in scores])
    yield Row("joints: mean distance from the pelvis", aligned_m, "m")
    same = _mean([one.overlap for one in scores])
    yield Row("silhouette overlap with the true body", same, detail="simulated clips")
    if real:
        what = "real videos: silhouette overlap with the landmark model's mask"
        detail = ", ".join(f"{one.name} {one.overlap:.2f}" for one in real)
        yield Row(what, _mean([one.overlap for one in real]), least=0.80, detail=detail)
        what = "real videos: landmarks to joints in the picture, mean"
        detail = ", ".join(f"{one.name} {one.reprojection_px:.1f} px" for one in real)
        away_cm = 100.0 * _mean([one.reprojection_m for one in real])
        yield Row(what, away_cm, "cm", most=3.0, detail=detail)


def _stroke_rows(strokes: Sequence[StrokeScore], scores: Sequence[ClipScore]) -> Iterator[Row]:
    for limb, most, least in (
        ("hand", 0.215, 0.957),
        ("wrist", math.inf, -math.inf),
        ("elbow", math.inf, 0.8),
    ):
        pair = pooled([stroke.velocity[limb] for stroke in strokes])
        what = f"{limb}s during gestures, line-of-sight velocity"
        detail = f"true RMS {rms(pair.truth):.2f} m/s, {len(strokes)} gestures"
        error = pair.error if strokes else math.nan
        yield Row(f"{what}: RMS error", error, "m/s", most=most, detail=detail)
        yield Row(f"{what}: correlation", pair.correlation, least=least)
    fast = [stroke for stroke in strokes if stroke.speed == "fast"]
    for name, kept in (
        ("along the line of sight", [stroke.velocity["hand"].peak_kept for stroke in fast]),
        ("in space", [stroke.tempo["hand"].peak_kept for stroke in fast]),
    ):
        detail = f"median of {len(kept)}; least {min(kept):.2f}" if kept else ""
        what = f"fast swipes: peak hand speed kept, {name}"
        yield Row(what, _median(kept), least=0.85, detail=detail)
    still = {one.name: one.vertex_velocity_mps for one in scores if one.kind == "still"}
    what = "who stands still: false velocity, RMS over vertices"
    detail = ", ".join(f"{name} {false_mps:.3f}" for name, false_mps in still.items())
    yield Row(what, max(still.values(), default=math.nan), "m/s", most=0.015, detail=detail)
    detail = "fitted against true mesh, after smoothing"
    what = "Doppler map of the gestures, relative L1"
    yield Row(what, _map_l1(strokes), most=0.40, detail=detail)


def _edge_rows(scores: Sequence[ClipScore]) -> Iterator[Row]:
    for number, name in enumerate(("line-of-sight velocity", "place")):
        edge, middle = (
            rms(np.array([errors[number] for errors in part]))
            for part in ([one.edge for one in scores], [one.middle for one in scores])
        )
        each = {one.name: _ratio(one.edge[number], one.middle[number]) for one in scores}
        each = {clip: value for clip, value in each.items() if math.isfinite(value)}
        value = _ratio(edge, middle) if scores else math.nan
        detail = f"worst clip: {_top(each)} {max(each.values()):.2f}" if each else ""
        what = f"error at both ends over the middle, {name}"
        yield Row(what, value, most=1.5, detail=detail)


def _captured_rows(scores: Sequence[ClipScore]) -> Iterator[Row]:
    """Clips with the motion of real people, but those in which nothing moves."""
    moving = [one for one in scores if one.kind == "captured" and not one.quiet]
    if not moving:
        return
    errors = {one.name: one.velocity.error for one in moving}
    same = {one.name: one.velocity.correlation for one in moving}
    spread = {one.name: one.spread for one in moving}
    what = f"recorded motion, {len(moving)} clips"
    yield Row(f"{what}: median RMS error", _median(list(errors.values())), "m/s", most=0.22)
    worst, least = _top(errors), _bottom(same)
    yield Row(f"{what}: worst", errors[worst], "m/s", most=0.35, detail=worst)
    yield Row(f"{what}: median correlation", _median(list(same.values())), least=0.90)
    yield Row(f"{what}: least", same[least], least=0.80, detail=least)
    within = "median spread of the joints' velocities within a frame, fitted over true"
    yield Row(f"{what}: {within}", _median(list(spread.values())), "", 0.9, 1.1)
    narrow, wide = _bottom(spread), _top(spread)
    yield Row(f"{what}: least spread", spread[narrow], "", 0.9, 1.1, narrow)
    yield Row(f"{what}: greatest spread", spread[wide], "", 0.9, 1.1, wide)
    median = _median([one.map_l1 for one in moving])
    yield Row(f"{what}: Doppler map, relative L1, median", median, most=0.50)


def _coverage_rows(scores: Sequence[ClipScore]) -> Iterator[Row]:
    """Share of errors within one and two standard deviations: kinds of clips, then joints."""
    known = [(one.kind, one.sigma) for one in scores if one.sigma is not None]
    for name, kinds in _KINDS.items():
        if own := [sigma for kind, sigma in known if kind in kinds]:
            sigma, errors = pooled(own)
            what, detail = "σ of the velocity covers", f"{len(errors)} joints in frames"
            yield Row(f"{name}: 1{what}", coverage(errors, sigma), "", 0.60, 0.75, detail)
            yield Row(f"{name}: 2{what}", coverage(errors, 2.0 * sigma), least=0.90)
    if known:
        sigma, errors = pooled([sigma for _, sigma in known])
        cover = {
            joint: coverage(errors[:, row], sigma[:, row])
            for row, joint in enumerate(JOINTS)
            if np.isfinite(errors[:, row]).any()
        }
        for word, joint in (("least", _bottom(cover)), ("most", _top(cover))):
            what = f"1σ of a joint's velocity covers: {word}"
            yield Row(what, cover[joint], "", 0.5, 0.8, joint)
        usable = np.isfinite(errors) & (sigma > 0) & (errors != 0)
        same = correlation(np.log(sigma[usable]), np.log(np.abs(errors[usable])))
        yield Row("correlation of the logarithms of σ and error", same, least=0.5)


def _unseen_rows(scores: Sequence[ClipScore]) -> Iterator[Row]:
    """Limbs while they are out of the picture."""
    clips = [one for one in scores if len(one.unseen.truth)]
    if not clips:
        return
    both = pooled([one.unseen for one in clips])
    each = ", ".join(f"{one.name} {rms(one.unseen.fitted):.2f}" for one in clips)
    what, detail = "limbs out of the picture", f"true {rms(both.truth):.2f} m/s; {each}"
    against = f"{what}, velocity against what they hang on: RMS"
    yield Row(against, rms(both.fitted), "m/s", detail=detail)
    if known := [one.unseen_sigma for one in clips if one.unseen_sigma is not None]:
        sigma, errors = pooled(known)
        yield Row(f"{what}: 1σ covers", coverage(errors, sigma))
        yield Row(f"{what}: 2σ covers", coverage(errors, 2.0 * sigma))


def _top(each: Mapping[str, float]) -> str:
    return max(each, key=lambda name: each[name])


def _bottom(each: Mapping[str, float]) -> str:
    return min(each, key=lambda name: each[name])


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


def _numbers(*values: float) -> list[str]:
    return [_number(value) for value in values]


def _number(value: float) -> str:
    if not math.isfinite(value):
        return "–" if math.isnan(value) else "∞"
    return f"{value:.3f}" if abs(value) < 10 else f"{value:.1f}"
