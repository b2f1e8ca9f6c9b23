"""TextGrid files of Praat.

Source: Praat manual, "TextGrid file formats". Written in the long form; the long and the short
form are read, with interval and point tiers. Reading follows Praat's own rule: quoted texts,
numbers and flags that stand free count, all other words only explain.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.texts import read_text
from sd2core.labels.formats.lanes import Lane, edges_s, lanes_of, track_of
from sd2core.labels.formats.losses import LabelFormat, Loss
from sd2core.labels.formats.numbers import finite_number, positional, whole_number
from sd2core.labels.formats.rows import LabelRows, Row
from sd2core.labels.spans import Labels
from sd2core.timebase import Timebase

FORMAT = LabelFormat(
    name="textgrid",
    title="Praat",
    suffixes=(".textgrid",),
    made_for="Praat 6, TextGrid",
    keeps=frozenset({"tracks", "overlap", "empty tracks"}),
    remark="Between spans stand empty intervals; read in UTF-8 or UTF-16, long or short.",
)

_EXPECTED = 'a Praat TextGrid: "ooTextFile", "TextGrid" and its tiers'
_TOKEN = re.compile(
    r'"(?P<text>[^"]*+(?:""[^"]*+)*+)"'
    r"|(?<!\S)!.*"
    r"|(?<!\S)(?P<flag><\w+>)(?!\S)"
    r"|(?<!\S)(?P<number>[-+]?\d[\d.eE+-]*)(?!\S)"
)


def write(path: Path, labels: Labels, timebase: Timebase, *_: object) -> list[Loss]:
    """Write a TextGrid from the first to the last instant of video and spans."""
    start_s = min([timebase.start_s, *(span.start_s for span in labels.spans)])
    end_s = max([timebase.end_s, *(span.end_s for span in labels.spans)])
    lanes = lanes_of(labels, edges_s)
    lines = [
        'File type = "ooTextFile"',
        'Object class = "TextGrid"',
        "",
        f"xmin = {positional(start_s)} ",
        f"xmax = {positional(end_s)} ",
        "tiers? <exists> ",
        f"size = {len(lanes)} ",
        "item []: ",
    ]
    for number, lane in enumerate(lanes, start=1):
        lines += _tier(number, lane, start_s, end_s)
    atomic_write_text(path, "\n".join(lines) + "\n")
    return []


def read(path: Path, *_: object) -> LabelRows:
    """Read all tiers; a point is a mark without a duration.

    Raises Sd2Error when the file is no TextGrid in text form, or ends too early.
    """
    tokens = _Tokens(path, read_text(path, _EXPECTED))
    tokens.heading()
    tokens.number("xmin")
    tokens.number("xmax")
    result = LabelRows()
    has_tiers = tokens.next("flag", "flag <exists>") == "<exists>"
    for _tier_number in range(tokens.count("tiers") if has_tiers else 0):
        kind, name = tokens.text("class of a tier"), tokens.text("name of a tier")
        if kind not in ("IntervalTier", "TextTier"):
            raise Sd2Error(f"{path} has a tier of class {kind[:50]!r}", "IntervalTier or TextTier")
        track, overlap = track_of(name)
        result.tracks.append((track, overlap))
        tokens.number("xmin")
        tokens.number("xmax")
        for number in range(tokens.count("intervals")):
            start_s = tokens.number("start of an interval")
            end_s = tokens.number("end of an interval") if kind == "IntervalTier" else start_s
            text = tokens.text("text of an interval")
            # An interval of nothing is the gap between two spans, a point of nothing is not.
            if text.strip() or kind == "TextTier":
                place = f"tier {name!r}, interval {number + 1}"
                result.rows.append(Row(place, start_s, end_s, text, track))
    return result


def _tier(number: int, lane: Lane, start_s: float, end_s: float) -> list[str]:
    intervals: list[tuple[float, float, str]] = []
    reached_s = start_s
    for span in lane.spans:
        if span.start_s > reached_s:
            intervals.append((reached_s, span.start_s, ""))
        intervals.append((span.start_s, span.end_s, span.label))
        reached_s = span.end_s
    if reached_s < end_s:
        intervals.append((reached_s, end_s, ""))
    lines = [
        f"    item [{number}]:",
        '        class = "IntervalTier" ',
        f"        name = {_quoted(lane.name)} ",
        f"        xmin = {positional(start_s)} ",
        f"        xmax = {positional(end_s)} ",
        f"        intervals: size = {len(intervals)} ",
    ]
    for index, (first_s, last_s, text) in enumerate(intervals, start=1):
        lines += [
            f"        intervals [{index}]:",
            f"            xmin = {positional(first_s)} ",
            f"            xmax = {positional(last_s)} ",
            f"            text = {_quoted(text)} ",
        ]
    return lines


def _quoted(text: str) -> str:
    return '"' + text.replace('"', '""') + '"'


class _Tokens:
    """Sequence of the texts, numbers and flags of a file."""

    def __init__(self, path: Path, text: str) -> None:
        self._path = path
        self._first_line = text.lstrip().split("\n", 1)[0][:100]
        self._tokens: Iterator[re.Match[str]] = (
            match for match in _TOKEN.finditer(text) if match.lastgroup is not None
        )

    def heading(self) -> None:
        if "ooBinaryFile" in self._first_line:
            raise Sd2Error(
                f"{self._path} is a binary file of Praat", _EXPECTED, "Save it as a text file there"
            )
        if "chronological" in self._first_line:
            raise Sd2Error(
                f"{self._path} is a chronological TextGrid", _EXPECTED, "Save it as a text file"
            )
        if "ooTextFile" not in self._first_line:
            raise Sd2Error(f"{self._path} begins with {self._first_line!r}", _EXPECTED)
        self.text("type of the file")
        class_name = self.text("class of the object")
        if class_name != "TextGrid":
            raise Sd2Error(
                f"{self._path} holds a {class_name[:50]!r}", _EXPECTED, "Save the TextGrid in Praat"
            )

    def text(self, what: str) -> str:
        return self.next("text", what).replace('""', '"')

    def number(self, what: str) -> float:
        token = self.next("number", what)
        value = finite_number(token)
        if value is None:
            raise Sd2Error(f"{self._path} has {token[:50]!r} for the {what}", "a finite number")
        return value

    def count(self, what: str) -> int:
        token = self.next("number", f"number of {what}")
        value = whole_number(token)
        if value is None:
            raise Sd2Error(f"{self._path} has {token[:50]!r} {what}", "a whole number from 0 on")
        return value

    def next(self, kind: str, what: str) -> str:
        match = next(self._tokens, None)
        if match is None:
            raise Sd2Error(
                f"{self._path} ends before the {what}",
                "a whole TextGrid",
                "Copy the file again, or save it again in Praat",
            )
        if match.lastgroup != kind:
            raise Sd2Error(
                f"{self._path} has {match[0][:50]!r} where the {what} should be",
                "a TextGrid as Praat saves it",
                "Save it again in Praat",
            )
        return str(match[kind])
