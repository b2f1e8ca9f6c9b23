"""``sd2 labels``: show, count, convert, suggest, compare, draw and cut out labelled spans."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sd2core.cli.labels.agree import add_agree
from sd2core.cli.labels.cut import add_cut
from sd2core.cli.labels.figure import add_figure
from sd2core.cli.labels.label_set import add_set
from sd2core.cli.labels.reading import (
    add_clock,
    add_reading,
    add_replace,
    check_label_output,
    clock_of,
    labels_at,
    with_rate,
    write,
)
from sd2core.cli.labels.recover import add_recover
from sd2core.cli.labels.statistics import add_statistics, print_statistics, statistics_of
from sd2core.cli.labels.suggest import add_suggest
from sd2core.cli.options import add_command, add_json
from sd2core.cli.output import counted, print_json, print_rows

if TYPE_CHECKING:
    from sd2core.labels.spans import Labels
    from sd2core.timebase import Timebase


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``labels`` with what it does."""
    parser = add_command(
        commands,
        "labels",
        "show, count, convert, suggest, compare, draw and cut out labelled spans",
        examples=(
            "  sd2 labels show walk.sd2\n"
            "  sd2 labels statistics walk.sd2 --csv\n"
            "  sd2 labels convert walk.sd2 walk.eaf\n"
            "  sd2 labels suggest walk.sd2 --out suggested.json\n"
            "  sd2 labels agree anna.json ben.json --video walk.mp4\n"
            "  sd2 labels figure walk.sd2 --out walk.pdf\n"
            "  sd2 labels cut walk.sd2 --out cuts"
        ),
    )
    kinds = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    show = add_command(
        kinds,
        "show",
        "print labels, and how many and how long they are",
        handler=_show,
        description=(
            "FILE is a labels.json, a recording, the .h5 of a K60168A, or a file of ELAN, Praat,\n"
            "BORIS, Audacity, MNE-Python or a table (.csv, .tsv). With frame times the frames of\n"
            "each span are printed as well: half-open, the second is the first one after it."
        ),
        examples="  sd2 labels show walk.sd2\n  sd2 labels show walk.eaf --video walk.mp4 --json",
    )
    show.add_argument("file", type=Path, metavar="FILE", help="the file with labels")
    add_reading(show, "FILE")
    add_clock(show)
    add_json(show)

    convert = add_command(
        kinds,
        "convert",
        "write labels as another program reads them",
        handler=_convert,
        description=(
            "The suffix of OUT says which program: .json for SD² Studio, .csv, .tsv, .eaf,\n"
            ".TextGrid, .boris; a .txt needs --to. Prints what the file could not hold."
        ),
        examples=(
            "  sd2 labels convert walk.sd2 walk.eaf\n"
            "  sd2 labels convert labels.json labels.txt --to audacity --rate 30\n"
            "  sd2 labels convert walk.eaf labels.json"
        ),
    )
    convert.add_argument("file", type=Path, metavar="IN", help="the file with labels")
    convert.add_argument("out", type=Path, metavar="OUT", help="the file to write")
    add_reading(convert, "IN")
    convert.add_argument("--to", metavar="NAME", help="the format of OUT, likewise")
    add_replace(convert)
    add_clock(convert)
    add_json(convert)

    add_statistics(kinds)
    add_set(kinds)
    add_suggest(kinds)
    add_figure(kinds)
    add_cut(kinds)
    add_agree(kinds)
    add_recover(kinds)


def _show(options: argparse.Namespace) -> None:
    clock = clock_of(options, options.file)
    labels = labels_at(options.file, clock, options.format, options.observation)
    clock = with_rate(options, clock, labels)
    if options.json:
        print_json(described(labels, clock))
        return
    if not labels.spans:
        print(f"{options.file} holds no spans.")
        return
    rows = [("id", "start s", "end s", "frames", "label", "track", "note")]
    for span in labels.spans:
        first, stop = (0, 0) if clock is None else clock.frames_between(span.start_s, span.end_s)
        rows.append(
            (
                str(span.id),
                f"{span.start_s:.3f}",
                f"{span.end_s:.3f}",
                f"{first}–{stop}" if stop > first else "",
                span.label,
                span.track,
                " ".join(span.note.split()),
            )
        )
    print_rows(rows, right=(0, 1, 2))
    print()
    print_statistics(labels, clock)


def _convert(options: argparse.Namespace) -> None:
    check_label_output(options.out, replace=options.replace)
    clock = clock_of(options, options.file)
    labels = labels_at(options.file, clock, options.format, options.observation)
    lost = write(options.out, labels, with_rate(options, clock, labels), options.to)
    if options.json:
        print_json({"path": str(options.out), "spans": len(labels.spans), "not_kept": lost})
        return
    print(f"Wrote {options.out} with {counted(len(labels.spans), 'span')}")
    for sentence in lost:
        print(f"  not kept: {sentence}")


def described(labels: Labels, clock: Timebase | None) -> dict[str, Any]:
    """Labels for programs."""
    return {
        "tracks": [{"name": track.name, "overlap": track.overlap} for track in labels.tracks],
        "spans": [
            {
                "id": span.id,
                "track": span.track,
                "start_s": span.start_s,
                "end_s": span.end_s,
                "frames": None
                if clock is None
                else list(clock.frames_between(span.start_s, span.end_s)),
                "label": span.label,
                "note": span.note,
                "author": span.author,
                "confidence": span.confidence,
                "origin": span.origin,
            }
            for span in labels.spans
        ],
        "labels": statistics_of(labels, clock),
    }
