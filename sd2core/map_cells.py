"""Cells of a map of velocities over time, drawn as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sd2core.mesh.presence import runs
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_NOTHING, _MUTED = "#e9ebee", "#5a6370"


def draw_cells(
    axes: Axes,
    level: NDArray[np.float64],
    velocities: VelocityAxis,
    timebase: Timebase,
    present: NDArray[np.bool_] | None,
    *,
    low: float,
    high: float,
    colours: Any = "viridis",
) -> Any:
    """Draw levels (bins, frames) over seconds and m/s; grey where nothing is known.

    Returns what a colour bar is made for. ``present`` is False in frames without a person.
    """
    times_s = np.append(timebase.times_s, timebase.end_s)
    axes.set_facecolor(_NOTHING)
    shown = axes.pcolormesh(
        times_s,
        velocities.edges_mps,
        np.ma.masked_invalid(level),
        cmap=colours,
        vmin=low,
        vmax=high,
        rasterized=True,
    )
    for start, stop in () if present is None else runs(~present):
        axes.axvspan(times_s[start], times_s[stop], facecolor=_NOTHING, edgecolor=_MUTED,
                     hatch="////", linewidth=0)  # fmt: skip
    return shown
