"""Preview sheet of a data set: pictures of some segments of every label."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sd2core.datasets.card import card_paths
from sd2core.datasets.layout import Header
from sd2core.datasets.reading import Dataset, open_dataset
from sd2core.datasets.source import KINDS
from sd2core.files.figure_files import save_figure
from sd2core.labels.label_set import GESTURES
from sd2core.maps import MapKind

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

EXAMPLES = 3
"""Segments per label."""

_LOW_DB = -30.0
_MAX_SEGMENTS = 1_000_000
"""Are looked at when examples are chosen; of more, the first ones."""
_MAX_LABELS = 16
"""Labels on a sheet: those of most segments."""
_IN_A_BAND = 12
_CELL_IN = (1.02, 0.86)
_LEFT_IN, _MIN_IN = 0.8, 8.6
_PIXELS_PER_INCH = 150
_INK, _MUTED, _NOTHING = "#1d232b", "#5a6370", "#eef0f3"
_NO_COLOUR = "#8a8f98"
_TITLES: dict[MapKind, str] = {
    "synthetic": "Synthetic",
    "denoised": "Denoised",
    "simulated": "Radar\n(simulated)",
    "real": "Radar (real)",
}


@dataclass(frozen=True, eq=False)
class Example:
    """Column of the sheet: one segment."""

    label: int  # Place in the header's labels.
    # In dB below the strongest cell of the segment in that kind, (bins, frames); empty where it is
    # zero.
    levels: dict[MapKind, NDArray[np.float64]]
    marked: NDArray[np.bool_]  # True in frames that have the label.
    words: tuple[str, str]  # Subject and placement.


def write_preview(path: Path) -> Path:
    """Draw the sheet of a finished data set and return its path."""
    with open_dataset(path) as dataset:
        name = dataset.path.name
        title = dataset.header.title or name
        figure = draw_preview(title, dataset.header, examples_of(dataset), len(dataset))
    out = card_paths(path)[2]
    save_figure(figure, out, {"dataset": name, "what": "preview sheet"}, _PIXELS_PER_INCH)
    return out


def examples_of(dataset: Dataset, each: int = EXAMPLES) -> list[Example]:
    """Choose segments that show their label well, of different people and places."""
    header = dataset.header
    columns = {
        name: np.asarray(dataset[name][:_MAX_SEGMENTS])
        for name in ("segment_label", "purity", "available", "subject", "placement", "range_m")
    }
    examples = []
    counts = np.bincount(columns["segment_label"], minlength=len(header.labels))
    for label in sorted(np.argsort(-counts, kind="stable")[:_MAX_LABELS].tolist()):
        rows = np.flatnonzero(columns["segment_label"] == label)
        kinds = columns["available"][rows].sum(axis=1)
        # Those of most kinds first, then those that hold most of their label.
        order = rows[np.lexsort((rows, -columns["purity"][rows], -kinds))]
        examples += [
            _example(dataset, columns, label, row) for row in _different(order, columns, each)
        ]
    return examples


def draw_preview(title: str, header: Header, examples: list[Example], segments: int) -> Figure:
    """Draw the sheet: a column per segment, a row per kind.

    Parameters
    ----------
    title : str
        Heading of the sheet.
    header : Header
        Labels, kinds, axis and frame rate.
    examples : list of Example
        Segments to draw; those of one label come together.
    segments : int
        Number of all segments, for the caption.
    """
    from matplotlib.figure import Figure

    kinds = [kind for kind in KINDS if any(kind in one.levels for one in examples)]
    bands = _bands(examples)
    wide, high = _CELL_IN
    band_in = len(kinds) * high + 0.95
    width = max(_LEFT_IN + max(map(len, bands)) * wide + 0.8, _MIN_IN)
    height = len(bands) * band_in + 0.95
    figure = Figure(figsize=(width, height), dpi=_PIXELS_PER_INCH)
    figure.set_facecolor("white")
    write = partial(figure.text, transform=figure.dpi_scale_trans, va="top", parse_math=False)

    def axes_at(left: float, bottom: float, wide: float, high: float) -> Axes:
        return figure.add_axes((left / width, bottom / height, wide / width, high / height))

    shown: Any = None
    for number, band in enumerate(bands):
        top = height - 0.85 - number * band_in
        for column, example in enumerate(band):
            left = _LEFT_IN + column * wide
            if column == 0 or band[column - 1].label != example.label:
                name = header.labels[example.label]
                of_class = header.classes.get(name, name)
                write(left, top, name, fontsize=9.5, weight="bold", color=_INK)
                write(left, top - 0.145, of_class if of_class != name else "", fontsize=7,
                      color=_MUTED)  # fmt: skip
            write(left + 0.45 * wide, top - 0.33, "\n".join(example.words), fontsize=6.3,
                  color=_MUTED, ha="center", linespacing=1.15)  # fmt: skip
            for row, kind in enumerate(kinds):
                bottom = top - 0.62 - (row + 1) * high + 0.08
                axes = axes_at(left, bottom, 0.92 * wide, 0.90 * high)
                shown = _cell(axes, header, example, kind) or shown
                if row == 0:
                    _mark(axes, header, example)
                axes.tick_params(labelbottom=row == len(kinds) - 1, labelleft=column == 0)
                if column == 0:
                    write(0.32, bottom + 0.45 * high, _TITLES[kind], fontsize=7.5, color=_INK,
                          rotation=90, ha="center", va="center", weight="bold")  # fmt: skip
    along = "across: time in the segment (s); upwards: velocity (m/s, approaching +)"
    write(0.3, height - 0.2, title, fontsize=12, weight="bold", color=_INK)
    write(0.3, height - 0.46, _caption(header, segments), fontsize=7.5, color=_MUTED)
    write(_LEFT_IN, 0.1, along, fontsize=7, color=_MUTED, va="bottom")
    if shown is not None:
        scale = figure.colorbar(shown, cax=axes_at(width - 0.6, 0.55, 0.12, height - 1.9))
        scale.set_label("dB", fontsize=7, color=_MUTED)
        scale.ax.tick_params(labelsize=6.5, colors=_MUTED)
        scale.outline.set_linewidth(0.4)
    return figure


def _caption(header: Header, segments: int) -> str:
    # Where both are there, each row says which of them it is.
    radar = " The radar is simulated." if header.simulated and "real" not in header.kinds else ""
    return (
        f"{segments:,} segments of {header.length} frames"
        f" ({header.length / header.frame_rate_hz:.1f} s). Coloured bars: frames with the label."
        f" Colours: dB relative to each segment's own strongest cell.{radar}"
    )


def _bands(examples: list[Example]) -> list[list[Example]]:
    """Arrange columns in rows of the sheet, the examples of a label together."""
    groups = [
        [one for one in examples if one.label == label]
        for label in dict.fromkeys(one.label for one in examples)
    ]
    count = -(-len(examples) // _IN_A_BAND)
    each = -(-len(groups) // count)
    return [
        [one for group in groups[start : start + each] for one in group]
        for start in range(0, len(groups), each)
    ]


def _different(order: NDArray[np.int64], columns: dict[str, NDArray], each: int) -> list[int]:
    """Choose the first rows of an order, of different people and places while there are some."""
    chosen: list[int] = []
    # First other people, then other places, then what there is.
    for same in (("subject",), ("subject", "placement"), ()):
        seen = {tuple(int(columns[name][row]) for name in same) for row in chosen}
        for row in order[: 1000 * each].tolist():
            if len(chosen) == each:
                return chosen
            whose = tuple(int(columns[name][row]) for name in same)
            if row not in chosen and (not same or whose not in seen):
                seen.add(whose)
                chosen.append(row)
    return chosen


def _example(dataset: Dataset, columns: dict[str, NDArray], label: int, row: int) -> Example:
    header = dataset.header
    levels = {}
    for kind in header.kinds:
        if columns["available"][row, KINDS.index(kind)]:
            values = np.asarray(dataset[kind][row], np.float64).T
            most = values.max()
            with np.errstate(divide="ignore", invalid="ignore"):
                level = 10.0 * np.log10(values / most)
            level[list(header.null_bins)] = np.nan
            levels[kind] = level if most > 0 else np.full_like(level, -np.inf)
    range_m = float(columns["range_m"][row])
    azimuth_deg = float(dataset["azimuth_deg"][row])
    where = f"{range_m:.1f} m, {azimuth_deg + 0.0:.0f}°" if np.isfinite(range_m) else ""
    if not where:
        x, y, z = np.round(dataset["sensor_position_m"][row], 1) + 0.0
        where = f"at {x:g}, {y:g}, {z:g} m"
    who = header.subjects[int(columns["subject"][row])]
    marked = np.asarray(dataset["label"][row]) == label
    return Example(label, levels, marked, (who if len(who) <= 16 else who[:15] + "…", where))


def _cell(axes: Axes, header: Header, example: Example, kind: MapKind) -> Any:
    """Draw one segment in one kind."""
    length_s = header.length / header.frame_rate_hz
    limit = header.axis.v_max_mps
    axes.set_facecolor(_NOTHING)
    shown = None
    if kind in example.levels:
        shown = axes.imshow(
            np.ma.masked_invalid(np.maximum(example.levels[kind], _LOW_DB)),
            origin="lower",
            aspect="auto",
            interpolation="nearest",
            extent=(0.0, length_s, -limit, limit),
            cmap="viridis",
            vmin=_LOW_DB,
            vmax=0.0,
        )
    else:
        axes.text(0.5, 0.5, "none", transform=axes.transAxes, fontsize=7, color=_MUTED,
                  ha="center", va="center")  # fmt: skip
    axes.set_xlim(0.0, length_s)
    axes.set_ylim(-limit, limit)
    tick = round(limit / 2, 1)
    axes.set_yticks([-tick, 0.0, tick], [f"−{tick:g}", "0", f"{tick:g}"])
    axes.set_xticks([0.0, round(length_s / 2, 1)])
    axes.tick_params(labelsize=6, length=2, pad=1.5, colors=_MUTED)
    for spine in axes.spines.values():
        spine.set_linewidth(0.4)
        spine.set_edgecolor(_MUTED)
    return shown


def _mark(axes: Axes, header: Header, example: Example) -> None:
    """Draw a bar over the frames that have the label."""
    limit = header.axis.v_max_mps
    edges_s = np.arange(header.length + 1) / header.frame_rate_hz
    axes.fill_between(
        edges_s, limit * 1.05, limit * 1.16, where=np.append(example.marked, False), step="post",
        color=_colour(header.labels[example.label]), linewidth=0, clip_on=False,
    )  # fmt: skip


def _colour(label: str) -> str:
    known = GESTURES.find(label)
    return _NO_COLOUR if known is None else known.colour
