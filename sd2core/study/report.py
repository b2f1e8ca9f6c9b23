"""Page of a study: whether it helped, with what certainty, and what was not tried."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sd2core.classify.confusion_figure import confusion_figure
from sd2core.classify.metrics import Score, mean_recall, shares
from sd2core.denoise.files import describe_model, find_model
from sd2core.files.atomic import atomic_write_text
from sd2core.files.figure_files import save_figure
from sd2core.files.stores import lost_in_words
from sd2core.files.tables import counted, markdown_table
from sd2core.study.certainty import Gain, adjusted, gain_of
from sd2core.study.plan import OF_VIDEO
from sd2core.study.run import Results
from sd2core.study.trial import REAL
from sd2core.train.evaluation import learnt_from

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TITLES = {
    REAL: "radar alone",
    "synthetic": "+ synthetic",
    "synthetic+texture": "+ synthetic with texture",
    "denoised": "+ denoised",
    "denoised+texture": "+ denoised with texture",
    "simulated": "+ simulated radar",
    "radar": "+ radar of the same",
}
_COLOURS = ("#444444", "#7f9bc4", "#2166ac", "#e0a36c", "#b35806", "#762a83", "#1b7837")
_FEW = 5
FORMAT, VERSION = "sd2-study-results", 2


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
    findings = []
    for share in sorted(results.plan.shares):
        for added in results.plan.wanted:
            frames, whole = (_gain(results, added, share, measure) for measure in (0, 1))
            if frames is not None and whole is not None:
                findings.append(Finding(added, share, frames, whole, frames.p))
    tests = [number for number, one in enumerate(findings) if one.added != "radar"]
    for number, p in zip(tests, adjusted([findings[one].frames.p for one in tests]), strict=True):
        findings[number] = replace(findings[number], p=p)
    return findings


def write_report(results: Results, folder: Path) -> str:
    """Write ``study.md``, ``study.json``, ``curve.png`` and ``confusion.png``.

    Returns the conclusion.
    """
    findings = findings_of(results)
    verdict = conclusion(results, findings)
    totals = totals_of(results)
    atomic_write_text(folder / "study.md", page(results, findings, verdict, totals))
    runs = [{**one.to_json(), "scores": None} for one in results.runs]
    content = {
        "format": FORMAT,
        "version": VERSION,
        "plan": results.plan.model_dump(mode="json"),
        "radar": results.kind,
        "classes": list(results.classes),
        "takes": results.takes,
        "conclusion": verdict,
        "findings": [asdict(one) for one in findings],
        "curve": [
            {"added": name, "title": TITLES[name], "share": share, **_summary(values)}
            for name in (REAL, *results.plan.wanted)
            for share in sorted(results.plan.shares)
            if (values := _values(results, name, share, 0))
        ],
        "totals": [
            {"title": TITLES.get(title, title), "seeds": [one.to_json() for one in own]}
            for title, own in totals.items()
        ],
        "runs": runs,
    }
    atomic_write_text(folder / "study.json", json.dumps(content, ensure_ascii=False) + "\n")
    note = {"study": results.plan.title}
    save_figure(draw_curve(results), folder / "curve.png", note)
    save_figure(draw_confusions(results, totals), folder / "confusion.png", note)
    return verdict


def totals_of(results: Results) -> dict[str, list[Score]]:
    """Return scores with all real data, of every seed, by condition and by classifier."""
    largest = max(results.plan.shares)
    totals: dict[str, dict[int, Score]] = {}
    for run in results.runs:
        if run.task.share == largest:
            for name, one in run.scores.items():
                own = totals.setdefault(name, {})
                seed = run.task.seed
                own[seed] = own[seed] + one if seed in own else one
    return {name: list(own.values()) for name, own in totals.items()}


def conclusion(results: Results, findings: Sequence[Finding]) -> str:
    """Say in a sentence or two whether added maps helped, and with what certainty."""
    own = [one for one in findings if one.added != "radar"]
    if not own:
        return "Nothing was added that could be compared." + _best(results)
    sure = [one for one in own if one.frames.certain and one.p < 0.05]
    helped = [one for one in sure if one.frames.certain > 0]
    harmed = [one for one in sure if one.frames.certain < 0]
    parts = []
    if helped:
        best = max(helped, key=lambda one: one.frames.mean)
        low, high = (100.0 * value for value in best.frames.over_people)
        people = f"other people might differ ({low:+.1f} to {high:+.1f})"
        if len(results.takes) < 2:
            people = "of other people it says nothing"
        elif low > 0:
            people = "also counting that people differ"
            if len(results.takes) < _FEW:
                people += f", as far as {len(results.takes)} tell"
        parts.append(
            f"It helped in {len(helped)} of {len(own)} comparisons, most"
            f" {_maps(best.added)} at {best.share:.0%} of the"
            f" {results.kind} radar's data: {_points(best.frames)} of the frames; {people}."
        )
    if harmed:
        worst = min(harmed, key=lambda one: one.frames.mean)
        parts.append(
            f"It harmed in {len(harmed)}, most {_maps(worst.added)} at"
            f" {worst.share:.0%}: {_points(worst.frames)}."
        )
    rest = len(own) - len(sure)
    if rest:
        parts.append(
            f"{'In' if parts else 'Nothing is certain: in'} {rest} of {len(own)} the difference may"
            " be chance."
        )
    if results.kind == "simulated":
        parts.append("The radar is simulated.")
    return " ".join(parts)


def _maps(added: str) -> str:
    return f"{TITLES[added].removeprefix('+ ')} maps"


def _best(results: Results) -> str:
    """Say which of several classifiers finds most."""
    first = results.plan.classifiers[0].title
    recall = {
        first if name in TITLES else name: 100.0 * np.mean([one.mean_recall for one in own])
        for name, own in totals_of(results).items()
    }
    if len(recall) < 2:
        return ""
    best = max(recall, key=lambda name: recall[name])
    return f" Of {len(recall)} classifiers {best} finds most, {recall[best]:.1f} % of the frames."


def page(
    results: Results, findings: Sequence[Finding], verdict: str, totals: dict[str, list[Score]]
) -> str:
    """Return the page in Markdown.

    Parameters
    ----------
    results : Results
    findings : sequence of Finding
        Of :func:`findings_of`.
    verdict : str
        Of :func:`conclusion`.
    totals : dict of str to list of Score
        Of :func:`totals_of`.
    """
    plan = results.plan
    counts = {counted(count, "movement") for count in results.takes.values()}
    each = [f"{one} ({counted(count, 'movement')})" for one, count in results.takes.items()]
    same = len(each) > 3 and len(counts) == 1
    people = f"{len(each)} people, {counts.pop()} each" if same else ", ".join(each)
    chance = f"{1 / len(results.classes):.0%}"
    parts = [
        f"# {plan.title}",
        f"**{verdict}**",
        f"A {results.kind} radar; {people}; classes {', '.join(results.classes)}, by chance"
        f" {chance}. {_folds_in_words(results)}",
        "## Found",
        f"By {plan.classifiers[0].title}: per cent of frames (of whole movements), mean over the"
        " classes of a movement, movements, and people:",
        _table_of_scores(results),
    ]
    if findings:
        over_people = (
            ", and over people and takes" if len(results.takes) > 1 else "; it is one person"
        )
        parts += [
            "## Gained",
            "Points of frames over the radar alone, with 95 % intervals over takes of these people"
            f"{over_people}; p by turning signs of takes by chance, adjusted for all these"
            " comparisons (Holm); then points of whole movements.",
            _table_of_gains(findings, len(results.takes) > 1),
        ]
    parts += ["![Learning curve](curve.png)", "## With all of the radar's data"]
    parts += [
        "Mean recall over the classes of all frames, and of whole movements, in per cent, ±"
        " standard deviation over seeds; and the time until a gesture is recognised (median).",
        _table_of_totals(results, totals),
        "![Confusion matrices](confusion.png)",
        "## Not tried",
        "\n".join(f"- {one}" for one in untried(results)),
    ]
    return "\n\n".join(parts) + "\n"


def _folds_in_words(results: Results) -> str:
    plan = results.plan
    by_person = plan.folds == "people"
    filmed = any(run.task.fold.video for run in results.runs)
    if filmed and plan.turns == "all":
        count = len({run.task.fold for run in results.runs})
        text = (
            f"Every ordered pair of {'people' if by_person else 'parts'} is a fold ({count}): one"
        )
    else:
        count = len(results.takes) if by_person else plan.parts
        text = f"Each of {count} {'people' if by_person else 'parts of the movements'}"
    text += " is judged"
    text += ", of another there is only video, and of all others" if filmed else "; of all others"
    text += " there is a share of the radar's data, of every class alike."
    text += f" {counted(plan.seeds, 'draw')} each"
    text += "." if by_person else ", the parts dealt anew."
    if plan.learns_denoisers and filmed:
        text += " The denoiser of a fold learns from those same data alone."
    if plan.denoiser.file is not None and any(
        "denoised" in one or "texture" in one for one in plan.wanted
    ):
        card = describe_model(find_model(plan.denoiser.file))
        taught = {*learnt_from(card, "training", "validation")} & {*results.takes}
        if taught:
            text += (
                f" The denoiser has learnt from, or was chosen by, people called"
                f" {', '.join(sorted(taught))}: what it adds may know who is judged."
            )
    if results.lost_frames:
        text += f" {lost_in_words(results.lost_frames)}"
    if results.others:
        text += f" {results.others} movements of other bodies, of the program's, may be added."
    if plan.speeds:
        speeds = ", ".join(f"{one:g}" for one in plan.speeds)
        text += f" Added maps are also played {speeds} times as fast."
    if plan.placements:
        text += " Added maps are also those of other placements of the sensor."
    return text


def untried(results: Results) -> list[str]:
    """List what this study says nothing about."""
    plan = results.plan
    others = [_maps(one) for one in OF_VIDEO if one not in plan.wanted]
    left = [f"adding {', '.join(others)}"] if others else []
    runs = Counter(run.task.share for run in results.runs)
    reasons = Counter(
        (name, run.task.share, reason)
        for run in results.runs
        for name, reason in run.missing.items()
    )
    where: dict[str, list[str]] = {}
    for (name, share, reason), count in reasons.items():
        failed = f"{_maps(name)} in {count} of {runs[share]} runs at {share:.0%}"
        where.setdefault(reason, []).append(failed)
    missing = [f"adding {', '.join(maps)}: {reason}" for reason, maps in where.items()]
    inputs = [one for one in ("map", "limbs", "kinematics") if one != plan.denoiser.inputs]
    tried = ", ".join(one.title for one in plan.classifiers)
    more = [f"other classifiers than {tried}", "the video of several at a time"]
    if plan.learns_denoisers:
        more.append(f"denoisers that take {' or '.join(inputs)}")
    if not plan.speeds:
        more.append("other speeds")
    if few := [who for who, count in results.takes.items() if count < _FEW]:
        more.append(f"more movements of {', '.join(few)}: over so few, intervals are too narrow")
    # With three, intervals over people miss the truth in a quarter of all studies, not in 5 %.
    if 1 < len(results.takes) < _FEW:
        more.append(f"more people: over {len(results.takes)}, intervals over people are too narrow")
    if not plan.placements and not plan.video:
        more.append("other places of the sensor, bodies of other shape, mirrored movements")
    return [*left, *missing, *more]


def draw_curve(results: Results) -> Figure:
    """Draw the frames found by the share of real data, with intervals over takes."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 4.4), dpi=120, layout="constrained")
    axes = figure.subplots()
    given = sorted(results.plan.shares)
    for number, name in enumerate((REAL, *results.plan.wanted)):
        values = {share: _values(results, name, share, 0) for share in given}
        shares = [share for share in given if values[share]]
        if not shares:
            continue
        gains = [gain_of(values[share]) for share in shares]
        middle = 100.0 * np.array([one.mean for one in gains])
        ends = 100.0 * np.array([one.over_takes for one in gains]).T
        away = np.abs(ends - middle)
        places = 100.0 * np.array(shares) * (1.0 + 0.02 * (number - 2))
        axes.errorbar(
            places, middle, away, label=TITLES[name], color=_COLOURS[number % len(_COLOURS)],
            marker="o", markersize=4, capsize=2, linewidth=1.2,
            linestyle="--" if name == "radar" else "-",
        )  # fmt: skip
    axes.axhline(100.0 / len(results.classes), color="0.6", linewidth=0.8, linestyle=":")
    axes.set_xscale("log")
    axes.set_xticks([100.0 * one for one in given], [f"{one:.0%}" for one in given])
    axes.minorticks_off()
    axes.set_xlim(100.0 * given[0] / 1.5, 100.0 * given[-1] * 1.5)  # wide even for one share
    axes.set(
        xlabel=f"share of the {results.kind} radar's data",
        ylabel="frames found (%), mean over people",
        title=results.plan.title,
    )
    axes.legend(fontsize=8)
    return figure


def draw_confusions(results: Results, totals: dict[str, list[Score]]) -> Figure:
    """Draw the confusion of frames of every condition with all real data, a mean over seeds."""
    shown = {name: own for name, own in totals.items() if name in TITLES and name != "radar"}
    return confusion_figure(
        [np.mean([shares(one.frames) for one in own], axis=0) for own in shown.values()],
        results.classes,
        [TITLES[name] for name in shown],
        f"Frames of a {results.kind} radar, mean of {results.plan.seeds} seeds",
    )


def _table_of_scores(results: Results) -> str:
    names = (REAL, *results.plan.wanted)
    rows = [["radar's data", "frames", *(TITLES[name] for name in names)]]
    for share in sorted(results.plan.shares):
        runs = [run for run in results.runs if run.task.share == share]
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


def _table_of_gains(findings: Sequence[Finding], people: bool) -> str:
    head = ["radar's data", "added", "gain", "over takes", "over people", "p", "movements"]
    rows = [
        [
            f"{one.share:.0%}",
            TITLES[one.added],
            f"{100 * one.frames.mean:+.1f}",
            _range(one.frames.over_takes),
            _range(one.frames.over_people) if people else "–",
            f"{one.p:.3f}",
            f"{100 * one.movements.mean:+.1f} ({_range(one.movements.over_takes)})",
        ]
        for one in findings
    ]
    return "\n".join(markdown_table([head, *rows]))


def _table_of_totals(results: Results, totals: dict[str, list[Score]]) -> str:
    first = results.plan.classifiers[0].title
    rows = [["classifier", "learnt from", "frames", "movements", "latency s"]]
    for name, own in totals.items():
        rows.append(
            [
                first if name in TITLES else name,
                TITLES.get(name, TITLES[REAL]),
                _spread([100.0 * one.mean_recall for one in own], 1),
                _spread([100.0 * mean_recall(one.gestures) for one in own], 1),
                _spread([one.latency_s for one in own], 2),
            ]
        )
    return "\n".join(markdown_table(rows))


def _spread(values: Sequence[float], digits: int) -> str:
    if not np.isfinite(values).all():
        return "–"
    text = f"{np.mean(values):.{digits}f}"
    return text if len(values) < 2 else f"{text} ± {np.std(values, ddof=1):.{digits}f}"


def _summary(values: dict[str, NDArray[np.float64]]) -> dict[str, Any]:
    gain = gain_of(values)
    return {"mean": gain.mean, "over_takes": gain.over_takes}


def _gain(results: Results, added: str, share: float, measure: int) -> Gain | None:
    values = _values(results, added, share, measure, minus=REAL)
    return gain_of(values) if values else None


def _values(
    results: Results, name: str, share: float, measure: int, minus: str | None = None
) -> dict[str, NDArray[np.float64]]:
    """Mean over folds and draws for every take that has such a score, by person."""
    by_person: dict[str, dict[str, list[float]]] = {}
    for run in results.runs:
        if run.task.share != share:
            continue
        for take, scores in run.takes.get(name, {}).items():
            value = scores[measure]
            if value is not None:
                less = 0.0 if minus is None else run.takes[minus][take][measure] or 0.0
                own = by_person.setdefault(results.subject_of[take], {})
                own.setdefault(take, []).append(value - less)
    return {
        who: np.array([np.mean(values) for values in takes.values()])
        for who, takes in by_person.items()
    }


def _range(ends: tuple[float, float]) -> str:
    """Interval in words; of one take each, or one, there is none."""
    return f"{100 * ends[0]:+.1f} to {100 * ends[1]:+.1f}" if ends[0] < ends[1] else "unknown"


def _points(gain: Gain) -> str:
    return f"{100 * gain.mean:+.1f} points ({_range(gain.over_takes)} over takes)"
