"""An evaluation as a table and as a picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sd2core.files.tables import markdown_table, numbers_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sd2core.train.evaluation import Evaluation, Group

_COLOURS = ("#888888", "#bbbbbb", "#444444", "#1b7837", "#2166ac", "#b35806", "#7b3294", "#c51b7d")


def as_text(evaluation: Evaluation) -> str:
    """All tables for a terminal."""
    return "\n".join(_lines(evaluation, numbers_table))


def as_markdown(evaluation: Evaluation) -> str:
    """Result of an evaluation in Markdown."""
    return "\n".join(_lines(evaluation, markdown_table)) + "\n"


def draw(evaluation: Evaluation) -> Figure:
    """Draw the error of the peak velocity: in all, per label, per subject; a dot is one model."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 4.2), dpi=120, layout="constrained")
    widths = (max(3, len(evaluation.groups) // 2), *map(len, _places(evaluation)))
    axes = figure.subplots(1, 3, sharey=True, width_ratios=widths)
    groups = evaluation.groups
    for number, group in enumerate(groups):
        _bar(axes[0], number, 0.8, group.values("peak", "mae_mps"), number, group.name)
    axes[0].set_xticks(
        range(len(groups)), [group.name for group in groups], rotation=35, ha="right"
    )
    axes[0].set_ylabel("mean error of the peak velocity (m/s)")
    for part, (axis, names) in enumerate(zip(axes[1:], _places(evaluation), strict=True)):
        width = 0.85 / len(groups)
        for number, group in enumerate(groups):
            for place, name in enumerate(names):
                values = group.values("peak", "mae_mps", **{("label", "subject")[part]: name})
                left = place + (number - (len(groups) - 1) / 2) * width
                _bar(axis, left, width, values, number, group.name if place == 0 else None)
        axis.set_xticks(range(len(names)), names, rotation=35, ha="right")
        axis.set_title(("per gesture", "per person")[part], fontsize=9)
    axes[0].set_title("where something moves", fontsize=9)
    # Beside the bars: inside it would hide some.
    handles = axes[1].get_legend_handles_labels()
    figure.legend(*handles, fontsize=7, ncols=8, loc="outside lower center")
    for axis in axes:
        axis.grid(axis="y", alpha=0.25)
        axis.tick_params(labelsize=8)
    figure.suptitle(
        f"Denoised against {evaluation.kind} radar, {evaluation.moving} frames", fontsize=10
    )
    return figure


def _places(evaluation: Evaluation) -> tuple[tuple[str, ...], tuple[str, ...]]:
    return evaluation.labels, evaluation.subjects


def _bar(
    axes: Axes,
    place: float,
    width: float,
    values: NDArray[np.float64],
    colour: int,
    label: str | None,
) -> None:
    axes.bar(
        place, values.mean(), width, color=_COLOURS[colour % len(_COLOURS)], label=label, alpha=0.85
    )
    if len(values) > 1:
        axes.plot(np.full(len(values), place), values, ".", color="black", markersize=3)


def _lines(
    evaluation: Evaluation, table: Callable[[Sequence[Sequence[str]]], list[str]]
) -> list[str]:
    groups = evaluation.groups
    reference = groups[0].values("peak", "mae_mps").mean()
    lines = [
        f"{evaluation.frames} frames of {evaluation.kind} radar, {evaluation.moving} of them with"
        f" movement; subjects {', '.join(evaluation.subjects)}",
        "",
    ]
    head = ["model", "n", "peak MAE m/s", "σ m/s", "to none", "MAE, all frames", "mean MAE m/s"]
    head += ["corr.", "map RMSE", "map L1", "corr."]
    rows = [
        [
            group.name,
            str(len(group.reports)),
            _number(group.values("peak", "mae_mps")),
            _number(group.values("peak", "sd_mps")),
            _change(group.values("peak", "mae_mps").mean(), reference),
            _number(group.values("peak_all", "mae_mps")),
            _number(group.values("mean", "mae_mps")),
            _number(group.values("mean", "correlation"), 2),
            _number(group.values("map", "rmse_compressed")),
            _number(group.values("map", "relative_l1"), 2),
            _number(group.values("map", "correlation"), 2),
        ]
        for group in groups
    ]
    lines += table([head, *rows])
    for what, names in zip(("gesture", "person"), _places(evaluation), strict=True):
        key = "label" if what == "gesture" else "subject"
        head = [f"peak MAE m/s per {what}", *names]
        rows = [
            [
                group.name,
                *(_number(group.values("peak", "mae_mps", **{key: name})) for name in names),
            ]
            for group in groups
        ]
        moving = ["moving frames", *_counts(groups[0], key, names)]
        lines += ["", *table([head, *rows, moving])]
    empty = groups[0].reports[0].all.peak_all.empty_target
    lines += [
        "",
        "Peak and mean velocity are judged where something moves (10 dB above the noise); map"
        " errors in all frames. n: models of this kind; ±: standard deviation over them."
        + (f" {empty} frames in which the radar shows nothing are left out." if empty else ""),
    ]
    unanswered = [
        f"{report.name} {report.all.peak.empty_estimate}"
        for group in groups
        for report in group.reports
        if report.all.peak.empty_estimate
    ]
    if unanswered:
        lines.append(
            f"Frames answered with nothing, which count as 0 m/s: {', '.join(unanswered)}."
        )
    lines += [f"Note: {note}." for note in evaluation.notes]
    return lines


def _counts(group: Group, key: str, names: Sequence[str]) -> list[str]:
    return [str(int(group.values("peak", "frames", **{key: name})[0])) for name in names]


def _number(values: NDArray[np.float64], digits: int = 3) -> str:
    if np.isnan(values).all():
        return "–"
    text = f"{values.mean():.{digits}f}"
    return text if len(values) == 1 else f"{text} ± {values.std(ddof=1):.{digits}f}"


def _change(value: float, reference: float) -> str:
    return f"{100 * (value / reference - 1):+.0f} %" if reference > 0 else "–"
