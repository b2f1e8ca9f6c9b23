"""``sd2 export``: write a data set to learn from."""

from __future__ import annotations

import shlex
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from sd2core.cli.command_parser import command
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
    tell_lost,
)
from sd2core.files.tables import bytes_text
from sd2core.options.exporting import MAPS, PEOPLE, SEGMENTS, Exporting, SpanOptions
from sd2core.options.kinds import Names
from sd2core.options.records import ARGUMENTS, OptionRecord, Place, given
from sd2core.options.shared import Axis, Denoising, JsonAndProgress
from sd2core.options.synthesis import Counting, Synthesis, Tolerance

if TYPE_CHECKING:
    from sd2core.datasets.recording_sources import Making
    from sd2core.datasets.source import LazySource
    from sd2core.datasets.writing import Written

_LINE_EVERY_S = 0.1


class _Spans(SpanOptions):
    """Choice of the spans that become segments.

    Parameters
    ----------
    segments
        windows, wherever labels begin, or one segment per labelled span
    """

    GROUP = SEGMENTS

    segments: Literal["windows", "spans"] = "windows"


class _People(OptionRecord):
    """People of the inputs.

    Parameters
    ----------
    subjects : LIST
        subject of each recording and map, separated by commas, in their order (default: whom a
        recording names, or else each shows another person)
    labels : FILE
        labels of a Doppler map; once for each map, in their order
    """

    GROUP = PEOPLE

    subjects: Names | None = None
    labels: Annotated[tuple[Path, ...], Place(many="again")] = ()


class _Maps(Denoising, Counting, Axis, Tolerance):
    """How maps of recordings are made.

    Parameters
    ----------
    placements : FILE|planned
        sensors around the body besides the recording's own, as `sd2 placements` writes them, or
        those that each recording plans
    tolerance : SHARE
        make synthetic maps as fast as possible within this error, e.g. 2% (default: exact)
    simulate : NAME|CONFIG.json
        simulate this radar (see sd2 simulate radar --help) at every place, which takes far longer
        than everything else (default: only the maps in radar files)
    model : FILE|NAME
        the denoiser (default: that of each recording, or the bundled one)
    """

    GROUP = MAPS

    placements: str | None = None
    simulate: str | None = None


class Export(Exporting, _Spans, _People, _Maps, JsonAndProgress):
    """Options of ``sd2 export``.

    Parameters
    ----------
    inputs : INPUT
        recordings, pairs, maps, folders
    out : FILE
        the data set to write (.zarr, .h5 or .npz)
    dry_run
        print counts, size and time, and write nothing
    """

    inputs: Annotated[tuple[Path, ...], ARGUMENTS]
    out: Path
    dry_run: bool = False

    @property
    def windowed(self) -> bool:
        """True unless segments are spans."""
        return self.segments == "windows"


@command("export", Export)
def _export(options: Export) -> int:
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
    made_by = {"command": shlex.join(["sd2", *sys.argv[1:]])}
    wanted, making = dataset_and_making(options)
    sources = gather(options.inputs, making, subjects=options.subjects, label_files=options.labels)
    for remark in (text for one in sources for text in one.remarks):
        print(f"sd2: {remark}", file=sys.stderr)
    if options.dry_run:
        return _dry_run(options, sources, wanted, making)
    from sd2core.datasets.preview import write_preview
    from sd2core.datasets.writing import write_dataset
    from sd2core.runs.pace import keep_pace

    begun_s = time.monotonic()
    if options.progress_json:
        print_event("start", format="sd2-export-progress", version=1, sources=len(sources))
        steps = progress_events(_LINE_EVERY_S, time_left=True, stage="segments")
        written = write_dataset(options.out, sources, wanted, steps, provenance=made_by)
        print_event("progress", done=0, total=0, stage="sheet", left_s=None)
    else:
        with progress_bar("Exporting", unit="") as progress:
            written = write_dataset(options.out, sources, wanted, progress, provenance=made_by)
    if written.added == written.sources:
        keep_pace(making.pace_kind, time.monotonic() - begun_s, written.segments)
    sheet = write_preview(options.out)
    if options.progress_json:
        print_event("done", **_content(written, sheet))
    elif options.json:
        print_json(_content(written, sheet))
    else:
        _print(written, sheet)
    return 1 if written.failed else 0


def dataset_and_making(options: Export) -> tuple[Exporting, Making]:
    """Content of a data set and the making of its maps; Sd2Error where they do not fit."""
    from sd2core.datasets.options import dataset_options
    from sd2core.datasets.recording_sources import Making
    from sd2core.datasets.simulating import Simulation
    from sd2core.doppler.options import chosen_options
    from sd2core.io.radar import named_radar
    from sd2core.placements.placements import read_placements

    spans = None
    if options.segments == "spans":
        spans = SpanOptions(**picked(options, "margin_s", "shortest_s", "length"))
    wanted = dataset_options(options, spans)
    placements: Any = options.placements
    if placements not in (None, "planned"):
        placements = read_placements(Path(placements))
    making = Making(
        kinds=wanted.kinds,
        synthesis=chosen_options(
            Synthesis(**given(options, ("bins", "v_max_mps", "null_bins", "count")))
        ),
        placements=placements,
        simulation=None if options.simulate is None else Simulation(named_radar(options.simulate)),
        **picked(options, "tolerance", "model", "texture", "limbs", "imu"),
    )
    return wanted, making


def _dry_run(options: Export, sources: list[LazySource], wanted: Exporting, making: Making) -> int:
    from sd2core.datasets.forecast import Counting
    from sd2core.runs.pace import known_pace_s

    with progress_bar("Counting", "source") as progress:
        counting = Counting.of(sources, progress)
    forecast = counting.forecast(wanted, making.synthesis.axis.bins)
    each_s = known_pace_s(making.pace_kind)
    seconds = None if each_s is None else each_s * forecast.segments
    if options.json or options.progress_json:
        content = {
            "dataset": str(options.out),
            **picked(forecast, "sources", "segments"),
            "segments_of_subject": forecast.of_subject,
            "segments_of_label": forecast.of_label,
            "segments_of_kind": forecast.of_kind,
            "segments_of_split": forecast.of_split(),
            **picked(forecast, "frame_rate_hz", "total_bytes"),
            "seconds": seconds,
            "frames_damaged": forecast.frames_damaged,
            "failed": list(forecast.failed),
        }
        if options.json:
            print_json(content)
        else:
            print_event("forecast", **content)
    else:
        facts = {
            "segments": f"{forecast.segments:,} of {counted(forecast.sources, 'source')}",
            "size": f"{bytes_text(forecast.total_bytes)} before compression",
            "kinds": listed(forecast.of_kind),
            "labels": listed(forecast.of_label),
            "splits": listed(forecast.of_split()),
            "frame rate": f"{forecast.frame_rate_hz:g} frames/s",
            "time": "not known before the first source is written"
            if seconds is None
            else f"about {duration(seconds)}, as such maps took here before",
        }
        print_facts(f"{options.out} would hold", facts)
    _complain(forecast.frames_damaged, forecast.failed)
    return 1 if forecast.failed else 0


def _content(written: Written, sheet: Path) -> dict[str, Any]:
    from sd2core.datasets.card import card_paths
    from sd2core.files.texts import read_json

    markdown, as_json, _ = card_paths(written.path)
    return {
        "dataset": str(written.path),
        **picked(written, "segments", "sources", "added"),
        "card": str(markdown),
        "card_json": str(as_json),
        "sheet": str(sheet),
        "frames_damaged": read_json(as_json)["frames_damaged"],
        "failed": [f"{one.key.title}: {one.reason}" for one in written.failed],
    }


def _print(written: Written, sheet: Path) -> None:
    content = _content(written, sheet)
    before = written.sources - written.added
    was = "was" if before == 1 else "were"
    print_facts(
        str(written.path),
        {
            "segments": f"{written.segments:,} of {counted(written.sources, 'source')}"
            + (f", of which {before:,} {was} there already" if before else ""),
            "card": content["card"],
            "sheet": content["sheet"],
        },
    )
    _complain(content["frames_damaged"], content["failed"])


def _complain(frames_damaged: int, failed: tuple[str, ...] | list[str]) -> None:
    tell_lost(frames_damaged)
    for one in failed:
        print(f"sd2: left out {one}", file=sys.stderr)
