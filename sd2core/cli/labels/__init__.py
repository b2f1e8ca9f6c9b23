"""``sd2 labels``: show, count, convert, suggest, compare, draw and cut out labelled spans."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sd2core.cli.command_parser import Subcommands, add_command, add_declared, command_group
from sd2core.cli.labels.reading import (
    LabelFile,
    check_label_output,
    media_of,
    print_lost,
    read_named,
    write,
)
from sd2core.cli.output import counted, print_json, print_rows
from sd2core.options.records import Place
from sd2core.options.shared import Json, Overwrite

if TYPE_CHECKING:
    from sd2core.labels.spans import Labels
    from sd2core.labels.statistics import LabelStatistics
    from sd2core.timebase import Timebase


class Show(LabelFile, Json):
    """Options of ``sd2 labels show``."""


class Convert(LabelFile, Overwrite, Json):
    """Options of ``sd2 labels convert``.

    Parameters
    ----------
    out : FILE
        the file to write
    to : NAME
        the format of --out, by a name as of --format; subtitles and label-studio are only read
    """

    out: Path
    to: str | None = None


class Statistics(LabelFile, Json):
    """Options of ``sd2 labels statistics``.

    Parameters
    ----------
    csv
        print comma-separated values
    """

    csv: Annotated[bool, Place(one_of="form")] = False
    json: Annotated[bool, Place(one_of="form")] = False


@command_group("labels")
def _commands(kinds: Subcommands) -> None:
    """Show, count, convert, suggest, compare, draw and cut out labelled spans.

    sd2 labels show walk.sd2
    sd2 labels statistics walk.sd2 --csv
    sd2 labels convert walk.sd2 --out walk.eaf
    sd2 labels suggest walk.sd2 --out suggested.json
    sd2 labels agree anna.json ben.json --video walk.mp4
    sd2 labels figure walk.sd2 --out walk.pdf
    sd2 labels cut walk.sd2 --out cuts
    """
    add_command(kinds, "show", options=Show, handler=_show)
    add_command(kinds, "convert", options=Convert, handler=_convert)
    add_command(kinds, "statistics", options=Statistics, handler=_statistics)
    modules = {
        "set": "label_set",
        "suggest": "suggest",
        "figure": "recording",
        "cut": "recording",
        "agree": "agree",
        "recover": "recover",
    }
    add_declared(kinds, {name: f"labels.{module}" for name, module in modules.items()})


def _show(options: Show) -> None:
    """Print labels with their number and durations.

    FILE is a labels.json, a recording, the .h5 of a K60168A, or a file of ELAN, Praat,
    BORIS, Audacity, MNE-Python, Label Studio, subtitles or a table (.csv, .tsv). With
    frame times the frames of each span are printed as well: the first and the last one.

      sd2 labels show walk.sd2
      sd2 labels show walk.eaf --video walk.mp4 --json
    """
    labels, clock = read_named(options)
    if options.json:
        print_json(_described(labels, clock))
        return
    if not labels.spans:
        print(f"{options.file} holds no spans.")
        return
    persons = any(span.person for span in labels.spans)
    who = ("person",) if persons else ()
    rows = [("id", "start s", "end s", "frames", "label", *who, "track", "note")]
    for span in labels.spans:
        frames = span.frames(clock)
        rows.append(
            (
                str(span.id),
                f"{span.start_s:.3f}",
                f"{span.end_s:.3f}",
                "" if frames is None else frames.words(),
                span.label,
                *((span.person,) if persons else ()),
                span.track,
                " ".join(span.note.split()),
            )
        )
    print_rows(rows, right=(0, 1, 2))
    print()
    _print_statistics(labels, clock)


def _convert(options: Convert) -> None:
    """Write labels as another program reads them.

    The suffix of --out says which program: .json for SD² Studio, .csv, .tsv, .eaf,
    .TextGrid, .boris; a .txt needs --to. Prints what the file could not hold.

      sd2 labels convert walk.sd2 --out walk.eaf
      sd2 labels convert labels.json --out labels.txt --to audacity --fps 30
      sd2 labels convert walk.eaf --out labels.json
    """
    digest = check_label_output(options.out)
    labels, clock = read_named(options)
    media = media_of(options, options.file)
    lost = write(options.out, labels, clock, options.to, media=media, over=digest)
    if options.json:
        print_json({"path": str(options.out), "spans": len(labels.spans), "not_kept": lost})
        return
    print(f"Wrote {options.out} with {counted(len(labels.spans), 'span')}")
    print_lost(lost)


def _described(labels: Labels, clock: Timebase | None) -> dict[str, Any]:
    return {
        "tracks": [{"name": track.name, "overlap": track.overlap} for track in labels.tracks],
        "spans": [
            asdict(span) | {"frames": frames and asdict(frames)}
            for span in labels.spans
            for frames in [span.frames(clock)]
        ],
        "labels": _statistics_of(labels, clock),
    }


def _statistics(options: Statistics) -> None:
    """Count the spans of every label and print their durations.

    Durations per label, and with frame times the share of the recording that its spans
    cover; overlapping spans count once.

      sd2 labels statistics walk.sd2
      sd2 labels statistics walk.eaf --video walk.mp4 --csv
    """
    from sd2core.labels.statistics import statistics_rows, statistics_text

    labels, clock = read_named(options)
    if options.json:
        print_json({"labels": _statistics_of(labels, clock)})
    elif options.csv:
        print(statistics_text(statistics_rows(_in_use(labels, clock))), end="")
    else:
        _print_statistics(labels, clock)


def _print_statistics(labels: Labels, clock: Timebase | None) -> None:
    from sd2core.labels.statistics import HEADINGS, statistics_rows

    rows = [HEADINGS, *statistics_rows(_in_use(labels, clock))]
    print_rows(rows, right=range(1, len(HEADINGS)))


def _statistics_of(labels: Labels, clock: Timebase | None) -> dict[str, dict[str, Any]]:
    described = {one.label: asdict(one) for one in _in_use(labels, clock)}
    for one in described.values():
        del one["label"]
    return described


def _in_use(labels: Labels, clock: Timebase | None) -> list[LabelStatistics]:
    """Statistics of the labels in use: files of other programs bring no set of their own."""
    from sd2core.labels.statistics import label_statistics

    extent_s = None if clock is None else (clock.start_s, clock.end_s)
    return [one for one in label_statistics(labels, extent_s) if one.count]
