"""``sd2 labels figure``: the Doppler maps of a recording with its labels."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from sd2core.cli.labels.reading import labels_at, recording_clock
from sd2core.cli.options import add_command, not_negative_float
from sd2core.cli.recording_maps import add_labelled_recording, chosen_maps, maps_of

if TYPE_CHECKING:
    from sd2core.maps import DopplerMap


def add_figure(kinds: argparse._SubParsersAction) -> None:
    """Add ``figure``."""
    parser = add_command(
        kinds,
        "figure",
        "draw the Doppler maps of a recording with its labels",
        handler=_figure,
        description=(
            "Maps one above the other on one time axis, the labels below them with names and a\n"
            "hatch for each, and their edges on the maps. 0 dB is the strongest bin of a map.\n"
            "Suggestions that were not accepted are not drawn."
        ),
        examples=(
            "  sd2 labels figure walk.sd2 --out walk.pdf\n"
            "  sd2 labels figure walk.sd2 --out detail.png --maps synthetic,denoised --from-s 2"
            " --to-s 6"
        ),
    )
    add_labelled_recording(parser)
    parser.add_argument(
        "--out", type=Path, required=True, metavar="FILE", help="FILE.png, FILE.svg or FILE.pdf"
    )
    parser.add_argument(
        "--from-s", type=not_negative_float, metavar="S", help="start of the figure, in seconds"
    )
    parser.add_argument(
        "--to-s", type=not_negative_float, metavar="S", help="end of the figure, in seconds"
    )


def _figure(options: argparse.Namespace) -> None:
    from sd2core.figures.maps import Levels, MapRow, draw_maps, save_maps
    from sd2core.files.figure_files import check_figure
    from sd2core.recording.recording import open_recording
    from sd2core.sensor import VelocityAxis

    check_figure(options.out)
    recording = open_recording(options.recording)
    clock = recording_clock(recording)
    labels = labels_at(options.labels or options.recording, clock)
    names = chosen_maps(options, recording)
    rows = [
        MapRow(doppler, _title(name, doppler), _strongest(doppler))
        for name, doppler in maps_of(recording, names, axis=VelocityAxis()).items()
    ]
    figure = draw_maps(
        rows,
        Levels(),
        start_s=clock.start_s if options.from_s is None else options.from_s,
        end_s=clock.end_s if options.to_s is None else options.to_s,
        labels=labels,
        heading=recording.title + (" (simulated)" if recording.simulated else ""),
    )
    about = {
        "recording": recording.title,
        "simulated": recording.simulated,
        "sensor_position_m": list(recording.sensor.position_m),
    }
    save_maps(figure, options.out, rows, about)
    print(f"{options.out}: {', '.join(row.title.lower() for row in rows)}")


def _title(name: str, doppler: DopplerMap) -> str:
    if name != "radar":
        return name.capitalize()
    return "Radar (simulated)" if doppler.kind == "simulated" else "Radar"


def _strongest(doppler: DopplerMap) -> float:
    import numpy as np

    told = np.delete(doppler.values, doppler.null_bins, axis=0)
    return float(told.max(initial=0.0)) or 1.0
