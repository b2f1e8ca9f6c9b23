"""Labels as lines: start, end, name."""

from pathlib import Path

from sd2core.labels.formats import LabelFormat, LabelProgram, Loss
from sd2core.labels.formats.rows import LabelRows, Row
from sd2core.labels.spans import Labels
from sd2core.timebase import Timebase

SD2_PLUGIN_API = 1


def read(path: Path, timebase: Timebase | None, observation: str | None) -> LabelRows:
    lines = [line.split() for line in path.read_text().splitlines()]
    rows = [Row(line[2], float(line[0]), float(line[1]), line[2]) for line in lines]
    return LabelRows(rows)


def write(path: Path, labels: Labels, timebase: Timebase, media: Path | None) -> list[Loss]:
    path.write_text("".join(f"{s.start_s} {s.end_s} {s.label}\n" for s in labels.spans))
    return []


ABOUT = LabelFormat("tea-labels", "Tea", (".tealabels",), "a tea house", frozenset())
PROGRAM = LabelProgram(ABOUT, read, write)
