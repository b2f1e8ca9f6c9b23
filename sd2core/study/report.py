"""Page of a study: whether it helped, with what certainty, and what was not tried."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sd2core.files.atomic import atomic_write_text
from sd2core.files.figure_files import save_figure
from sd2core.files.tables import markdown_table
from sd2core.study.certainty import Gain, adjusted, gain_of
from sd2core.study.plan import ADDED
from sd2core.study.run import REAL, Results, Run

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TITLES = {
    REAL: "real alone",
    "synthetic": "+ synthetic",
    "synthetic+texture": "+ synthetic with texture",
    "denoised": "+ denoised",
    "denoised+texture": "+ denoised with texture",
    "radar": "+ the radar's of the same person",
}
_MEASURES = ("frames", "movements")
_COLOURS = ("#444444", "#7f9bc4", "#2166ac", "#e0a36c", "#b35806", "#1b7837")
_UNTRIED = (
    "other classifiers than ridge regression on windows",
    "more than one person's video at a time",
    "places of the sensor other than the radar's own",
    "bodies of other shape",
    "mirrored movements",
)


@dataclass(frozen=True)
class Finding:
    """Gain of a condition at one share of the real data."""

    added: str
    share: float
    frames: Gain
    movements: Gain
    p: float  # Of the frames, adjusted for all conditions and shares, without the yardstick.


def findings_of(results: Results) -> list[Finding]:
    """Return all gains, by share and condition."""
    found = []
    for share in results.plan.shares:
        for added in results.plan.added:
            gains = [_gain(results, added, share, measure) for measure in (0, 1)]
            if gains[0] is not None and gains[1] is not None:
                found.append(Finding(added, share, gains[0], gains[1], 1.0))
    tests = [one for one in found if one.added != "radar"]
    values = dict(zip(map(id, tests), adjusted([one.frames.p for one in tests]), strict=True))
    return [
        Finding(one.added, one.share, one.frames, one.movements, values.get(id(one), one.frames.p))
        for one in found
    ]


def write_report(results: Results, folder: Path) -> str:
    """Write ``study.md``, ``study.json`` and ``curve.png``; return the conclusion."""
    findings = findings_of(results)
    text = page(results, findings)
    atomic_write_text(folder / "study.md", text)
    content = {
        "format": "sd2-study-results",
        "version": 1,
        "plan": results.plan.model_dump(mode="json"),
        "radar": results.kind,
        "classes": list(results.classes),
        "takes": dict(results.takes),
        "conclusion": conclusion(results, findings),
        "findings": [asdict(one) for one in findings],
        "runs": [asdict(one) for one in results.runs],
    }
    atomic_write_text(folder / "study.json", json.dumps(content, ensure_ascii=False) + "\n")
    save_figure(draw_curve(results), folder / "curve.png", {"study": results.plan.title})
    return conclusion(results, findings)


def conclusion(results: Results, findings: Sequence[Finding]) -> str:
    """Say in a sentence or two whether added maps helped, and with what certainty."""
    own = [one for one in findings if one.added != "radar"]
    if not own:
        return "Nothing was added that could be compared."
    sure = [one for one in own if one.frames.certain and one.p < 0.05]
    helped = [one for one in sure if one.frames.certain > 0]
    harmed = [one for one in sure if one.frames.certain < 0]
    said = []
    if helped:
        best = max(helped, key=lambda one: one.frames.mean)
        low, high = (100.0 * value for value in best.frames.over_people)
        people = (
            "also counting that people differ"
            if low > 0
            else f"other people might differ ({low:+.1f} to {high:+.1f})"
        )
        said.append(
            f"It helped in {len(helped)} of {len(own)} comparisons, most"
            f" {TITLES[best.added].removeprefix('+ ')} maps at {best.share:.0%} of the real data:"
            f" {_points(best.frames)} of the frames; {people}."
        )
    if harmed:
        worst = min(harmed, key=lambda one: one.frames.mean)
        said.append(
            f"It harmed in {len(harmed)}, most {TITLES[worst.added].removeprefix('+ ')} maps at"
            f" {worst.share:.0%}: {_points(worst.frames)}."
        )
    rest = len(own) - len(sure)
    if rest:
        said.append(
            f"{'In' if said else 'Nothing is certain: in'} {rest} of {len(own)} the difference may"
            " be chance."
        )
    return " ".join(said)


def page(results: Results, findings: Sequence[Finding]) -> str:
    """Return the page in Markdown."""
    plan = results.plan
    people = ", ".join(f"{one} ({count} takes)" for one, count in results.takes.items())
    folds = len({run.fold for run in results.runs})
    speeds = ", ".join(f"{one:g}" for one in plan.speeds)
    parts = [
        f"# {plan.title}",
        f"**{conclusion(results, findings)}**",
        f"A {results.kind} radar; people {people}; classes {', '.join(results.classes)}, by chance"
        f" {1 / len(results.classes):.0%}. Every ordered pair of people is a fold ({folds}): one is"
        " judged, of another there is only video, of all others there is a share of the real"
        f" radar's data, equally much of every class. {plan.seeds} draws each. The denoiser of a"
        " fold learns from those same real data alone."
        + (f" Added maps are also played {speeds} times as fast." if speeds else ""),
        "## Found",
        "Per cent of frames (of whole movements), mean over people:",
        _table_of_scores(results),
        "## Gained",
        "Points of frames over real data alone, with 95 % intervals over takes of these people,"
        " and over people and takes; p by turning signs of takes by chance, adjusted for all"
        " these comparisons (Holm); then points of whole movements.",
        _table_of_gains(findings),
        "![Learning curve](curve.png)",
        "## Not tried",
        "\n".join(f"- {one}" for one in untried(results)),
    ]
    return "\n\n".join(parts) + "\n"


def untried(results: Results) -> list[str]:
    """List what this study says nothing about."""
    plan = results.plan
    left = [
        f"adding {TITLES[one].removeprefix('+ ')} maps" for one in ADDED if one not in plan.added
    ]
    reasons = dict.fromkeys(
        f"{TITLES[name]} at {run.share:.0%}: {reason}"
        for run in results.runs
        for name, reason in run.missing.items()
    )
    inputs = [one for one in ("map", "limbs", "kinematics") if one != plan.denoiser.inputs]
    speeds = [] if plan.speeds else ["other speeds"]
    return [*left, *reasons, f"denoisers that take {' or '.join(inputs)}", *speeds, *_UNTRIED]


def draw_curve(results: Results) -> Figure:
    """Draw the frames found by the share of real data, with intervals over takes."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 4.4), dpi=120, layout="constrained")
    axes = figure.subplots()
    shares = list(results.plan.shares)
    for number, name in enumerate((REAL, *results.plan.added)):
        values = {share: _values(results, name, share, 0) for share in shares}
        there = [share for share in shares if values[share]]
        if not there:
            continue
        found = [gain_of(values[share]) for share in there]
        middle = 100.0 * np.array([one.mean for one in found])
        ends = 100.0 * np.array([one.over_takes for one in found]).T
        away = np.abs(ends - middle)
        places = 100.0 * np.array(there) * (1.0 + 0.02 * (number - 2))
        axes.errorbar(
            places, middle, away, label=TITLES[name], color=_COLOURS[number % len(_COLOURS)],
            marker="o", markersize=4, capsize=2, linewidth=1.2,
            linestyle="--" if name == "radar" else "-",
        )  # fmt: skip
    axes.axhline(100.0 / len(results.classes), color="0.6", linewidth=0.8, linestyle=":")
    axes.set_xscale("log")
    axes.set_xticks([100.0 * one for one in shares], [f"{one:.0%}" for one in shares])
    axes.minorticks_off()
    axes.set(
        xlabel=f"share of the {results.kind} radar's data",
        ylabel="frames found (%), mean over people",
        title=results.plan.title,
    )
    axes.legend(fontsize=8)
    return figure


def _table_of_scores(results: Results) -> str:
    names = (REAL, *results.plan.added)
    rows = [["real data", "frames", *(TITLES[name] for name in names)]]
    for share in results.plan.shares:
        runs = [run for run in results.runs if run.share == share]
        cells = []
        for name in names:
            both = [_values(results, name, share, measure) for measure in (0, 1)]
            frames, whole = (
                np.mean([own.mean() for own in one.values()]) if one else float("nan")
                for one in both
            )
            cells.append("–" if np.isnan(frames) else f"{100 * frames:.1f} ({100 * whole:.1f})")
        count = np.mean([run.real_frames for run in runs])
        rows.append([f"{share:.0%}", f"{count:,.0f}", *cells])
    return "\n".join(markdown_table(rows))


def _table_of_gains(findings: Sequence[Finding]) -> str:
    head = ["real data", "added", "gain", "over takes", "over people", "p", "movements"]
    rows = [
        [
            f"{one.share:.0%}",
            TITLES[one.added],
            f"{100 * one.frames.mean:+.1f}",
            _range(one.frames.over_takes),
            _range(one.frames.over_people),
            f"{one.p:.3f}",
            f"{100 * one.movements.mean:+.1f} ({_range(one.movements.over_takes)})",
        ]
        for one in findings
    ]
    return "\n".join(markdown_table([head, *rows]))


def _gain(results: Results, added: str, share: float, measure: int) -> Gain | None:
    runs = [run for run in results.runs if run.share == share and added in run.scores]
    values = _by_person(
        runs, lambda run, take: run.scores[added][take][measure] - run.scores[REAL][take][measure]
    )
    return gain_of(values) if values else None


def _values(
    results: Results, name: str, share: float, measure: int
) -> dict[str, NDArray[np.float64]]:
    runs = [run for run in results.runs if run.share == share and name in run.scores]
    return _by_person(runs, lambda run, take: run.scores[name][take][measure])


def _by_person(runs: Sequence[Run], of: Any) -> dict[str, NDArray[np.float64]]:
    """Mean over folds and draws for every take, by the person who is judged."""
    found: dict[str, dict[str, list[float]]] = {}
    for run in runs:
        for take in run.scores[REAL]:
            found.setdefault(run.fold.judged, {}).setdefault(take, []).append(of(run, take))
    return {
        who: np.array([np.mean(values) for values in takes.values()])
        for who, takes in found.items()
    }


def _range(ends: tuple[float, float]) -> str:
    return f"{100 * ends[0]:+.1f} to {100 * ends[1]:+.1f}"


def _points(gain: Gain) -> str:
    return f"{100 * gain.mean:+.1f} points ({_range(gain.over_takes)} over takes)"
