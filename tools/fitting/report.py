"""The tables of a scored fit, in Markdown and CSV; each figure beside what is wanted."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sd2core.compare.measures import correlation, rms
from sd2core.files.tables import markdown_table
from tools.fitting.clip_score import LIMBS, ClipScore, RealScore, StrokeScore, coverage, pooled

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

    @property
    def met(self) -> bool | None:
        """True if the value is as wanted; None if nothing could be measured."""
        return self.least <= self.value <= self.most if math.isfinite(self.value) else None

    @property
    def wanted(self) -> str:
        """What is wanted in words."""
        if math.isfinite(self.least) and math.isfinite(self.most):
            return f"{self.least:g} to {self.most:g}"
        return f"≤ {self.most:.3g}" if math.isfinite(self.most) else f"≥ {self.least:.3g}"

    @property
    def measured(self) -> str:
        """The value with its unit."""
        return f"{_number(self.value)} {self.unit}".strip()


def as_markdown(scores: Sequence[ClipScore], real: Sequence[RealScore] = ()) -> str:
    """Tables for docs/fitting.md: what is wanted, in bold where missed, gestures at all speeds.

    Of the clips it has medians; :func:`as_csv` has each of them.
    """
    reach = [["what", "measured", "wanted"]]
    for row in reach_rows(scores, real):
        mark = "**" if row.met is False else ""
        reach.append([row.what, f"{mark}{row.measured}{mark}", row.wanted])
    videos = [[one.name, *_numbers(one.overlap, one.reprojection_m)] for one in real]
    tables = {
        "Reach": reach,
        "Gestures": list(_gesture_rows(scores)),
        "Real videos": [["video", "silhouette", "landmarks (m)"], *videos],
        "Clips, medians": _kind_table(scores),
    }
    return (
        "\n\n".join(
            "\n".join([f"**{heading}**", "", *markdown_table(rows)])
            for heading, rows in tables.items()
            if len(rows) > 1
        )
        + "\n"
    )


def as_csv(scores: Sequence[ClipScore]) -> str:
    """Every clip, for docs/fitting-clips.csv."""
    rows = [[one.name, one.kind, *map(str, _clip_figures(one))] for one in scores]
    return "".join(f"{','.join(row)}\n" for row in (["clip", "kind", *_FIGURES], *rows))


def _gesture_rows(scores: Sequence[ClipScore]) -> Iterator[list[str]]:
    hand_headings = ["hand: true RMS (m/s)", "error RMS (m/s)", "correlation", "peak kept"]
    yield ["gesture", "speed", "n", *hand_headings, "map L1"]
    strokes = [stroke for score in scores for stroke in score.strokes]
    for label in dict.fromkeys(stroke.stroke.label for stroke in strokes):
        some = [one for one in strokes if one.stroke.label == label]
        hand = pooled([stroke.velocity["hand"] for stroke in some])
        kept = _median([stroke.velocity["hand"].peak_kept for stroke in some])
        figures = (rms(hand.truth), hand.error, hand.correlation, kept, _map_l1(some))
        yield [label, "all", str(len(some)), *_numbers(*figures)]


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
    what = "fit residual: joints to the landmarks found, in the picture, mean"
    yield Row(what, 100.0 * _mean(residuals), "cm", most=3.0)
    yield from _stroke_rows([stroke for score in scores for stroke in score.strokes])
    still = [one.vertex_velocity_mps for one in scores if one.kind == "still"]
    what = "who stands still: false velocity, RMS over vertices"
    yield Row(what, max(still, default=math.nan), "m/s", most=0.015)
    strokes = [stroke for score in scores for stroke in score.strokes]
    yield Row("Doppler map of the gestures, relative L1", _map_l1(strokes), most=0.40)
    for number, name in enumerate(("line-of-sight velocity", "place")):
        edge, middle = (
            rms(np.array([errors[number] for errors in part]))
            for part in ([one.edge for one in scores], [one.middle for one in scores])
        )
        value = _ratio(edge, middle) if scores else math.nan
        yield Row(f"error at both ends over the middle, {name}", value, most=1.5)
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
        yield Row(what, _mean(within), "", 0.6, 0.8)
    taken = [one.seconds_per_frame for one in scores if one.seconds_per_frame is not None]
    yield Row("time for a fit", _mean(taken), "s/frame", most=1.0 / 30.0)
    if real:
        what = "real videos: silhouette overlap with the landmark model's mask"
        yield Row(what, _mean([one.overlap for one in real]), least=0.80)
        what = "real videos: landmarks to joints in the picture, mean"
        yield Row(what, 100.0 * _mean([one.reprojection_m for one in real]), "cm", most=3.0)


def _stroke_rows(strokes: Sequence[StrokeScore]) -> Iterator[Row]:
    hand, elbow = (pooled([stroke.velocity[limb] for stroke in strokes]) for limb in LIMBS)
    what = "s during gestures, line-of-sight velocity"
    yield Row(f"hand{what}: RMS error", hand.error if strokes else math.nan, "m/s", most=0.215)
    yield Row(f"hand{what}: correlation", hand.correlation, least=0.957)
    yield Row(f"elbow{what}: correlation", elbow.correlation, least=0.8)
    fast = [stroke for stroke in strokes if stroke.speed == "fast"]
    what = "fast swipes: peak hand speed kept"
    along = _median([stroke.velocity["hand"].peak_kept for stroke in fast])
    yield Row(f"{what}, along the line of sight", along, least=0.85)
    yield Row(f"{what}, in space", _median([one.tempo.peak_kept for one in fast]), least=0.85)


def _captured_rows(scores: Sequence[ClipScore]) -> Iterator[Row]:
    """Clips with the motion of real people, but those in which nothing moves."""
    moving = [one for one in scores if one.kind == "captured" and not one.quiet]
    if not moving:
        return
    errors = [one.velocity.error for one in moving]
    same = [one.velocity.correlation for one in moving]
    spread = [one.spread for one in moving]
    what = f"recorded motion, {len(moving)} clips"
    yield Row(f"{what}: median RMS error", _median(errors), "m/s", most=0.22)
    yield Row(f"{what}: worst", max(errors), "m/s", most=0.35)
    yield Row(f"{what}: median correlation", _median(same), least=0.90)
    yield Row(f"{what}: least", min(same), least=0.80)
    within = "median spread of the joints' velocities within a frame, fitted over true"
    yield Row(f"{what}: {within}", _median(spread), "", 0.9, 1.1)
    yield Row(f"{what}: least spread", min(spread), "", 0.9, 1.1)
    yield Row(f"{what}: greatest spread", max(spread), "", 0.9, 1.1)
    median = _median([one.map_l1 for one in moving])
    yield Row(f"{what}: Doppler map, relative L1, median", median, most=0.50)


def _coverage_rows(scores: Sequence[ClipScore]) -> Iterator[Row]:
    """Share of errors within one and two standard deviations: kinds of clips, then joints."""
    known = [(one.kind, one.sigma) for one in scores if one.sigma is not None]
    for name, kinds in _KINDS.items():
        if own := [sigma for kind, sigma in known if kind in kinds]:
            sigma, errors = pooled(own)
            what = "σ of the velocity covers"
            yield Row(f"{name}: 1{what}", coverage(errors, sigma), "", 0.60, 0.75)
            yield Row(f"{name}: 2{what}", coverage(errors, 2.0 * sigma), least=0.90)
    if known:
        sigma, errors = pooled([sigma for _, sigma in known])
        moving = np.isfinite(errors).any(axis=0)
        cover = [coverage(*one) for one in zip(errors.T[moving], sigma.T[moving], strict=True)]
        for word, value in (("least", min(cover)), ("most", max(cover))):
            yield Row(f"1σ of a joint's velocity covers: {word}", value, "", 0.5, 0.8)
        usable = np.isfinite(errors) & (sigma > 0) & (errors != 0)
        same = correlation(np.log(sigma[usable]), np.log(np.abs(errors[usable])))
        yield Row("correlation of the logarithms of σ and error", same, least=0.5)


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
