"""From a Doppler map to the pixels of the stretch in view."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtGui import QImage

from sd2app.colour_maps import lookup_table
from sd2app.models.display import HeatmapLevels
from sd2app.models.tracks import TrackModel


def column_frames(
    times_s: NDArray[np.float64], end_s: float, start_s: float, stop_s: float, columns: int
) -> NDArray[np.int64]:
    """First frame on screen in every pixel column, and one past the last, (columns + 1,).

    A column shows frames ``[edges[k], max(edges[k] + 1, edges[k + 1]))``. Minus
    one marks columns before the first frame, ``len(times_s)`` those past the end.
    """
    edges_s = start_s + (stop_s - start_s) * np.arange(columns + 1) / columns
    frames = np.searchsorted(times_s, edges_s + 1e-9, side="right") - 1
    frames[edges_s >= end_s] = len(times_s)
    return frames


def shade_columns(
    track: TrackModel, levels: HeatmapLevels, start_s: float, stop_s: float, columns: int
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Shades of the stretch in view, and which columns have something to show.

    Where several frames share a column the strongest value is shown, so that a
    short gesture does not vanish when zoomed out.

    Returns
    -------
    shades : float32 array, shape (bins, columns)
    filled : bool array, shape (columns,)
    """
    assert track.map is not None
    timebase = track.map.timebase
    frames = column_frames(
        timebase.times_s,
        timebase.end_s,
        start_s - track.offset_s,
        stop_s - track.offset_s,
        columns,
    )
    first = frames[:-1]
    filled = (first >= 0) & (first < len(timebase))
    shades = np.zeros((track.map.axis.bins, columns), np.float32)
    if not filled.any():
        return shades, filled
    begin, end = int(first[filled][0]), int(frames[1:][filled][-1])
    end = min(max(end, int(first[filled][-1]) + 1), len(timebase))
    stretch = track.map.values[:, begin:end]
    starts = first[filled] - begin
    values = (
        np.maximum.reduceat(stretch, starts, axis=1)
        if end - begin > starts.size
        else stretch[:, starts]
    )
    shades[:, filled] = track.shade(values, levels)
    if track.covered is not None:
        filled[filled] = track.covered[first[filled]]
    return shades, filled


def heatmap_image(
    track: TrackModel,
    levels: HeatmapLevels,
    start_s: float,
    stop_s: float,
    columns: int,
    background: int,
) -> QImage:
    """One pixel per column and bin, fastest approach on top."""
    shades, filled = shade_columns(track, levels, start_s, stop_s, columns)
    colours = lookup_table(levels.colour_map)[(shades * 255.0).astype(np.uint8)]
    colours[:, ~filled] = background
    pixels = np.ascontiguousarray(colours[::-1])  # (bins, columns)
    height, width = pixels.shape
    return QImage(pixels.data, width, height, 4 * width, QImage.Format.Format_RGB32).copy()
