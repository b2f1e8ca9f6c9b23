"""Report of a comparison: for a terminal, as Markdown, as JSON, and as figures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sd2core.classify.comparison import Run, Table, gains
from sd2core.classify.experiment import Condition
from sd2core.classify.metrics import mean_recall, recalls, shares
from sd2core.files.tables import markdown_table, numbers_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Rows = list[list[str]]
"""A heading and what is under it."""


def title_of(condition: Condition) -> str:
    """Name the training data of a condition."""
    words = {
        "nothing": "radar only",
        "synthetic": "+ synthetic",
        "denoised": "+ denoised synthetic",
        "radar": "+ radar of the same movements",
    }[condition.added]
    return words + (", moved sensors" if condition.moved else "")


def network_of(condition: Condition) -> str:
    """Name the network, its features and its delay."""
    network = condition.network
    shown = "columns" if network.features == "columns" else "strongest bin"
    late = f"after {network.delay_s:g} s" if network.delay_s else "at once"
    name = "kernel" if network.model == "kernel" else f"{network.model.upper()} {network.width}"
    return f"{name}, {shown}, {late}"


def as_json(table: Table) -> dict[str, Any]:
    """Return all runs with means and standard deviations over seeds."""
    return {
        "radar": table.kind,
        "by_movement": table.by_movement,
        "classes": list(table.classes),
        "seeds": table.options.seeds,
        "network": asdict(table.options.network),
        "conditions": [
            {
                **asdict(condition),
                "title": title_of(condition),
                "mean_recall_frames": _spread(_values(table, condition, frame_recall)),
                "mean_recall_gestures": _spread(_values(table, condition, gesture_recall)),
                "mean_recall_frames_moved": _spread(_values(table, condition, moved_recall)),
                "gain": _spread(gains(table, condition, frame_recall)),
                "confusion_frames": mean_confusion(table, condition).tolist(),
                "runs": [run.to_json() for run in table.of(condition)],
            }
            for condition in table.conditions
        ],
    }


def network_rows(table: Table) -> Rows:
    """Compare networks and features at equal budget on all radar data, nothing added."""
    rows = [["network", "parameters", *_score_head(table), "CPU s"]]
    for condition in table.conditions:
        if condition.share == 1.0 and condition.added == "nothing":
            runs = table.of(condition)
            cpu = _number(np.array([run.cpu_s for run in runs]), 1.0, 1)
            rows.append(
                [network_of(condition), f"{runs[0].parameters:,}", *_scores(table, condition), cpu]
            )
    return rows


def added_rows(table: Table) -> Rows:
    """Compare the kinds of data added to all radar data."""
    rows = [["trained on", "frames added", *_score_head(table), "gain, points", "moved, frames"]]
    for condition in main_conditions(table):
        if condition.share == 1.0:
            added = np.mean([sum(run.added.values()) for run in table.of(condition)])
            rows.append(
                [
                    title_of(condition),
                    f"{added:,.0f}",
                    *_scores(table, condition),
                    _gain(table, condition),
                    _number(_values(table, condition, moved_recall)),
                ]
            )
    return rows


def curve_rows(table: Table) -> Rows:
    """Tabulate mean recall by share of the radar data, with and without added data."""
    titles = list(dict.fromkeys(title_of(one) for one in curve_conditions(table)))
    rows = [["share of radar data", "frames", *titles, *(f"gain {one}" for one in titles[1:])]]
    for share in sorted({one.share for one in curve_conditions(table)}):
        own = {title_of(one): one for one in curve_conditions(table) if one.share == share}
        frames = np.mean([sum(run.real.values()) for run in table.of(own[titles[0]])])
        cells = [_number(_values(table, own[name], frame_recall)) for name in titles]
        cells += [_gain(table, own[name]) for name in titles[1:]]
        rows.append([f"{share:.0%}", f"{frames:,.0f}", *cells])
    return rows


def confusion_rows(table: Table, condition: Condition) -> Rows:
    """Tabulate the confusion of frames in per cent."""
    mean, sd = mean_confusion(table, condition), _confusion_sd(table, condition)
    rows = [["true", *(f"taken for {name}" for name in table.classes)]]
    for number, name in enumerate(table.classes):
        cells = [
            "–" if np.isnan(value) else f"{100 * value:.1f} ± {100 * spread:.1f}"
            for value, spread in zip(mean[number], sd[number], strict=True)
        ]
        rows.append([name, *cells])
    return rows


def as_text(table: Table) -> str:
    """Return all tables for a terminal."""
    return "\n".join(_lines(table, numbers_table))


def as_markdown(table: Table) -> str:
    """Return all tables in Markdown."""
    return "\n".join(_lines(table, markdown_table)) + "\n"


def mean_confusion(table: Table, condition: Condition) -> NDArray[np.float64]:
    """Return the mean over seeds of row-normalised confusion matrices; NaN without such frames."""
    return np.asarray(_confusions(table, condition).mean(axis=0))


def frame_recall(run: Run) -> float:
    """Mean recall of frames over classes."""
    return run.score.mean_recall


def gesture_recall(run: Run) -> float:
    """Mean recall of whole gestures over classes."""
    return mean_recall(run.score.gestures)


def moved_recall(run: Run) -> float:
    """Mean recall of frames seen from other places."""
    return float("nan") if run.moved is None else run.moved.mean_recall


def _lines(table: Table, lines_of: Callable[[Rows], list[str]]) -> list[str]:
    subjects = dict.fromkeys(name for run in table.runs for name in run.subjects)
    who = (
        f"{'the same people' if table.options.same_people else 'one person'}; movements are kept"
        " apart, which says nothing about other people"
        if table.by_movement
        else f"people not trained on: {', '.join(subjects)}"
    )
    lines = [
        f"Evaluated on a {table.kind} radar's maps of {who}. Numbers are per cent, mean ± standard"
        f" deviation over {table.options.seeds} seeds (each other"
        f" {'movements' if table.by_movement else 'people'}, another draw, another network)."
        " Frames: mean over classes of the share of frames that were found. Gestures:"
        " the same of whole gestures, by what most of their frames were taken for.",
        "",
        "Networks, all of the radar's data, equal steps of training:",
        "",
        *lines_of(network_rows(table)),
    ]
    if any(condition.added != "nothing" for condition in main_conditions(table)):
        lines += ["", "What is added to all of the radar's data:", "", *lines_of(added_rows(table))]
    if len({one.share for one in curve_conditions(table)}) > 1:
        lines += ["", "Learning curve, frames:", "", *lines_of(curve_rows(table))]
    for condition in main_conditions(table):
        if condition.share == 1.0 and condition.added != "radar":
            lines += ["", f"Confusion of frames, {title_of(condition)}:", ""]
            lines += lines_of(confusion_rows(table, condition))
    return lines


def main_conditions(table: Table) -> list[Condition]:
    """Return the conditions of the network used for all comparisons of data."""
    return [one for one in table.conditions if one.network == table.options.network]


def curve_conditions(table: Table) -> list[Condition]:
    """Return the conditions of the learning curve."""
    return [one for one in main_conditions(table) if one.added != "radar" and not one.moved]


def _score_head(table: Table) -> list[str]:
    return ["frames", *(f"{name}" for name in table.classes), "gestures", "latency s"]


def _scores(table: Table, condition: Condition) -> list[str]:
    each = np.array([recalls(run.score.frames) for run in table.of(condition)])
    return [
        _number(_values(table, condition, frame_recall)),
        *(_number(column) for column in each.T),
        _number(_values(table, condition, gesture_recall)),
        _number(_values(table, condition, lambda run: run.score.latency_s), 1.0, 2),
    ]


def _gain(table: Table, condition: Condition) -> str:
    if condition.added == "nothing":
        return ""
    values = 100.0 * gains(table, condition, frame_recall)
    text = f"{values.mean():+.1f}"
    return text if len(values) < 2 else f"{text} ± {values.std(ddof=1):.1f}"


def _values(table: Table, condition: Condition, of: Callable[[Run], float]) -> NDArray[np.float64]:
    return np.array([of(run) for run in table.of(condition)])


def _confusions(table: Table, condition: Condition) -> NDArray[np.float64]:
    return np.array([shares(run.score.frames) for run in table.of(condition)])


def _confusion_sd(table: Table, condition: Condition) -> NDArray[np.float64]:
    each = _confusions(table, condition)
    return np.asarray(each.std(axis=0, ddof=1) if len(each) > 1 else np.zeros(each.shape[1:]))


def _spread(values: NDArray[np.float64]) -> dict[str, float]:
    """Mean and standard deviation over seeds."""
    sd = float(values.std(ddof=1)) if len(values) > 1 else 0.0
    return {"mean": float(values.mean()), "sd": sd}


def _number(values: NDArray[np.float64], scale: float = 100.0, digits: int = 1) -> str:
    known = scale * values[~np.isnan(values)]
    if not known.size:
        return "–"
    text = f"{known.mean():.{digits}f}"
    return text if len(known) < 2 else f"{text} ± {known.std(ddof=1):.{digits}f}"


# -- Figures -------------------------------------------------------------------------------------

_COLOURS = ("#444444", "#b35806", "#2166ac")


def draw_confusions(table: Table) -> Figure:
    """Draw one confusion matrix for each kind of data added to all radar data."""
    shown = [one for one in main_conditions(table) if one.share == 1.0 and one.added != "radar"]
    return confusion_figure(
        [mean_confusion(table, one) for one in shown],
        table.classes,
        [title_of(one) for one in shown],
        f"Frames of a {table.kind} radar, mean of {table.options.seeds} seeds",
    )


def confusion_figure(
    matrices: Sequence[NDArray[np.float64]],
    classes: Sequence[str],
    titles: Sequence[str],
    heading: str,
) -> Figure:
    """Draw row-normalised confusion matrices in a row or two, bound to no window."""
    from matplotlib.figure import Figure

    columns = min(len(matrices), 3)
    lines = -(-len(matrices) // columns)
    figure = Figure(figsize=(3.4 * columns + 0.6, 3.2 * lines + 0.6), dpi=120, layout="constrained")
    all_axes = figure.subplots(lines, columns, squeeze=False).ravel()
    for axes, matrix, title in zip(all_axes, matrices, titles, strict=False):
        _matrix(axes, matrix, classes)
        axes.set_title(title, fontsize=9)
    for axes in all_axes[len(matrices) :]:
        axes.axis("off")
    figure.suptitle(heading, fontsize=10)
    return figure


def draw_curve(table: Table) -> Figure:
    """Draw mean recall of frames by share of the radar data, with standard deviations."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.2), dpi=120, layout="constrained")
    axes = figure.subplots()
    curves: dict[str, list[Condition]] = {}
    for condition in curve_conditions(table):
        curves.setdefault(title_of(condition), []).append(condition)
    for (title, conditions), colour in zip(curves.items(), _COLOURS, strict=False):
        ordered = sorted(conditions, key=lambda one: one.share)
        each = [100.0 * np.array([frame_recall(run) for run in table.of(one)]) for one in ordered]
        shares = [100.0 * one.share for one in ordered]
        axes.errorbar(
            shares,
            [values.mean() for values in each],
            [values.std(ddof=1) if len(values) > 1 else 0.0 for values in each],
            color=colour,
            label=title,
            marker="o",
            markersize=4,
            capsize=3,
        )
    axes.set_xscale("log")
    axes.set_xticks(shares, [f"{share:g} %" for share in shares])
    axes.minorticks_off()
    axes.set_xlabel(f"share of the {table.kind} radar's data used for training")
    axes.set_ylabel("mean recall of frames (%)")
    axes.grid(alpha=0.25)
    axes.legend(fontsize=8)
    axes.set_title(
        f"Learning curve on a {table.kind} radar, {table.options.seeds} seeds", fontsize=10
    )
    return figure


def _matrix(axes: Axes, matrix: NDArray[np.float64], classes: Sequence[str]) -> None:
    axes.imshow(np.nan_to_num(matrix), vmin=0.0, vmax=1.0, cmap="Blues")
    places = range(len(classes))
    for row in places:
        for column in places:
            value = matrix[row, column]
            axes.text(
                column,
                row,
                "–" if np.isnan(value) else f"{100 * value:.0f} %",
                ha="center",
                va="center",
                color="white" if value > 0.55 else "black",
                fontsize=9,
            )
    axes.set_xticks(places, classes, fontsize=8, rotation=20, ha="right")
    axes.set_yticks(places, classes, fontsize=8)
    axes.set_xlabel("taken for", fontsize=8)
    axes.set_ylabel("true", fontsize=8)
