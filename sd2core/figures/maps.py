"""Doppler maps on one time axis, the difference of two of them, and labelled spans below."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.figure_files import save_figure
from sd2core.labels.formats.lanes import apart
from sd2core.labels.spans import Labels, Span
from sd2core.maps import DopplerMap, draw_cells, without_shares
from sd2core.timebase import Timebase

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Scale = Literal["dB", "linear"]

_WIDTH_IN, _ROW_IN, _PIXELS_PER_INCH = 8.0, 1.55, 200
_COLUMNS = round(0.8 * _WIDTH_IN * _PIXELS_PER_INCH)
"""Pixels across a map."""
_MUTED = "#5a6370"
_DIFFERENCE = ["#b4520b", "#f7f8f9", "#0b7a5b"]
"""Colours of negative, no and positive differences."""
LANE_IN = 0.2
"""Height of one lane of spans."""
_FREE_COLOUR = "#8a8f98"
_HATCHES = ("", "////", "\\\\\\\\", "....", "xxxx", "----", "||||", "oo", "++")
_NARROW_IN = 0.03
"""Below this width neither a hatch nor an edge could be told from the next."""
_LETTER_IN = 0.062
"""Width of a letter at the size of names, a little on the wide side."""


@dataclass(frozen=True)
class Levels:
    """Colour scale: levels relative to the reference of each map."""

    scale: Scale = "dB"
    low_db: float = -30.0  # first colour; on a linear scale this is zero
    high_db: float = 0.0  # last colour
    colour_map: str = "viridis"  # name of a matplotlib map

    @property
    def ends(self) -> tuple[float, float]:
        """Ends of the colour bar: dB, or per cent of the reference."""
        if self.scale == "dB":
            return self.low_db, self.high_db
        return 0.0, 100.0 * 10.0 ** (self.high_db / 10.0)

    @property
    def unit(self) -> str:
        """Unit of the colour bar."""
        return "dB" if self.scale == "dB" else "% of 0 dB"

    def of(self, values: NDArray[np.float32], reference: float) -> NDArray[np.float64]:
        """Values as levels, held at both ends."""
        share = np.asarray(values, np.float64) / reference
        low, high = self.ends
        if self.scale == "linear":
            return np.clip(100.0 * share, low, high)
        with np.errstate(divide="ignore"):
            return np.clip(10.0 * np.log10(share), low, high)


@dataclass(frozen=True, eq=False)
class MapRow:
    """One map of a figure."""

    doppler: DopplerMap
    title: str  # with the word simulated where it is
    reference: float  # value shown as 0 dB
    offset_s: float = 0.0  # start of its clock on that of the figure


def difference_of(
    minuend: MapRow, subtrahend: MapRow, levels: Levels
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Level of one map minus that of another, on the clock of the first, and where it is known.

    The first is made as strong as the other altogether (:func:`matching_gain`); both are then
    relative to the other's reference, and held within the levels shown. Both arrays are of shape
    (bins, frames); unknown are cells of which one map says nothing: no frame, no person, an
    emptied bin.
    """
    one, other = minuend.doppler, subtrahend.doppler
    if one.axis != other.axis:
        raise Sd2Error("The maps have different velocity axes", "the same, for their difference")
    times_s = one.times_s + minuend.offset_s - subtrahend.offset_s
    shown = [other.timebase.shown_at(time_s) for time_s in times_s]
    covered = np.array([frame is not None for frame in shown])
    frames = np.array([frame or 0 for frame in shown])
    if one.present is not None:
        covered &= one.present
    if other.present is not None:
        covered &= other.present[frames]
    known = np.repeat(covered[None], one.axis.bins, axis=0)
    for doppler in (one, other):
        known[[*doppler.null_bins, *doppler.unseen_bins]] = False
    theirs = other.values[:, frames]
    gain = matching_gain(one.values[known], theirs[known])
    difference = levels.of(gain * one.values, subtrahend.reference) - levels.of(
        theirs, subtrahend.reference
    )
    return np.where(known, difference, 0.0), known


def matching_gain(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    """Factor by which the values of one map add up to as much as those of another.

    Counted and measured energies have no common unit. It is 1 if either map is empty.
    """
    sums = [float(values.sum(dtype=np.float64)) for values in (one, other)]
    return sums[1] / sums[0] if min(sums) > 0 else 1.0


def draw_maps(
    rows: Sequence[MapRow],
    levels: Levels,
    *,
    start_s: float,
    end_s: float,
    difference: tuple[int, int] | None = None,
    labels: Labels | None = None,
    heading: str = "",
) -> Figure:
    """Draw maps on one time axis, from top to bottom, between two times.

    Parameters
    ----------
    rows : sequence of MapRow
        At least one.
    levels : Levels
        Colour scale of all maps.
    start_s, end_s : float
        Ends of the time axis; ``start_s < end_s``.
    difference : (int, int), optional
        Two rows: the level of the first minus that of the second is a last row
        (:func:`difference_of`).
    labels : Labels, optional
        Drawn below the maps, and their edges on them, where any is in view.
    heading : str
        Subject of the maps, with the word simulated where it is; empty for none.

    Raises
    ------
    Sd2Error
        Without a map, if the start is not before the end, or if the two maps of a difference have
        different velocity axes.
    """
    from matplotlib.figure import Figure

    if not rows:
        raise Sd2Error("There is no Doppler map to draw", "at least one")
    if not start_s < end_s:
        raise Sd2Error(
            f"The figure is to show {start_s:g} to {end_s:g} s", "a start before the end"
        )
    lanes = lanes_of(labels, start_s, end_s) if labels is not None else []
    heights_in = [_ROW_IN] * (len(rows) + (difference is not None))
    heights_in += [LANE_IN * len(lanes)] if lanes else []
    size = (_WIDTH_IN, sum(heights_in) + 0.45 + 0.35 * bool(lanes) + 0.2 * bool(heading))
    figure = Figure(figsize=size, dpi=_PIXELS_PER_INCH / 2, layout="constrained")
    figure.set_facecolor("white")
    all_axes = figure.subplots(
        len(heights_in), 1, sharex=True, squeeze=False, height_ratios=heights_in
    )[:, 0]
    maps_axes = all_axes[:-1] if lanes else all_axes
    shown: Any = None
    for axes, row in zip(maps_axes, rows, strict=False):
        row = _strongest(_in_view(row, start_s, end_s))
        level = levels.of(row.doppler.values, row.reference)
        low, high = levels.ends
        shown = _draw(axes, row, level, levels.colour_map, low, high)
        carrier_hz = row.doppler.carrier_hz
        carrier = "" if carrier_hz is None else f"{carrier_hz / 1e9:.4g} GHz · "
        unit = f"0 dB: {row.reference:.3g} {row.doppler.unit}".rstrip()
        _title(axes, row.title, carrier + unit)
    bar = figure.colorbar(
        shown, ax=list(all_axes[: len(rows)]), pad=0.01, aspect=12 * len(rows), fraction=0.05
    )
    bar.set_label(f"level ({levels.unit})", fontsize=8)
    bar.ax.tick_params(labelsize=7)
    if difference is not None:
        first, second = (rows[number] for number in difference)
        shown = _in_view(first, start_s, end_s)
        _draw_difference(figure, maps_axes[-1], first, second, levels, shown)
    if labels is not None and lanes:
        in_per_s = 0.8 * _WIDTH_IN / (end_s - start_s)
        _draw_lanes(all_axes[-1], lanes, labels, start_s, end_s, in_per_s)
        add_key(figure, lanes, labels)
        for axes in maps_axes:
            draw_edges(axes, lanes, in_per_s)
    for axes in all_axes:
        axes.set_xlim(start_s, end_s)
        axes.tick_params(labelsize=8)
    all_axes[-1].set_xlabel("time (s)", fontsize=8)
    figure.supylabel("velocity (m/s, approaching +)", fontsize=8)
    if heading:
        figure.suptitle(heading, x=0.01, ha="left", fontsize=9, parse_math=False)
    return figure


def save_maps(figure: Figure, path: Path, rows: Sequence[MapRow], about: dict[str, Any]) -> None:
    """Write a figure of :func:`draw_maps` as PNG, SVG or PDF by the name's ending.

    Parameters
    ----------
    figure : Figure
    path : Path
        Ends in ``.png``, ``.svg`` or ``.pdf``; errors are those of :func:`save_figure`.
    rows : sequence of MapRow
        Maps in the figure, for its provenance.
    about : dict
        Further provenance, fit for JSON.
    """
    provenance = about | {
        "maps": [
            {"title": row.title, "kind": row.doppler.kind, "reference": row.reference}
            | {"offset_s": row.offset_s, "provenance": without_shares(row.doppler.meta)}
            for row in rows
        ]
    }
    save_figure(figure, path, provenance, _PIXELS_PER_INCH)


def _in_view(row: MapRow, start_s: float, end_s: float) -> MapRow:
    """Part of a map between two times of the figure: hours are not drawn for a second."""
    start, stop = row.doppler.timebase.frames_between(start_s - row.offset_s, end_s - row.offset_s)
    return replace(row, doppler=row.doppler.between(start, max(stop, start + 2)))


def _strongest(row: MapRow) -> MapRow:
    """The strongest of the frames that share a column of pixels, as on screen: nothing is lost."""
    doppler, frames = row.doppler, len(row.doppler.timebase)
    starts = np.arange(0, frames, -(-frames // _COLUMNS))
    if len(starts) == frames:
        return row
    pooled = replace(
        doppler,
        values=np.maximum.reduceat(doppler.values, starts, axis=1),
        timebase=Timebase(doppler.times_s[starts]),
        present=None if doppler.present is None else np.maximum.reduceat(doppler.present, starts),
        uncertainty=None,
        limbs=None,
    )
    return replace(row, doppler=pooled)


def _draw(
    axes: Axes, row: MapRow, level: NDArray[np.float64], colours: Any, low: float, high: float
) -> Any:
    doppler = row.doppler
    clock = doppler.timebase.shifted(row.offset_s)
    return draw_cells(
        axes, level, doppler.axis, clock, doppler.present, low=low, high=high, colours=colours
    )


def _draw_difference(
    figure: Figure, axes: Axes, first: MapRow, second: MapRow, levels: Levels, seen: MapRow
) -> None:
    """Draw the difference of whole maps, whatever is seen of the first."""
    from matplotlib.colors import LinearSegmentedColormap

    values, known = difference_of(first, second, levels)
    begin = int(np.searchsorted(first.doppler.times_s, seen.doppler.times_s[0]))
    table = LinearSegmentedColormap.from_list("difference", _DIFFERENCE, N=255)
    low, high = levels.ends
    limit = high - low
    level = np.where(known, values, np.nan)[:, begin : begin + len(seen.doppler.times_s)]
    shown = _draw(axes, seen, level, table, -limit, limit)
    other = _short(second.title).lower()
    name = f"{_short(first.title)} − {other}"
    _title(axes, name, f"both as strong altogether, relative to the 0 dB of {other}")
    bar = figure.colorbar(shown, ax=axes, pad=0.01, aspect=12, fraction=0.05)
    bar.set_label(f"difference ({levels.unit})", fontsize=8)
    bar.ax.tick_params(labelsize=7)


def _title(axes: Axes, left: str, right: str) -> None:
    axes.set_title(left, loc="left", fontsize=8, fontweight="bold")
    axes.set_title(right, loc="right", fontsize=7, color=_MUTED)


def _short(title: str) -> str:
    return title.partition(" · ")[0]


def lanes_of(labels: Labels, start_s: float, end_s: float) -> list[tuple[str, list[Span]]]:
    """Spans in view, in lanes without overlaps, each with the name of its track.

    Suggestions that are not accepted are no labels yet and are left out.
    """
    lanes = []
    for track in labels.tracks:
        seen = [
            span
            for span in labels.of_track(track.name)
            if span.start_s < end_s and span.end_s > start_s and span.origin != "suggestion"
        ]
        if seen:
            rows = apart(seen, lambda span: (span.start_s, span.end_s))
            lanes += [(track.name if not at else "", row) for at, row in enumerate(rows)]
    return lanes


def _draw_lanes(
    axes: Axes,
    lanes: Sequence[tuple[str, Sequence[Span]]],
    labels: Labels,
    start_s: float,
    end_s: float,
    in_per_s: float,
) -> None:
    """Draw spans as boxes with a colour and a hatch per label, and names where they fit."""
    styles = _styles(labels, lanes)
    for at, (_, spans) in enumerate(lanes):
        top = len(lanes) - 1 - at
        for name in dict.fromkeys(span.label for span in spans):
            here = [span for span in spans if span.label == name]
            wide = [span for span in here if span.duration_s * in_per_s >= _NARROW_IN]
            narrow = [span for span in here if span.duration_s * in_per_s < _NARROW_IN]
            style, plain = styles[name], {"facecolor": styles[name]["edgecolor"], "linewidth": 0}
            for some, how in ((wide, {"linewidth": 0.8, **style}), (narrow, plain)):
                if some:
                    stretches = [(span.start_s, span.duration_s) for span in some]
                    axes.broken_barh(stretches, (top + 0.08, 0.84), **how)
        for span in spans:
            left_s, right_s = max(span.start_s, start_s), min(span.end_s, end_s)
            if (right_s - left_s) * in_per_s >= _LETTER_IN * len(span.label):
                words = axes.text(
                    (left_s + right_s) / 2, top + 0.48, span.label, ha="center", va="center",
                    fontsize=6.5, clip_on=True, parse_math=False,
                )  # fmt: skip
                words.set_bbox(
                    {"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.85}
                )
    axes.set_ylim(0, len(lanes))
    axes.set_yticks(
        [len(lanes) - 0.5 - at for at, (name, _) in enumerate(lanes) if name],
        [name for name, _ in lanes if name],
        parse_math=False,
    )
    axes.tick_params(axis="y", length=0)


def draw_edges(axes: Axes, lanes: Sequence[tuple[str, Sequence[Span]]], in_per_s: float) -> None:
    """Draw where spans begin (whole lines) and end (broken ones) over a map."""
    spans = [span for _, row in lanes for span in row if span.duration_s * in_per_s >= _NARROW_IN]
    look: Any = {"transform": axes.get_xaxis_transform(), "colors": "white", "linewidth": 0.7}
    axes.vlines([span.start_s for span in spans], 0, 1, alpha=0.75, **look)
    axes.vlines([span.end_s for span in spans], 0, 1, alpha=0.75, linestyles="dashed", **look)


def add_key(figure: Figure, lanes: Sequence[tuple[str, Sequence[Span]]], labels: Labels) -> None:
    """Write below the figure which colour and hatch is which label."""
    from matplotlib.patches import Patch

    # A name that begins with an underscore would be left out.
    patches = [
        Patch(label=f" {name}" if name.startswith("_") else name, linewidth=0.8, **style)
        for name, style in _styles(labels, lanes).items()
    ]
    key = figure.legend(
        handles=patches, loc="outside lower center", ncols=min(len(patches), 6), fontsize=7,
        frameon=False, handlelength=2.2, handleheight=1.1,
    )  # fmt: skip
    for text in key.get_texts():
        text.set_parse_math(False)


def _styles(
    labels: Labels, lanes: Sequence[tuple[str, Sequence[Span]]]
) -> dict[str, dict[str, Any]]:
    """Colour and hatch of every label in view: never the colour alone."""
    from matplotlib.colors import to_rgba

    known = {one.name: one.colour for one in labels.label_set.labels}
    used = {span.label for _, row in lanes for span in row}
    styles = {}
    for number, name in enumerate([*known, *sorted(used - known.keys())]):
        colour = known.get(name, _FREE_COLOUR)
        if name in used:
            styles[name] = {
                "facecolor": to_rgba(colour, 0.35),
                "edgecolor": colour,
                "hatch": _HATCHES[number % len(_HATCHES)],
            }
    return styles
