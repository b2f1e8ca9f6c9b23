"""``sd2 labels suggest``: candidate spans where something moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sd2core.cli.command_parser import command
from sd2core.cli.labels.reading import check_label_output, print_lost, recording_clock, write
from sd2core.cli.output import counted, picked, print_json, print_rows
from sd2core.cli.recording_maps import MapName, maps_of
from sd2core.errors import Sd2Error
from sd2core.options.records import ARGUMENT
from sd2core.options.shared import Json, Overwrite
from sd2core.options.suggesting import SuggestOptions

if TYPE_CHECKING:
    from sd2core.labels.spans import Span
    from sd2core.maps import DopplerMap
    from sd2core.sensor import VelocityAxis
    from sd2core.timebase import Timebase


class SearchedMap(Overwrite):
    """The map in which spans are looked for, and the file for them.

    Parameters
    ----------
    map : MAP
        a map, a recording, or the .h5 of a K60168A
    of
        which map of a recording (default: synthetic where there is a mesh)
    out : FILE
        the labels to write
    """

    map: Annotated[Path, ARGUMENT]
    of: MapName | None = None
    out: Path | None = None


class Suggest(SearchedMap, SuggestOptions, Json):
    """Options of ``sd2 labels suggest``.

    Parameters
    ----------
    label : LABEL
        label of the spans (default: gesture)
    """

    label: str = "gesture"


@command("suggest", Suggest)
def _suggest(options: Suggest) -> None:
    """Find spans in which something moves.

    Measures the energy of every frame of a Doppler map over the map's own quiet level.
    It finds motion, not gestures: raising an arm is suggested as well. The confidence is 1 less
    the share of the peak's energy that the high threshold is: it ranks spans, it is no
    probability. At least a quarter of the recording must be quiet.

      sd2 labels suggest map.npz
      sd2 labels suggest walk.sd2 --out suggested.json
      sd2 labels suggest walk.sd2 --of radar --out suggested.eaf
      sd2 labels suggest swing.h5 --margin-s 0.1 --out suggested.csv
    """
    from sd2core.labels.suggest import motion_energy_db, suggest_spans

    if options.out is not None:
        check_label_output(options.out)
    doppler, clock = map_and_clock(options)
    spans = suggest_spans(doppler, options, label=options.label)
    energy_db = motion_energy_db(doppler)
    loudest_db = float(max((value for value in energy_db.tolist() if value == value), default=0.0))
    lost = write_spans(options, spans, clock)
    if options.json:
        print_json(
            {
                "map_kind": doppler.kind,
                "loudest_db": loudest_db,
                "options": picked(options, *(one.name for one in fields(SuggestOptions))),
                "spans": spans_data(spans, "confidence", "note"),
                "path": None if options.out is None else str(options.out),
                "not_kept": lost,
            }
        )
        return
    print(
        f"{counted(len(spans), 'span')} in which something moves, in the {doppler.kind} map:"
        f" {options.high_db:g} dB or more over the quiet level somewhere,"
        f" {options.low_db:g} dB throughout"
    )
    if spans:
        rows = [("id", "start s", "end s", "confidence", "why")]
        rows += [(*span_cells(span), f"{span.confidence:.2f}", span.note) for span in spans]
        print_rows(rows, right=(0, 1, 2, 3))
    else:
        print(f"The loudest frame is {loudest_db:.1f} dB over the quiet level.")
    if options.out is not None:
        print(f"Wrote {options.out}")
    print_lost(lost)


def write_spans(options: SearchedMap, spans: tuple[Span, ...], clock: Timebase) -> list[str]:
    """Write spans to the file of ``--out``, where one is named; return what it cannot hold."""
    from sd2core.labels.spans import Labels, LabelTrack
    from sd2core.labels.suggest import TRACK

    if options.out is None:
        return []
    return write(options.out, Labels((LabelTrack(TRACK),), spans), clock)


def spans_data(spans: tuple[Span, ...], *facts: str) -> list[dict[str, Any]]:
    """Number, times and further facts of spans, for JSON."""
    return [picked(span, "id", "start_s", "end_s", *facts) for span in spans]


def span_cells(span: Span) -> tuple[str, str, str]:
    """Number, start and end in seconds, for a table."""
    return str(span.id), f"{span.start_s:.3f}", f"{span.end_s:.3f}"


def map_and_clock(
    options: SearchedMap, axis: VelocityAxis | None = None, learnt: Sequence[str] = ()
) -> tuple[DopplerMap, Timebase]:
    """Read the map of ``options.map`` and ``options.of``, and the frame times of its labels.

    A recording's capture becomes a map on the velocity axis given, or on its own. Where nothing is
    chosen, it is a map of a kind that was ``learnt`` from.
    """
    from sd2core.io.kinds import kind_of
    from sd2core.io.radar import holds_map, load_recorded_map
    from sd2core.maps import DopplerMap
    from sd2core.recording.recording import open_recording

    path = options.map
    kind = kind_of(path)
    if kind == "recording":
        recording = open_recording(path)
        known = {"radar" if kind in ("simulated", "real") else kind for kind in learnt}
        there: list[MapName] = [] if recording.mesh is None else ["synthetic", "denoised"]
        if recording.radar is not None or not there:
            there.append("radar")
        usual = next((one for one in there if one in known), there[0])
        name = options.of or usual
        return maps_of(recording, (name,), axis=axis)[name], recording_clock(recording)
    if options.of is not None:
        raise Sd2Error(f"--of is given, and {path} is no recording", "--of for a recording only")
    if kind == "map":
        doppler = DopplerMap.load(path)
    elif holds_map(path):
        doppler = load_recorded_map(path).doppler
    else:
        raise Sd2Error(
            f"{path} is a {kind}",
            "a Doppler map, a recording, or the .h5 of a K60168A",
            "Make a map of it first with `sd2 synth` or `sd2 radar`",
        )
    return doppler, doppler.timebase
