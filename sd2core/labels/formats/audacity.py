"""Label files of Audacity: start, end and text, separated by tabs.

Source: Audacity manual, "Importing and exporting labels". A line that begins with a backslash
holds the frequencies of a spectral selection and belongs to the label above it.
"""

from __future__ import annotations

from pathlib import Path

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.texts import read_text
from sd2core.labels.formats.losses import LabelFormat, Loss
from sd2core.labels.formats.numbers import finite_number, positional
from sd2core.labels.formats.rows import UNNAMED, LabelRows, Row
from sd2core.labels.spans import Labels

FORMAT = LabelFormat(
    name="audacity",
    title="Audacity",
    suffixes=(".txt",),
    made_for="Audacity 2 and 3, labels of one label track",
    keeps=frozenset(),
    remark="Frequencies of spectral labels are ignored.",
)

_EXPECTED = "an Audacity label file: start, end and text in each line, separated by tabs"


def write(path: Path, labels: Labels, *_: object) -> list[Loss]:
    """Write all tracks as one label track; what is lost depends on the format alone."""
    lines = [
        f"{positional(span.start_s, min_digits=6)}\t{positional(span.end_s, min_digits=6)}"
        f"\t{span.label}\n"
        for span in labels.spans
    ]
    atomic_write_text(path, "".join(lines))
    return []


def read(path: Path, *_: object) -> LabelRows:
    """Read labels; a point label is a mark without a duration.

    Raises Sd2Error naming the line that is no label.
    """
    result = LabelRows()
    for number, line in enumerate(read_text(path, _EXPECTED).split("\n"), start=1):
        line = line.removesuffix("\r")
        if not line.strip() or line.startswith("\\"):
            continue
        cells = line.split("\t", 2)
        if len(cells) < 2:
            raise Sd2Error(f"{path}, line {number} is {line[:100]!r}", _EXPECTED)
        with result.entry(f"line {number}"):
            start_s, end_s = map(_seconds, cells[:2])
            text = cells[2] if len(cells) > 2 else ""
            result.rows.append(Row(f"line {number}", start_s, end_s, text or UNNAMED))
    return result


def _seconds(text: str) -> float:
    # Some locales of older versions export decimal commas; tabs separate, so they are plain.
    value = finite_number(text.replace(",", "."))
    if value is None:
        raise Sd2Error(f"a time is {text[:50]!r}", _EXPECTED)
    return value
