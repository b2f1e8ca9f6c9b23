"""A comparison as a picture: Doppler maps side by side, velocities of limbs below."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sd2core.compare.joints import GROUPS, rows_of
from sd2core.compare.meshes import Comparison

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = ("#222222", "#b35806", "#2166ac", "#1b7837", "#7b3294", "#c51b7d")
"""Colours of the meshes in order; the reference is drawn in the first, whatever its number."""

_CURVES = ("hands", "elbows", "torso")


def draw_comparison(comparison: Comparison) -> Figure:
    """Draw maps and curves on one time axis."""
    from matplotlib.figure import Figure

    count = len(comparison.labels)
    figure = Figure(figsize=(3.4 * max(count, 2), 8.4), dpi=120, layout="constrained")
    grid = figure.add_gridspec(4, count, height_ratios=(1.6, 1, 1, 1))
    top = max(float(one.values.max(initial=0.0)) for one in comparison.maps) or 1.0
    first = None
    for number, (label, one) in enumerate(zip(comparison.labels, comparison.maps, strict=True)):
        axes = figure.add_subplot(grid[0, number], sharex=first, sharey=first)
        first = first or axes
        edge = one.axis.v_max_mps
        start, end = one.timebase.start_s, one.timebase.end_s
        shown = axes.imshow(
            # The square root shows what is weak; the scale says so.
            np.sqrt(one.values / top),
            origin="lower",
            aspect="auto",
            extent=(start, end, -edge, edge),
            cmap="magma",
            vmin=0.0,
            vmax=1.0,
            interpolation="nearest",
        )
        l1 = comparison.differences[number].map_l1
        what = "reference" if number == comparison.reference else f"relative L1 {l1:.2f}"
        axes.set_title(f"{label}\n{what}", fontsize=9)
        axes.set_xlabel("time (s)", fontsize=8)
        if number == 0:
            axes.set_ylabel("velocity (m/s, + approaching)", fontsize=8)
        axes.tick_params(labelsize=7)
        if number == count - 1:
            bar = figure.colorbar(shown, ax=axes, pad=0.02)
            bar.set_label("√(share / largest)", fontsize=7)
            bar.ax.tick_params(labelsize=6)
    for row, group in enumerate(_CURVES, start=1):
        axes = figure.add_subplot(grid[row, :], sharex=first)
        for number, label in enumerate(comparison.labels):
            colour = COLOURS[_place(number, comparison.reference) % len(COLOURS)]
            for joint in GROUPS[group]:
                right = joint.endswith(".R")
                axes.plot(
                    comparison.times_s,
                    np.where(
                        comparison.measured,
                        comparison.velocity_mps[number][:, rows_of((joint,))[0]],
                        np.nan,
                    ),
                    color=colour,
                    linewidth=1.3 if number == comparison.reference else 1.0,
                    linestyle="--" if right or joint == "pelvis" else "-",
                    label=label if joint == GROUPS[group][0] else None,
                )
        lines = "chest —, pelvis - -" if group == "torso" else "left —, right - -"
        axes.set_ylabel(f"{group}: {lines}\n(m/s)", fontsize=8)
        axes.axhline(0.0, color="#999999", linewidth=0.5)
        axes.grid(alpha=0.2)
        axes.tick_params(labelsize=7)
        if row == 1:
            axes.legend(fontsize=7, loc="upper right", ncols=count)
    axes.set_xlabel("time (s)", fontsize=8)
    place = ", ".join(f"{value:g}" for value in comparison.sensor.position_m)
    figure.suptitle(
        f"Synthetic Doppler and velocity along the line of sight of a sensor at ({place}) m",
        fontsize=10,
    )
    return figure


def _place(number: int, reference: int) -> int:
    """Number of a colour: 0 for the reference, the others from 1."""
    if number == reference:
        return 0
    return number + 1 if number < reference else number
