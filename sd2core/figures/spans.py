"""Labelled spans in a figure: on a row per track with their names, and as edges on the maps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from sd2core.labels.formats.rows import apart
from sd2core.labels.spans import Labels, Span

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LANE_IN = 0.2
"""Height of one lane of spans."""
_FREE_COLOUR = "#8a8f98"
_HATCHES = ("", "////", "\\\\\\\\", "....", "xxxx", "----", "||||", "oo", "++")
_NARROW_IN = 0.03
"""Below this width neither a hatch nor an edge could be told from the next."""
_LETTER_IN = 0.062
"""Width of a letter at the size of names, a little on the wide side."""


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


def draw_lanes(
    axes: Axes,
    lanes: Sequence[tuple[str, Sequence[Span]]],
    labels: Labels,
    start_s: float,
    end_s: float,
    in_per_s: float,
) -> None:
    """Draw spans as boxes with a colour and a hatch per label, and names where they fit."""
    looks = _looks(labels, lanes)
    for at, (_, spans) in enumerate(lanes):
        top = len(lanes) - 1 - at
        for name in dict.fromkeys(span.label for span in spans):
            here = [span for span in spans if span.label == name]
            wide = [span for span in here if span.duration_s * in_per_s >= _NARROW_IN]
            narrow = [span for span in here if span.duration_s * in_per_s < _NARROW_IN]
            look, plain = looks[name], {"facecolor": looks[name]["edgecolor"], "linewidth": 0}
            for some, how in ((wide, {"linewidth": 0.8, **look}), (narrow, plain)):
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
        Patch(label=f" {name}" if name.startswith("_") else name, linewidth=0.8, **look)
        for name, look in _looks(labels, lanes).items()
    ]
    key = figure.legend(
        handles=patches, loc="outside lower center", ncols=min(len(patches), 6), fontsize=7,
        frameon=False, handlelength=2.2, handleheight=1.1,
    )  # fmt: skip
    for text in key.get_texts():
        text.set_parse_math(False)


def _looks(
    labels: Labels, lanes: Sequence[tuple[str, Sequence[Span]]]
) -> dict[str, dict[str, Any]]:
    """Colour and hatch of every label in view: never the colour alone."""
    from matplotlib.colors import to_rgba

    known = {one.name: one.colour for one in labels.label_set.labels}
    used = {span.label for _, row in lanes for span in row}
    looks = {}
    for number, name in enumerate([*known, *sorted(used - known.keys())]):
        colour = known.get(name, _FREE_COLOUR)
        if name in used:
            looks[name] = {
                "facecolor": to_rgba(colour, 0.35),
                "edgecolor": colour,
                "hatch": _HATCHES[number % len(_HATCHES)],
            }
    return looks
