"""``sd2 radar``: raw capture to Doppler map, and descriptions of captures of one's own."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sd2core.cli.command_parser import command
from sd2core.cli.output import Report, progress_bar
from sd2core.cli.radar_description import DESCRIPTION, Description, describe
from sd2core.options.kinds import SpanM
from sd2core.options.records import ARGUMENT, OptionError, Place, changed_flags, given_flags
from sd2core.options.shared import Axis, Channel, Json, ReplacesMaps
from sd2core.radar_config import Clutter

if TYPE_CHECKING:
    from sd2core.io.radar import RadarCapture
    from sd2core.maps import DopplerMap

_AXIS = ("bins", "v_max_mps")
_CHANNEL = ("receiver", "transmitter")
_OF_SAMPLES = ("clutter", "range", *_CHANNEL)
_PROCESSING = (*_AXIS, "clutter", "range")


class Radar(ReplacesMaps, Axis, Channel, Json, Description):
    """Options of ``sd2 radar``.

    Parameters
    ----------
    capture : CAPTURE
        a capture's file or folder, the .h5 of a K60168A, a table of points (.csv, .npy, .mat), a
        recording, or the word describe
    file : FILE
        after describe: the samples
    out : FILE.npz
        the map to write
    clutter
        what to subtract as static: nothing; each frame's mean over its chirps; the parabola
        that fits its chirps best, which swaying leaves no trace in; or the mean averaged over
        frames, which keeps slow movers
    range : LO,HI
        count only echoes from this range in metres (default: all)
    """

    capture: Annotated[Path, ARGUMENT]
    file: Annotated[Path | None, ARGUMENT] = None
    out: Annotated[Path | None, Place(endings=(".npz",))] = None
    clutter: Clutter = "none"
    range: SpanM | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.file is None:
            for name in given_flags(self, DESCRIPTION):
                raise OptionError(
                    f"{name} is given", f"{name} after `sd2 radar describe FILE` only"
                )
            if self.out is None:
                self.refuse(_PROCESSING, "without --out", "together with --out")
        elif str(self.capture) != "describe":
            raise OptionError(f"Two files are given, {self.capture} and {self.file}", "one")
        else:
            of_maps = ("out", *_PROCESSING, *_CHANNEL)
            self.refuse(of_maps, "to describe a file", "without describe")

    def refuse(self, names: Sequence[str], why: str, where: str) -> None:
        """Refuse those of the named options that are not as by default."""
        comma = "," if why.startswith("and ") else ""
        for name in changed_flags(self, names):
            raise OptionError(f"{name} is given{comma} {why}", f"{name} {where}")


@command("radar", Radar)
def _radar(options: Radar) -> Report:
    """Turn a raw radar capture into a Doppler map, or say what limits it has.

    Prints the resolution and limits of the radar by its configuration, what was
    assumed, and a note if the velocity axis extends beyond the limits. What files
    each radar needs is in docs/radar-files.md. `sd2 radar describe FILE` writes a
    description of samples of one's own (.npy, .h5, .mat, .sigmf-meta), or of a table
    of points, and asks for what no option says.

      sd2 radar capture/                   (limits, and what was assumed)
      sd2 radar adc_data_Raw_0.bin --out real.npz --receiver 1
      sd2 radar describe walk.npy --carrier-hz 60.5e9 --bandwidth-hz 1e9
      sd2 radar capture/ --out real.npz
      sd2 radar capture/ --out real.npz --clutter mean --range 0.5,4
      sd2 radar walk.sd2 --out real.npz    (the capture of a recording)
      sd2 radar swing.h5 --out real.npz    (a file that holds the map already)
      sd2 radar points.csv --out real.npz --v-max 4    (a point cloud)
    """
    if options.file is not None:
        return describe(options.file, options)
    return _limits(options) if options.out is None else _write_map(options, options.out)


def _found(options: Radar) -> tuple[Path, RadarCapture | None, float]:
    """The file, its capture, None where it holds a finished map, and the offset of its clock."""
    from sd2core.io.radar import holds_map, load_capture
    from sd2core.recording.recording import is_recording, open_recording

    path, channel = options.capture, (options.receiver, options.transmitter)
    if not is_recording(path):
        return path, None if holds_map(path) else load_capture(path).channel(*channel), 0.0
    recording = open_recording(path)
    capture = None if recording.holds_radar_map else recording.load_capture(*channel)
    return recording.radar or path, capture, recording.radar_offset_s


def _limits(options: Radar) -> Report:
    """Say what a capture's radar can tell apart, and what was assumed of it."""
    from sd2core.cli.info.description import describe_capture, describe_radar

    path, capture, _ = _found(options)
    if capture is None:
        options.refuse(_CHANNEL, f"and {path} holds a finished map", "for raw samples only")
        return describe_radar(path)
    return describe_capture(path, capture)


def _write_map(options: Radar, out: Path) -> Report:
    from sd2core.cli.info.description import describe_map, limit_facts
    from sd2core.cli.reading import chosen_axis
    from sd2core.fmcw import doppler_map, limits

    path, capture, offset_s = _found(options)
    if capture is None:
        doppler = _recorded(path, options)
    else:
        with progress_bar("Processing") as progress:
            doppler = doppler_map(
                capture,
                axis=chosen_axis(options),
                clutter=options.clutter,
                range_m=options.range,
                progress=progress,
            )
    doppler = doppler.shifted(offset_s)
    doppler.save(out)
    description = describe_map(out, doppler)
    if capture is not None:
        description.data["limits"] = limits(capture.config)
        radar = {"radar": capture.config.name, **limit_facts(capture.config)}
        description.facts = radar | description.facts
    return description


def _recorded(path: Path, options: Radar) -> DopplerMap:
    """Map that the radar made itself, or that of its points, on the axis asked for."""
    from sd2core.cli.reading import chosen_axis
    from sd2core.io.radar import load_recorded_map
    from sd2core.io.radar.points import looks_like_points

    refused, what = ((), "points") if looks_like_points(path) else (_AXIS, "a finished map")
    options.refuse((*refused, *_OF_SAMPLES), f"and {path} holds {what}", "for raw samples only")
    return load_recorded_map(path, chosen_axis(options)).doppler
