"""The maps as they are shown, as a figure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sd2app.models.difference import DifferenceModel
from sd2app.models.display import HeatmapLevels
from sd2app.models.tracks import TrackModel


def save_figure(
    tracks: Sequence[tuple[TrackModel, str]],
    difference: DifferenceModel,
    levels: HeatmapLevels,
    span_s: tuple[float, float],
    about: dict[str, Any],
    path: Path,
) -> None:
    """Draw the stretch in view and write it, by the ending of its name.

    Parameters
    ----------
    tracks : sequence of (TrackModel, str)
        From top to bottom, each with what is to be said beside its title; those without
        a map are left out.
    difference : DifferenceModel
        Drawn where it is on screen.
    levels : HeatmapLevels
    span_s : tuple of float
        What is shown.
    about : dict
        Goes into the file, fit for JSON.
    path : Path

    Raises
    ------
    Sd2Error
        When there is no map, or no figure can have that name.
    """
    from sd2core.figures.maps import Levels, MapRow, draw_maps, save_maps

    shown = [(track, words) for track, words in tracks if track.map is not None]
    rows = [
        MapRow(track.map, " · ".join(filter(None, (track.title, words))), track.reference,
               track.offset_s)
        for track, words in shown if track.map is not None
    ]  # fmt: skip
    pair = None
    if difference.shown:
        there = [track for track, _ in shown]
        pair = there.index(difference.denoised), there.index(difference.real)
    figure = draw_maps(
        rows,
        Levels(levels.scale, levels.low_db, levels.high_db, levels.colour_map),
        start_s=span_s[0],
        end_s=span_s[1],
        difference=pair,
    )
    save_maps(figure, path, rows, about)
