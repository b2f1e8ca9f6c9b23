"""``sd2 labels statistics``: how many spans each label has, and how long they are."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sd2core.cli.labels.reading import add_clock, add_reading, clock_of, labels_at, with_rate
from sd2core.cli.options import add_command, add_json
from sd2core.cli.output import print_json, print_rows

if TYPE_CHECKING:
    from sd2core.labels.spans import Labels
    from sd2core.labels.statistics import LabelStatistics
    from sd2core.timebase import Timebase


def add_statistics(kinds: argparse._SubParsersAction) -> None:
    """Add ``statistics``."""
    parser = add_command(
        kinds,
        "statistics",
        "count the spans of every label, and say how long they are",
        handler=_statistics,
        description=(
            "Durations per label, and with frame times the share of the recording that its spans\n"
            "hold, where an instant counts once however many spans hold it."
        ),
        examples=(
            "  sd2 labels statistics walk.sd2\n"
            "  sd2 labels statistics walk.eaf --video walk.mp4 --csv"
        ),
    )
    parser.add_argument("file", type=Path, metavar="FILE", help="the file with labels")
    add_reading(parser, "FILE")
    add_clock(parser)
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--csv", action="store_true", help="print comma-separated values")
    add_json(form)


def _statistics(options: argparse.Namespace) -> None:
    from sd2core.labels.statistics import statistics_rows, statistics_text

    clock = clock_of(options, options.file)
    labels = labels_at(options.file, clock, options.format, options.observation)
    clock = with_rate(options, clock, labels)
    if options.json:
        print_json({"labels": statistics_of(labels, clock)})
    elif options.csv:
        print(statistics_text(statistics_rows(_found(labels, clock))), end="")
    else:
        print_statistics(labels, clock)


def print_statistics(labels: Labels, clock: Timebase | None) -> None:
    """Print the table."""
    from sd2core.labels.statistics import HEADINGS, statistics_rows

    rows = [HEADINGS, *statistics_rows(_found(labels, clock))]
    print_rows(rows, right=range(1, len(HEADINGS)))


def statistics_of(labels: Labels, clock: Timebase | None) -> dict[str, dict[str, Any]]:
    """Statistics for programs."""
    described = {one.label: asdict(one) for one in _found(labels, clock)}
    for one in described.values():
        del one["label"]
    return described


def _found(labels: Labels, clock: Timebase | None) -> list[LabelStatistics]:
    """Of the labels that some span has: a file of another program brings no set of its own."""
    from sd2core.labels.statistics import label_statistics

    extent_s = None if clock is None else (clock.start_s, clock.end_s)
    return [one for one in label_statistics(labels, extent_s) if one.count]
