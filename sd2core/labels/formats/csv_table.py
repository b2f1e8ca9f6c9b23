"""CSV: one row per span, in seconds and in frames.

RFC 4180, in UTF-8 without a byte order mark, with these columns::

    id,track,overlap,label,start_s,end_s,first_frame,last_frame,frames,note,author,confidence,origin,person

In a ``.tsv`` tabs stand between them.
``first_frame`` is the frame shown at ``start_s``, counted from 0, ``last_frame`` the last one of
the span, and ``frames`` their number; a span outside the video has none. Seconds are exact, and
are what counts when a file has both. ``end_frame``, in tables of before, is the first one after
the span. A text that a spreadsheet would compute, such as ``=1+1``, has an apostrophe in front,
which is taken off again when it is read.

Tables of other programs are read by the names of their columns, whatever separates them.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import astuple
from pathlib import Path

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.tables import as_cell, of_cell
from sd2core.files.texts import read_text
from sd2core.labels.formats.losses import ASPECTS, LabelFormat, Loss, hold_texts
from sd2core.labels.formats.numbers import finite_number, whole_number
from sd2core.labels.formats.rows import UNNAMED, LabelRows, Row, chosen_observation
from sd2core.labels.spans import Labels
from sd2core.labels.typed_times import seconds_of
from sd2core.plausibility.clock import UNITS_S
from sd2core.timebase import Timebase

FORMAT = LabelFormat(
    name="csv",
    title="CSV",
    suffixes=(".csv", ".tsv"),
    made_for="spreadsheets, pandas, R",
    keeps=frozenset(ASPECTS) - {"empty tracks", "label set", "colours and keys"},
    remark="Seconds, and the first frame, the last one and their number. A text that a spreadsheet"
    " would compute, such as =1+1, has an apostrophe in front; reading takes it off again.",
)

COLUMNS = (
    "id", "track", "overlap", "label", "start_s", "end_s", "first_frame", "last_frame", "frames",
    "note", "author", "confidence", "origin", "person",
)  # fmt: skip

# What other programs call them, the surest name first: ELAN and Audacity, BORIS' aggregated
# events, BIDS, MNE, pandas. Spaces, dots and brackets of a heading count as one underscore.
_NAMES = {
    "id": ("id",),
    "track": ("track", "tier", "subject"),
    "overlap": ("overlap",),
    "label": ("label", "gesture", "behavior", "behaviour", "description", "annotation",
              "trial_type", "class", "text"),
    "start_s": ("start_s", "start_time_s", "start_time", "start", "onset_s", "onset", "begin_s",
                "begin", "begin_time_ss_msec", "begin_time", "tmin", "time_s", "time"),
    "end_s": ("end_s", "end_time_s", "end_time", "end", "stop_s", "stop", "offset_s", "offset",
              "end_time_ss_msec", "tmax"),
    "duration_s": ("duration_s", "duration", "duration_ss_msec"),
    "start_frame": ("first_frame", "start_frame"),
    "end_frame": ("end_frame",),
    "last_frame": ("last_frame",),
    "note": ("note", "notes", "comment", "comments", "comment_start"),
    "author": ("author", "annotator", "coder"),
    "confidence": ("confidence",),
    "origin": ("origin",),
    "person": ("person",),
    "observation": ("observation_id",),
}  # fmt: skip

_TIMES = ("start_s", "end_s", "duration_s")

_SEPARATOR_TOLD = re.compile(r"\A\s*sep=.\r?\n", re.IGNORECASE)
"""First line by which spreadsheets are told what separates the columns."""
_BANNED = re.compile("[\0\ud800-\udfff]")
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?")
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
_EXPECTED = "a table with a heading that names label, start_s and end_s"


def write(path: Path, labels: Labels, timebase: Timebase, *_: object) -> list[Loss]:
    """Write a table; what it cannot hold is returned."""
    held, replaced = hold_texts(labels, _BANNED, FORMAT.title)
    text = io.StringIO(newline="")
    # Texts in quotes keep the spaces around them, whoever reads them.
    mark = "\t" if path.suffix.lower() == ".tsv" else ","
    writer = csv.writer(text, delimiter=mark, quoting=csv.QUOTE_NONNUMERIC, lineterminator="\n")
    text.write(mark.join(COLUMNS) + "\n")
    # Track by track, so that their order comes back.
    by_track = ((track, span) for track in held.tracks for span in held.of_track(track.name))
    for track, span in by_track:
        shown = span.frames(timebase)
        frames = ("", "", 0) if shown is None else astuple(shown)
        known = span.confidence
        writer.writerow(
            (
                *(span.id, as_cell(span.track), track.overlap, as_cell(span.label)),
                *(float(span.start_s), float(span.end_s), *frames),
                *(as_cell(span.note), as_cell(span.author)),
                *("" if known is None else float(known), span.origin, as_cell(span.person)),
            )
        )
    atomic_write_text(path, text.getvalue())
    return replaced


def read(path: Path, _: Timebase | None, observation: str | None) -> LabelRows:
    """Read a table, of this program or another.

    Separators may be commas, semicolons, tabs or bars; decimal points may be commas where these do
    not separate; times may be hours, minutes and seconds. Raises Sd2Error when columns are missing
    or it is not certain what a number means.
    """
    text = _SEPARATOR_TOLD.sub("\n", read_text(path, _EXPECTED))
    separator = _separator(path, text)
    heading, lines = _table(path, text, separator)
    where = _columns(path, heading)
    result = LabelRows()
    whole: list[tuple[int, list[str]]] = []
    for line, cells in lines:
        with result.entry(f"line {line}"):
            _check_width(line, cells, heading, separator)
            whole.append((line, cells))
    column = where.get("observation")
    if column is not None and (whole or observation is not None):
        names = sorted({cells[column] for _, cells in whole})
        name = chosen_observation(names, observation)
        whole = [(line, cells) for line, cells in whole if cells[column] == name]
    units_s = {column: _named(heading[where[column]])[1] for column in _TIMES if column in where}
    numbers = _Numbers(path, whole, where, units_s)
    if not where.keys() & {"end_s", "duration_s", "start_frame"}:
        result.remarks.append(f"marks, as no column of ends is known ({', '.join(heading)[:200]})")
    for line, cells in whole:
        with result.entry(f"line {line}"):
            cell = {name: of_cell(cells[index]) for name, index in where.items()}
            start_s, end_s, frames = _times(numbers, cell)
            known = cell.get("confidence")
            confidence = numbers.of("confidence", known) if known else None
            label = cell["label"] or UNNAMED
            row = Row(f"line {line}", start_s, end_s, label, confidence=confidence, frames=frames)
            result.add_line(row, cell)
    return result


def _table(path: Path, text: str, separator: str) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Heading and rows, each with the number of its first line."""
    reader = csv.reader(
        io.StringIO(text, newline=""), delimiter=separator, skipinitialspace=True, strict=True
    )
    rows: list[tuple[int, list[str]]] = []
    start = 1
    try:
        for cells in reader:
            if any(cell.strip() for cell in cells):
                rows.append((start, cells))
            start = reader.line_num + 1
    except csv.Error as error:
        raise Sd2Error(
            f"{path}, line {start}: {error}", "rows whose quotation marks are closed", "Mend it"
        ) from None
    return rows[0][1], rows[1:]


def _separator(path: Path, text: str) -> str:
    """Separator of the columns: the one by which the heading names all that is needed."""
    csv.field_size_limit(max(csv.field_size_limit(), len(text)))
    first = next(line for line in text.splitlines() if line.strip())
    fitting = [mark for mark in ",;\t|" if _spoken_for(next(csv.reader([first], delimiter=mark)))]
    if not fitting:
        raise Sd2Error(f"The first line of {path} is {first[:100]!r}", _EXPECTED, _remedy(first))
    if len(fitting) > 1:
        raise Sd2Error(
            f"The first line of {path} is {first[:100]!r}, a heading with {fitting[0]!r} and with "
            f"{fitting[1]!r} between the columns",
            "one kind of separator",
            "Save the table with commas",
        )
    return fitting[0]


def _check_width(line: int, cells: Sequence[str], heading: Sequence[str], separator: str) -> None:
    if len(cells) == len(heading):
        return
    hint = "Mend that line, or export the table again"
    if len(cells) > len(heading) and separator == ",":
        hint = "Decimal commas in a table separated by commas? Save it with semicolons"
    raise Sd2Error(
        f"line {line} has {len(cells)} columns, its heading {len(heading)}",
        "as many as the heading",
        hint,
    )


def _spoken_for(heading: Sequence[str]) -> bool:
    names = {_named(one)[0] for one in heading}

    def has(column: str) -> bool:
        return any(name in names for name in _NAMES[column])

    frames = has("start_frame") and (has("end_frame") or has("last_frame"))
    spans = has("start_s") and (has("end_s") or has("duration_s"))
    # Of marks; not BORIS' events, which have a row for a start and one for its stop.
    marks = has("start_s") and "behavior_type" not in names
    return has("label") and (spans or frames or marks)


def _remedy(first: str) -> str:
    if "behavior type" in first.casefold():
        return "In BORIS, export aggregated events: they have a start and a stop in one row"
    return f"Give it a heading such as {','.join(COLUMNS[3:6])}"


def _plain(heading: str) -> str:
    plain = re.sub(r"[^\w]+", "_", heading.strip().casefold()).strip("_")
    return re.sub(r"_hh_mm_ss(_ms|_msec)?$", "", plain)


def _named(heading: str) -> tuple[str, float]:
    """Plain name of a column, and its unit in seconds where it names another one."""
    plain = _plain(heading)
    if not any(plain in names for names in _NAMES.values()):
        name, _, unit = plain.rpartition("_")
        if unit in UNITS_S and any(name in _NAMES[column] for column in _TIMES):
            return name, UNITS_S[unit]
    return plain, 1.0


def _columns(path: Path, heading: Sequence[str]) -> dict[str, int]:
    plain = [_named(one)[0] for one in heading]
    twice = sorted({name for name in plain if name and plain.count(name) > 1})
    if any(name in names for name in twice for names in _NAMES.values()):
        raise Sd2Error(f"{path} has two columns {twice[0]!r}", "columns of different names")
    columns: dict[str, int] = {}
    for column, names in _NAMES.items():
        index = next((plain.index(name) for name in names if name in plain), None)
        if index is not None:
            columns[column] = index
    return columns


class _Numbers:
    """Numbers of one table, which agree on what a comma means."""

    def __init__(
        self,
        path: Path,
        lines: Sequence[tuple[int, list[str]]],
        where: dict[str, int],
        units_s: dict[str, float],
    ) -> None:
        self._units_s = units_s
        columns = [where[one] for one in _TIMES if one in where]
        texts = [cells[column].strip() for _, cells in lines for column in columns]
        texts = [text for text in texts if _NUMBER.fullmatch(text) or _GROUPED.fullmatch(text)]
        commas = [text for text in texts if "," in text]
        points = [text for text in texts if "." in text]
        if commas and points:
            raise Sd2Error(
                f"{path} writes {commas[0]!r} as well as {points[0]!r}",
                "one kind of decimal point",
                "Save it again with decimal points",
            )
        if commas and all(_GROUPED.fullmatch(text) for text in commas):
            raise Sd2Error(
                f"{path} writes {commas[0]!r}: thousands or a decimal comma?",
                "numbers that can be read in one way only",
                "Save it again with decimal points",
            )

    def of(self, column: str, text: str) -> float:
        """The number in a cell, of a time also in hours, minutes and seconds."""
        if ":" in text and column.endswith("_s"):
            value, unit, expected = seconds_of(text), 1.0, "seconds, or hours:minutes:seconds"
        else:
            plain = _NUMBER.fullmatch(text.strip())
            value = finite_number(plain[0].replace(",", ".")) if plain else None
            unit, expected = self._units_s.get(column, 1.0), "a finite number"
        if value is None:
            raise Sd2Error(f"{column} is {text[:50]!r}", expected)
        return value * unit


def _times(numbers: _Numbers, cell: dict[str, str]) -> tuple[float, float, tuple[int, int] | None]:
    """Start and end in seconds, or the frames that stand for them."""
    if "start_s" in cell and ({"end_s", "duration_s"} & cell.keys() or "start_frame" not in cell):
        start_s = numbers.of("start_s", cell["start_s"])
        if "end_s" in cell:
            return start_s, numbers.of("end_s", cell["end_s"]), None
        if "duration_s" in cell:
            return start_s, start_s + numbers.of("duration_s", cell["duration_s"]), None
        return start_s, start_s, None  # a mark
    first = _frame("start_frame", cell)
    in_half_open = "end_frame" in cell
    end = _frame("end_frame", cell) if in_half_open else _frame("last_frame", cell) + 1
    return 0.0, 0.0, (first, end)


def _frame(column: str, cell: dict[str, str]) -> int:
    number = whole_number(cell[column].strip().removesuffix(".0"))  # pandas', where some miss
    if number is None:
        raise Sd2Error(f"{column} is {cell[column][:50]!r}", "a whole number from 0")
    return number
