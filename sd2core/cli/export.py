"""``sd2 export``: write a data set to learn from."""

from __future__ import annotations

import argparse
import shlex
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sd2core.cli.command_parser import Options, add_command
from sd2core.cli.options import (
    bin_list,
    given,
    name_list,
    not_negative_float,
    positive_float,
    positive_int,
    share,
)
from sd2core.cli.output import (
    counted,
    duration,
    listed,
    picked,
    print_event,
    print_facts,
    print_json,
    progress_bar,
    progress_events,
)

if TYPE_CHECKING:
    from sd2core.datasets.forecast import Forecast
    from sd2core.datasets.options import DatasetOptions
    from sd2core.datasets.recording_sources import Making
    from sd2core.datasets.source import LazySource
    from sd2core.datasets.writing import Written

_KINDS = "synthetic,denoised,simulated,real"
_LINE_EVERY_S = 0.1


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``export``."""
    parser = add_command(commands, "export", handler=_export)
    parser.add_value("inputs", Path, "INPUT", "recordings, pairs, maps, folders", nargs="+")
    parser.add_output("FILE", "the data set to write (.zarr, .h5 or .npz)", goes_on=True)
    _add_content(parser)
    _add_making(parser)
    parser.add_flag("--dry-run", "print counts, size and time, and write nothing")
    parser.add_json_and_progress()


def _add_content(parser: Options) -> None:
    group = parser.add_argument_group("segments")
    group.add_value("--kinds", str, "LIST", f"some of {_KINDS} (default: all)", _KINDS)
    group.add_limbs()
    text = "also keep what inertial sensors there would feel at every frame, e.g."
    text += " left-wrist,right-wrist; places as for `sd2 imu`"
    group.add_value("--imu", name_list, "LIST", text, ())
    group.add_value("--segment-frames", positive_int, "N", "length of a segment", 72)
    group.add_value("--overlap-frames", int, "N", "frames that neighbours share", 10)
    text = "frames per second; other sources are brought to it (default: the first one's)"
    group.add_value("--rate", positive_float, "FPS", text)
    text = "label of a segment: the gesture with most frames, if they are enough, or the label"
    text += " with most frames, background included"
    group.add_choice("--label-rule", ("foreground", "majority"), text, "foreground")
    text = "least share of a segment for foreground (default: 20%%)"
    group.add_value("--min-share", share, "SHARE", text, 0.2)
    text = "leave out windows with less of their label than this share (default: none)"
    group.add_value("--min-purity", share, "SHARE", text, 0.0)
    text = "windows, wherever labels begin, or one segment per labelled span"
    group.add_choice("--segments", ("windows", "spans"), text, "windows")
    text = "of spans: time kept before and after each"
    group.add_value("--margin-s", not_negative_float, "S", text, 0.0)
    group.add_value(
        "--shortest-s", not_negative_float, "S", "of spans: leave out shorter ones", 0.0
    )
    text = "of spans: fill up with empty frames, which the array mask tells apart, or stretch"
    group.add_choice("--span-length", ("padded", "resampled"), text, "padded")
    group.add_value("--title", str, "TEXT", "title of the card and the sheet", "")
    people = parser.add_argument_group("people")
    text = "subject of each recording and map, separated by commas, in their order (default:"
    text += " each recording shows another person)"
    people.add_value("--subjects", name_list, "LIST", text)
    people.add_people_kept_out(
        "kept out to validate with, separated by commas, or none (default: about a sixth of all,"
        " chosen by their names, so that adding people does not move others)",
        "kept out to test with, or none (default: likewise)",
    )
    text = "labels of a Doppler map; once for each map, in their order"
    people.add_value("--labels", Path, "FILE", text, [], action="append")


def _add_making(parser: Options) -> None:
    group = parser.add_argument_group("maps")
    text = "sensors around the body besides the recording's own, as `sd2 placements` writes"
    text += " them, or those that each recording plans"
    group.add_value("--placements", str, "FILE|planned", text)
    text = "make synthetic maps as fast as possible within this error, e.g. 2%% (default: exact)"
    group.add_value("--tolerance", share, "SHARE", text)
    text = "simulate this radar (see sd2 simulate radar --help) at every place, which takes far"
    text += " longer than everything else (default: only the maps in radar files)"
    group.add_value("--simulate", str, "NAME|CONFIG.json", text)
    text = "the denoiser (default: that of each recording, or the bundled one)"
    group.add_value("--model", str, "FILE|NAME", text)
    group.add_texture()
    group.add_count()
    group.add_axis()
    text = "bins to set to zero in all kinds (default: those of the synthetic maps)"
    group.add_value("--null-bins", bin_list, "LIST", text)


def _export(options: argparse.Namespace) -> int:
    """Write a data set to learn from: segments with labels, sensors and provenance.

    Cuts maps into segments, windows of 72 frames or one of each labelled span, and writes
    them with a label per frame and per segment, subject, sensor, provenance, and a split by
    subject. Beside it come a card (.card.md, .card.json) and a preview sheet (.png).
    Inputs are recordings or folders of them, pairs, and Doppler maps. Sources that are in the
    data set already are kept: the same command resumes a stopped export, or adds inputs.

      sd2 export walk.sd2 --out walk.zarr
      sd2 export walk.sd2 --segments spans --margin-s 0.2 --out gestures.zarr
      sd2 export anna.sd2 ben.sd2 --placements grid.json --out gestures.h5
      sd2 export campaign.zarr --kinds denoised,simulated --out campaign-set.zarr
      sd2 export recordings/ --out set.zarr --dry-run
    """
    from sd2core.datasets.layout import format_of
    from sd2core.datasets.sources import gather

    format_of(options.out)
    wanted = _dataset_options(options)
    making = _making(options)
    sources = gather(options.inputs, making, subjects=options.subjects, label_files=options.labels)
    if options.dry_run:
        return _dry_run(options, sources, wanted, making)
    from sd2core.datasets.preview import write_preview
    from sd2core.datasets.writing import write_dataset
    from sd2core.runs.pace import keep_pace

    begun_s = time.monotonic()
    if options.progress_json:
        print_event("start", format="sd2-export-progress", version=1, sources=len(sources))
        steps = progress_events(_LINE_EVERY_S, time_left=True, stage="segments")
        written = write_dataset(options.out, sources, wanted, steps)
        print_event("progress", done=0, total=0, stage="sheet", left_s=None)
    else:
        with progress_bar("Exporting", "step") as progress:
            written = write_dataset(options.out, sources, wanted, progress)
    if written.added == written.sources:
        keep_pace(making.pace_kind, time.monotonic() - begun_s, written.segments)
    sheet = write_preview(options.out)
    if options.progress_json:
        print_event("done", **_said(written, sheet))
    elif options.json:
        print_json(_said(written, sheet))
    else:
        _print(written, sheet)
    return 1 if written.failed else 0


def _dataset_options(options: argparse.Namespace) -> DatasetOptions:
    from sd2core.datasets.options import DatasetOptions, SpanOptions

    spans = SpanOptions(options.margin_s, options.shortest_s, options.span_length)
    return DatasetOptions(
        kinds=tuple(options.kinds.replace(" ", "").split(",")),
        length=options.segment_frames,
        overlap=options.overlap_frames,
        frame_rate_hz=options.rate,
        null_bins=options.null_bins,
        validation=options.validation_subjects,
        test=options.test_subjects,
        spans=spans if options.segments == "spans" else None,
        **picked(options, "label_rule", "min_share", "min_purity", "limbs", "imu", "title"),
        provenance={"command": shlex.join(["sd2", *sys.argv[1:]])},
    )


def _making(options: argparse.Namespace) -> Making:
    from sd2core.datasets.recording_sources import Making
    from sd2core.datasets.simulating import Simulation
    from sd2core.doppler.options import chosen_options
    from sd2core.io.radar import named_radar
    from sd2core.options.synthesis import Synthesis
    from sd2core.placements.placements import read_placements

    return Making(
        kinds=_dataset_options(options).kinds,
        synthesis=chosen_options(
            Synthesis(**given(options, ("bins", "v_max_mps", "null_bins", "count")))
        ),
        tolerance=options.tolerance,
        placements=options.placements
        if options.placements in (None, "planned")
        else read_placements(Path(options.placements)),
        simulation=None if options.simulate is None else Simulation(named_radar(options.simulate)),
        **picked(options, "model", "texture", "limbs", "imu"),
    )


def _dry_run(
    options: argparse.Namespace, sources: list[LazySource], wanted: DatasetOptions, making: Making
) -> int:
    from sd2core.datasets.forecast import Counting
    from sd2core.runs.pace import known_pace_s

    with progress_bar("Counting", "source") as progress:
        counting = Counting.of(sources, progress)
    forecast = counting.forecast(wanted, making.synthesis.axis.bins)
    each_s = known_pace_s(making.pace_kind)
    seconds = None if each_s is None else each_s * forecast.segments
    if options.json:
        print_json(
            {
                "dataset": str(options.out),
                **picked(forecast, "sources", "segments"),
                "segments_of_subject": forecast.of_subject,
                "segments_of_label": forecast.of_label,
                "segments_of_kind": forecast.of_kind,
                "segments_of_split": forecast.of_split(),
                **picked(forecast, "frame_rate_hz", "total_bytes"),
                "seconds": seconds,
                "failed": list(forecast.failed),
            }
        )
    else:
        facts = _forecast_facts(forecast)
        facts["time"] = (
            "not known before the first source is written"
            if seconds is None
            else f"about {duration(seconds)}, as such maps took here before"
        )
        print_facts(f"{options.out} would hold", facts)
    _complain(forecast.failed)
    return 1 if forecast.failed else 0


def _forecast_facts(forecast: Forecast) -> dict[str, str]:
    return {
        "segments": f"{forecast.segments:,} of {counted(forecast.sources, 'source')}",
        "size": f"{forecast.total_bytes / 1e6:,.1f} MB before compression",
        "kinds": listed(forecast.of_kind),
        "labels": listed(forecast.of_label),
        "splits": listed(forecast.of_split()),
        "frame rate": f"{forecast.frame_rate_hz:g} frames/s",
    }


def _said(written: Written, sheet: Path) -> dict[str, Any]:
    from sd2core.datasets.card import card_paths

    markdown, as_json, _ = card_paths(written.path)
    return {
        "dataset": str(written.path),
        **picked(written, "segments", "sources", "added"),
        "card": str(markdown),
        "card_json": str(as_json),
        "sheet": str(sheet),
        "failed": [f"{one.key.title}: {one.reason}" for one in written.failed],
    }


def _print(written: Written, sheet: Path) -> None:
    said = _said(written, sheet)
    before = written.sources - written.added
    print_facts(
        str(written.path),
        {
            "segments": f"{written.segments:,} of {counted(written.sources, 'source')}"
            + (f", of which {before:,} were there already" if before else ""),
            "card": said["card"],
            "sheet": said["sheet"],
        },
    )
    _complain(said["failed"])


def _complain(failed: tuple[str, ...] | list[str]) -> None:
    for one in failed:
        print(f"sd2: left out {one}", file=sys.stderr)
