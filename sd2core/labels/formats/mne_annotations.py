"""Annotations of MNE-Python in text form: onset, duration, description and further columns.

Source: ``mne.Annotations.save`` and ``mne.read_annotations``. The file has neither quotation marks
nor escapes, and with NumPy 2 MNE reads only ASCII from it. Texts are therefore percent-encoded
(RFC 3986) where they hold anything else; a line of the heading says so, and they come back.
"""

from __future__ import annotations

import math
import re
from functools import partial
from pathlib import Path
from urllib.parse import quote, unquote

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.tables import counted
from sd2core.files.texts import read_text
from sd2core.labels.formats.losses import ASPECTS, LabelFormat, Loss
from sd2core.labels.formats.numbers import finite_number, positional
from sd2core.labels.formats.rows import LabelRows, Row
from sd2core.labels.spans import Labels, Span

FORMAT = LabelFormat(
    name="mne",
    title="MNE",
    suffixes=(".txt",),
    made_for="MNE-Python 1.11 and later, text annotations",
    keeps=frozenset(ASPECTS) - {"empty tracks", "label set", "colours and keys"},
    resolution_s=1e-9,
    remark="Texts that are not plain ASCII are percent-encoded.",
)

_EXPECTED = "MNE annotations: onset, duration and description in each line, separated by commas"
_ENCODED = "# texts: percent-encoded"
_PLAIN = " !$&'()*+-./:;<=>?@[]^_{|}~"
_BASIC = ("onset", "duration", "description")
_EXTRAS = ("track", "overlap", "id", "note", "author", "confidence", "origin", "person")


def write(path: Path, labels: Labels, *_: object) -> list[Loss]:
    """Write annotations with extra columns; what they cannot hold is returned."""
    overlap = {track.name: track.overlap for track in labels.tracks}
    lines = ["# MNE-Annotations", _ENCODED, f"# {', '.join((*_BASIC, *_EXTRAS))}"]
    # Track by track, so that their order comes back; MNE sorts by onset.
    for span in (span for track in labels.tracks for span in labels.of_track(track.name)):
        known = "" if span.confidence is None else positional(float(span.confidence))
        edges = (positional(span.start_s), positional(_duration_s(span)))
        texts = (
            *(span.label, span.track, overlap[span.track], str(span.id)),
            *(span.note, span.author, known, span.origin, span.person),
        )
        lines.append(",".join((*edges, *map(_encoded, texts))))
    atomic_write_text(path, "\n".join(lines) + "\n")
    return _changed(labels)


def read(path: Path, *_: object) -> LabelRows:
    """Read annotations; those without a duration are marks.

    Raises Sd2Error naming the line that is no annotation.
    """
    lines = [line.removesuffix("\r") for line in read_text(path, _EXPECTED).split("\n")]
    heading = [line for line in lines if line.startswith("#")]
    # Lone surrogates are decoded as well.
    decode = partial(unquote, errors="surrogatepass") if _ENCODED in heading else str
    columns = _columns(path, heading)
    result = LabelRows()
    for number, line in enumerate(lines, start=1):
        if line.startswith("#") or not line.strip():
            continue
        cells = line.split(",")
        if columns is None:
            columns = [*_BASIC, "ch_names"][: max(len(cells), 3)]
        with result.entry(f"line {number}"):
            if len(cells) != len(columns):
                raise Sd2Error(
                    f"line {number} has {len(cells)} columns: {line[:100]!r}",
                    f"the {len(columns)} columns {', '.join(columns)}",
                    "Descriptions cannot hold commas: mend that line",
                )
            cell = {name: decode(text) for name, text in zip(columns, cells, strict=True)}
            start_s = _number("onset", cell["onset"])
            end_s = start_s + _number("duration", cell["duration"])
            known = cell.get("confidence", "").strip()
            confidence = _number("confidence", known) if known else None
            row = Row(f"line {number}", start_s, end_s, cell["description"], confidence=confidence)
            result.add_line(row, cell)
    return result


def _columns(path: Path, heading: list[str]) -> list[str] | None:
    for line in heading:
        names = [name.strip() for name in line[1:].split(",")]
        if set(_BASIC) <= set(names):
            return names
    if heading and not any("MNE-Annotations" in line for line in heading):
        raise Sd2Error(f"{path} begins with {heading[0][:100]!r}", _EXPECTED)
    return None


def _duration_s(span: Span) -> float:
    """Duration that leads to the end within rounding, and never past it into the next span."""
    duration_s = span.end_s - span.start_s
    while span.start_s + duration_s > span.end_s:
        duration_s = math.nextafter(duration_s, 0.0)
    return duration_s


def _encoded(text: str) -> str:
    encoded = quote(text, safe=_PLAIN, errors="surrogatepass")
    # Spaces at the edges, which readers strip.
    return re.sub(r"^ +| +$", lambda spaces: "%20" * len(spaces[0]), encoded)


def _changed(labels: Labels) -> list[Loss]:
    losses: list[Loss] = []
    count = sum(
        any(
            _encoded(text) != text
            for text in (span.label, span.track, span.note, span.author, span.person)
        )
        for span in labels.spans
    )
    if count:
        words = (
            f"MNE's text files hold plain ASCII without commas: texts of {counted(count, 'span')}"
        )
        losses.append(Loss("characters", count, f"{words} are percent-encoded there"))
    off_s = [abs(span.start_s + _duration_s(span) - span.end_s) for span in labels.spans]
    moved = [off for off in off_s if off > FORMAT.resolution_s]
    if moved:
        words = f"MNE keeps durations: ends of {counted(len(moved), 'span')} moved by "
        losses.append(Loss("times", len(moved), words + f"up to {max(moved):.1g} s"))
    return losses


def _number(column: str, text: str) -> float:
    value = finite_number(text)
    if value is None:
        expected = "a finite number; of times, seconds since the first sample"
        raise Sd2Error(f"{column} is {text[:50]!r}", expected)
    return value
