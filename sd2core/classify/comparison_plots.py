"""Confusion matrices and learning curves as pictures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sd2core.classify.comparison import Table
from sd2core.classify.comparison_text import (
    curve_conditions,
    frame_recall,
    main_conditions,
    mean_confusion,
    title_of,
)
from sd2core.classify.experiment import Condition

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLOURS = ("#444444", "#b35806", "#2166ac")


def draw_confusions(table: Table) -> Figure:
    """One matrix for each of what is added to all of the radar's data."""
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
    """Matrices whose rows add up to 1, in a row or two.

    Returns
    -------
    matplotlib.figure.Figure
        Bound to no window.
    """
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
    """Mean recall of frames by the share of the radar's data; bars are standard deviations."""
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
    axes.set_xlabel(f"share of the {table.kind} radar's data that is learnt from")
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
