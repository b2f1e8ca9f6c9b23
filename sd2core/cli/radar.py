"""``sd2 radar``: raw capture to Doppler map, and descriptions of captures of one's own."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from sd2core.cli.command_parser import add_command
from sd2core.cli.options import flag, given, span_m
from sd2core.cli.output import progress_bar
from sd2core.cli.radar_description import add_description, describe, refuse_description
from sd2core.errors import Sd2Error
from sd2core.radar_config import Clutter

if TYPE_CHECKING:
    from sd2core.io.radar import RecordedMap


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``radar``."""
    parser = add_command(commands, "radar", handler=_radar)
    text = "a capture's file or folder, the .h5 of a K60168A, a recording, or the word describe"
    parser.add_value("capture", Path, "CAPTURE", text)
    parser.add_value("file", Path, "FILE", "after describe: the samples", nargs="?")
    parser.add_map_output(required=False)
    parser.add_axis()
    text = "what to subtract as static: nothing; each frame's mean over its chirps; the"
    text += " parabola that fits its chirps best, which swaying leaves no trace in; or the mean"
    text += " averaged over frames, which keeps slow movers"
    parser.add_choice("--clutter", get_args(Clutter), text, "none")
    parser.add_value(
        "--range", span_m, "LO,HI", "count only echoes from this range in metres (default: all)"
    )
    parser.add_channel()
    parser.add_json()
    add_description(parser)


def _radar(options: argparse.Namespace) -> None:
    """Turn a raw radar capture into a Doppler map, or say what limits it has.

    Prints the resolution and limits of the radar by its configuration, what was
    assumed, and a note if the velocity axis extends beyond the limits. What files
    each radar needs is in docs/radar-files.md. `sd2 radar describe FILE` writes a
    description of samples of one's own (.npy, .h5, .sigmf-meta), and asks for what
    no option says.

      sd2 radar capture/                   (limits, and what was assumed)
      sd2 radar adc_data_Raw_0.bin --out real.npz --receiver 1
      sd2 radar describe walk.npy --carrier-hz 60.5e9 --bandwidth-hz 1e9
      sd2 radar capture/ --out real.npz
      sd2 radar capture/ --out real.npz --clutter mean --range 0.5,4
      sd2 radar walk.sd2 --out real.npz    (the capture of a recording)
      sd2 radar swing.h5 --out real.npz    (a file that holds the map already)
    """
    if options.file is not None:
        if str(options.capture) != "describe":
            raise Sd2Error(f"Two files are given, {options.capture} and {options.file}", "one")
        out = ["--out"] if options.out is not None else []
        of_maps = [*out, *_of_processing(options), *_of_channels(options)]
        _refuse(of_maps, "to describe a file", "without describe")
        describe(options)
        return
    refuse_description(options)
    if options.out is None:
        _show_limits(options)
    else:
        _write_map(options)


def _show_limits(options: argparse.Namespace) -> None:
    """Say what a capture's radar can tell apart, and what was assumed of it."""
    from sd2core.cli.info.description import describe_capture, describe_radar, show
    from sd2core.io.radar import holds_map, load_capture
    from sd2core.recording.recording import is_recording, open_recording

    path, channel = options.capture, (options.receiver, options.transmitter)
    recording = open_recording(path) if is_recording(path) else None
    if recording is not None:
        path = recording.radar or path
    _refuse(_of_processing(options), "without --out", "together with --out")
    if holds_map(path):
        _refuse(_of_channels(options), f"and {path} holds a finished map", "for raw samples only")
        description = describe_radar(path)
    else:
        capture = (
            load_capture(path).channel(*channel)
            if recording is None
            else recording.load_capture(*channel)
        )
        description = describe_capture(path, capture)
    show(description, as_json=options.json)


def _write_map(options: argparse.Namespace) -> None:
    from sd2core.cli.info.description import describe_map, limit_facts, show
    from sd2core.cli.reading import chosen_axis
    from sd2core.fmcw import doppler_map, limits
    from sd2core.io.radar import holds_map, load_capture, load_recorded_map
    from sd2core.recording.recording import is_recording, open_recording

    channel, offset_s = (options.receiver, options.transmitter), 0.0
    if is_recording(options.capture):
        recording = open_recording(options.capture)
        if recording.holds_radar_map:
            _write_recorded(recording.load_radar_map(), recording.radar_offset_s, options)
            return
        capture, offset_s = recording.load_capture(*channel), recording.radar_offset_s
    elif holds_map(options.capture):
        _write_recorded(load_recorded_map(options.capture), 0.0, options)
        return
    else:
        capture = load_capture(options.capture).channel(*channel)
    with progress_bar("Processing") as progress:
        doppler = doppler_map(
            capture,
            axis=chosen_axis(options),
            clutter=options.clutter,
            range_m=options.range,
            progress=progress,
        ).shifted(offset_s)
    doppler.save(options.out)
    description = describe_map(options.out, doppler)
    description.data["limits"] = limits(capture.config)
    radar = {"radar": capture.config.name, **limit_facts(capture.config)}
    description.facts = radar | description.facts
    show(description, as_json=options.json)


def _write_recorded(recorded: RecordedMap, offset_s: float, options: argparse.Namespace) -> None:
    """Write a map that the radar made itself: there are no samples to choose anything for."""
    from sd2core.cli.info.description import describe_map, show

    finished = f"and {recorded.source} holds a finished map"
    _refuse((*_of_processing(options), *_of_channels(options)), finished, "for raw samples only")
    doppler = recorded.doppler.shifted(offset_s)
    doppler.save(options.out)
    show(describe_map(options.out, doppler), as_json=options.json)


def _of_processing(options: argparse.Namespace) -> list[str]:
    """Options of the processing to a map that are given."""
    clutter = ["--clutter"] if options.clutter != "none" else []
    of_axis = {"bins": "--bins", "v_max_mps": "--v-max", "range": "--range"}
    return [*(of_axis[name] for name in given(options, of_axis)), *clutter]


def _of_channels(options: argparse.Namespace) -> list[str]:
    """Options that choose a channel and are given."""
    return [flag(name) for name in given(options, ("receiver", "transmitter"))]


def _refuse(names: Iterable[str], why: str, where: str) -> None:
    """Raise Sd2Error for the first option of those given."""
    for name in names:
        comma = "," if why.startswith("and ") else ""
        raise Sd2Error(f"{name} is given{comma} {why}", f"{name} {where}")
